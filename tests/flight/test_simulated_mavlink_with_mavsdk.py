"""mavsdk, which nobody here wrote, flies the simulated vehicle in real time; outcomes are judged, not times."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pytest

mavsdk = pytest.importorskip("mavsdk", reason="pip install 'lcd-flight[dev]'")

from mavsdk.plugins.action import Action, ActionError  # noqa: E402 - only where mavsdk is
from mavsdk.plugins.offboard import Attitude, Offboard, OffboardError  # noqa: E402
from mavsdk.plugins.param import Param, ParamError  # noqa: E402
from mavsdk.plugins.telemetry import Telemetry  # noqa: E402

pytestmark = pytest.mark.realtime
PATIENCE_S = 20.0


@dataclass(frozen=True, slots=True)
class Case:
    """What differs."""

    flavour: str
    hover: float
    number: tuple[str, int]
    """A parameter that is an int, and its value."""
    share: tuple[str, float]
    """One that is a float."""
    arms_first: bool
    """Or enters the mode first; both are ways that clients go."""
    events: list[str]


PX4 = Case(
    flavour="px4",
    hover=0.5,
    number=("COM_OBL_RC_ACT", 4),
    share=("MPC_THR_HOVER", 0.5),
    arms_first=True,
    events=["disarmed, loiter", "armed, loiter", "armed, offboard", "armed, land", "disarmed, land"],
)
ARDUPILOT = Case(
    flavour="ardupilot",
    hover=0.369,
    number=("GUID_OPTIONS", 8),
    share=("MOT_THST_HOVER", 0.39),
    arms_first=False,
    events=["disarmed, stabilize", "disarmed, guided", "armed, guided", "armed, land", "disarmed, land"],
)


@pytest.fixture(params=[PX4, ARDUPILOT], ids=lambda case: case.flavour)
def case(request: pytest.FixtureRequest) -> Case:
    found: Case = request.param
    return found


@pytest.fixture
def port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        number: int = probe.getsockname()[1]
        return number


@pytest.fixture
def vehicle(case: Case, port: int) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-c", "from lcd_flight.cli.main import lcd; lcd()", "sim", "mavlink", "--own-mocap"]
    more = ["--flavour", case.flavour, "--port", str(port), "--mocap", "none", "--boot", "0.5", "--seconds", "60"]
    with subprocess.Popen([*command, *more, "--json", "--quiet"], stdout=subprocess.PIPE, text=True) as process:
        yield process
        process.kill()


@pytest.fixture
def system(vehicle: subprocess.Popen[str], port: int) -> Iterator[mavsdk.System]:
    kind = mavsdk.ComponentType.COMPANION_COMPUTER
    with mavsdk.Mavsdk(mavsdk.Configuration.create_with_component_type(kind)) as sdk:
        assert sdk.add_any_connection(f"udpin://127.0.0.1:{port}") == mavsdk.ConnectionResult.SUCCESS
        system = sdk.first_autopilot(PATIENCE_S)
        assert system is not None, "mavsdk did not discover the vehicle"
        yield system


def test_mavsdk_flies_it(case: Case, vehicle: subprocess.Popen[str], system: mavsdk.System) -> None:
    action, offboard, telemetry = Action(system), Offboard(system), Telemetry(system)
    assert system.get_system_id() == 1
    read_and_write(case, Param(system))
    telemetry.set_rate_position_velocity_ned(20.0)
    until(lambda: height(telemetry) is not None)
    offboard.set_attitude(Attitude(0.0, 0.0, 90.0, 0.0))
    if case.arms_first:
        until(lambda: succeeds(action.arm, ActionError))
        until(lambda: succeeds(offboard.start, OffboardError))
    else:
        until(lambda: succeeds(offboard.start, OffboardError))
        until(lambda: succeeds(action.arm, ActionError))
    until(telemetry.armed)
    fly(case, offboard, telemetry)
    with pytest.raises(ActionError):
        action.disarm()
    action.land()
    until(lambda: not telemetry.armed())
    assert height(telemetry) == pytest.approx(0.0, abs=0.05)
    vehicle.send_signal(signal.SIGINT)
    last_line = (vehicle.communicate(timeout=PATIENCE_S)[0]).splitlines()[-1]
    assert json.loads(last_line)["events"] == case.events


def read_and_write(case: Case, param: Param) -> None:
    """By type: each flavour has its way of putting an int into a float, and mavsdk knows both."""
    name, value = case.number
    assert param.get_param_int(name) == value
    assert param.get_param_float(case.share[0]) == pytest.approx(case.share[1])
    param.set_param_int(name, value + 1)
    assert param.get_param_int(name) == value + 1
    param.set_param_int(name, value)
    with pytest.raises(ParamError):
        param.get_param_int(case.share[0])


def fly(case: Case, offboard: Offboard, telemetry: Telemetry) -> None:
    """Up, and then forward: at heading 90 that is east, which is y in NED."""
    offboard.set_attitude(Attitude(0.0, 0.0, 90.0, 1.25 * case.hover))
    until(lambda: (height(telemetry) or 0.0) > 0.5)
    before = telemetry.position_velocity_ned().position
    offboard.set_attitude(Attitude(0.0, -10.0, 90.0, case.hover))
    until(lambda: telemetry.position_velocity_ned().position.east_m > before.east_m + 0.4)
    assert abs(telemetry.position_velocity_ned().position.north_m - before.north_m) < 0.35
    offboard.set_attitude(Attitude(0.0, 10.0, 90.0, case.hover))


def succeeds(act: Callable[[], object], failure: type[Exception]) -> bool:
    """Whether it was granted now."""
    try:
        act()
    except failure:
        return False
    return True


def height(telemetry: Telemetry) -> float | None:
    """Above the floor; None: no position has come yet."""
    position = telemetry.position_velocity_ned().position
    return None if position.down_m != position.down_m else -position.down_m


def until(holds: Callable[[], bool]) -> None:
    """Wait for it."""
    deadline = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < deadline, "it did not happen"
        time.sleep(0.05)
