"""mavsdk, which nobody here wrote, flies the simulated PX4 in real time; outcomes are judged, not times."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest

mavsdk = pytest.importorskip("mavsdk", reason="pip install 'lcd-flight[dev]'")

from mavsdk.plugins.action import Action, ActionError  # noqa: E402 - only where mavsdk is
from mavsdk.plugins.offboard import Attitude, Offboard, OffboardError  # noqa: E402
from mavsdk.plugins.param import Param, ParamError  # noqa: E402
from mavsdk.plugins.telemetry import Telemetry  # noqa: E402

pytestmark = pytest.mark.realtime
PATIENCE_S = 20.0
HOVER = 0.5


@pytest.fixture
def port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        number: int = probe.getsockname()[1]
        return number


@pytest.fixture
def vehicle(port: int) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-c", "from lcd_flight.cli.main import lcd; lcd()", "sim", "mavlink", "--own-mocap"]
    more = ["--port", str(port), "--mocap", "none", "--boot", "0.5", "--seconds", "60", "--json"]
    with subprocess.Popen([*command, *more], stdout=subprocess.PIPE, text=True) as process:
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


def test_mavsdk_flies_it(vehicle: subprocess.Popen[str], system: mavsdk.System) -> None:
    action, offboard, telemetry, param = Action(system), Offboard(system), Telemetry(system), Param(system)
    assert system.get_system_id() == 1
    assert param.get_param_float("MPC_THR_HOVER") == pytest.approx(0.5)
    assert param.get_param_int("COM_OBL_RC_ACT") == 4
    with pytest.raises(ParamError):
        param.get_param_int("MPC_THR_HOVER")
    param.set_param_int("COM_OBL_RC_ACT", 5)
    assert param.get_param_int("COM_OBL_RC_ACT") == 5
    until(lambda: height(telemetry) is not None)
    offboard.set_attitude(Attitude(0.0, 0.0, 90.0, 0.0))
    arm(action)
    until(telemetry.armed)
    until(lambda: started(offboard))
    fly(offboard, telemetry)
    with pytest.raises(ActionError):
        action.disarm()
    action.land()
    until(lambda: not telemetry.armed())
    assert height(telemetry) == pytest.approx(0.0, abs=0.05)
    vehicle.send_signal(signal.SIGINT)
    last_line = (vehicle.communicate(timeout=PATIENCE_S)[0]).splitlines()[-1]
    events = json.loads(last_line)["events"]
    assert events == ["disarmed, loiter", "armed, loiter", "armed, offboard", "armed, land", "disarmed, land"]


def fly(offboard: Offboard, telemetry: Telemetry) -> None:
    """Up, and then forward: at heading 90 that is east, which is y in NED."""
    offboard.set_attitude(Attitude(0.0, 0.0, 90.0, 1.25 * HOVER))
    until(lambda: (height(telemetry) or 0.0) > 0.5)
    before = telemetry.position_velocity_ned().position
    offboard.set_attitude(Attitude(0.0, -10.0, 90.0, HOVER))
    until(lambda: telemetry.position_velocity_ned().position.east_m > before.east_m + 0.4)
    assert abs(telemetry.position_velocity_ned().position.north_m - before.north_m) < 0.3
    offboard.set_attitude(Attitude(0.0, 10.0, 90.0, HOVER))


def arm(action: Action) -> None:
    """Once the checks pass."""

    def armed() -> bool:
        try:
            action.arm()
        except ActionError:
            return False
        return True

    until(armed)


def started(offboard: Offboard) -> bool:
    """Whether OFFBOARD was granted now."""
    try:
        offboard.start()
    except OffboardError:
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
