"""The MAVLink link and mavsdk's server plugins, an autopilot that nobody here wrote: real time, judged by outcome."""

from __future__ import annotations

import asyncio
import contextlib
import math
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from itertools import count, pairwise

import pytest
from mavsdk_autopilot import Heard, autopilot

from lcd_flight import plugins
from lcd_flight.flight.clock import RealClock
from lcd_flight.flight.rate import RateKeeper
from lcd_flight.flight.realtime import prioritised
from lcd_flight.model import AttitudeThrust, Link, LinkContext, RawPose, RefusedError
from lcd_flight.model.frames import from_yaw, multiply
from lcd_flight.model.ports import PoseListener
from lcd_flight.worlds import load_vehicle

pytest.importorskip("mavsdk", reason="pip install 'lcd-flight[dev]'")

pytestmark = pytest.mark.realtime
CLOCK = RealClock()
VEHICLE = load_vehicle("hummingbird")
YAW = 0.3
PITCH = math.radians(10.0)
START_M = (1.0, 2.0, 0.03)
SPEED = 0.3
FRAME_NS = 10_000_000
SETPOINTS, BEFORE_STOP = 200, 20
HOVER = 0.45
"""MPC_THR_HOVER there."""
ARM, DISARM_BY_FORCE = (1.0, 0.0), (0.0, 21196.0)
NOSE_DOWN = multiply(from_yaw(YAW), (0.0, math.sin(0.5 * PITCH), 0.0, math.cos(0.5 * PITCH)))
"""Our axes: a positive turn about y, which is left, lowers the nose."""


@pytest.fixture
def port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        number: int = probe.getsockname()[1]
        return number


@contextlib.asynccontextmanager
async def motion_capture() -> AsyncIterator[LinkContext]:
    """Sees a vehicle that stands and is said to move along x."""
    listeners: list[PoseListener] = []

    async def publish() -> None:
        for number in count():
            now_ns = CLOCK.now_ns()
            frame = RawPose(number, now_ns, now_ns, START_M, from_yaw(YAW), (SPEED, 0.0, 0.0), (0.1, 0.2, 0.3))
            for listener in listeners:
                listener(frame)
            await CLOCK.sleep_until(now_ns + FRAME_NS)

    publishing = asyncio.create_task(publish())
    try:
        yield LinkContext(VEHICLE, CLOCK, START_M, YAW, seed=0, listen_poses=listeners.append)
    finally:
        publishing.cancel()
        await asyncio.gather(publishing, return_exceptions=True)


def fly(port: int, flight: Callable[[Link], Awaitable[None]], *changes: str, options: str = "") -> Heard:
    """Connect, do what the flight does, and return what mavsdk heard."""

    async def whole() -> None:
        uri = f"mavlink+udp://127.0.0.1:{port}?autopilot=px4{options}"
        async with motion_capture() as context, plugins.open_link(uri, context) as link:
            await flight(link)

    with autopilot(port, *changes) as peer, prioritised():
        asyncio.run(whole())
        return peer.heard()


async def stream(link: Link, setpoint: AttitudeThrust, number: int) -> int:
    """What a flight does a hundred times a second; returns how many setpoints went out."""
    keeper = RateKeeper(CLOCK)
    before = link.report(CLOCK.now_ns()).sent
    for _ in range(number):
        link.send(setpoint, CLOCK.now_ns())
        await keeper.next()
    return link.report(CLOCK.now_ns()).sent - before


def attitude_ned(yaw: float, pitch: float) -> list[float]:
    """w, x, y, z of FRD in NED (or in a frame whose z is down): first yaw, clockwise, then pitch, nose up."""
    a, b = 0.5 * yaw, 0.5 * pitch
    return [math.cos(a) * math.cos(b), -math.sin(a) * math.sin(b), math.cos(a) * math.sin(b), math.sin(a) * math.cos(b)]


def armings(heard: Heard) -> list[tuple[float, float]]:
    """First and second parameter of each COMPONENT_ARM_DISARM."""
    return [(command["param1"], command["param2"]) for command in heard.commands if command["command"] == 400]


def is_complete(heard: Heard) -> bool:
    """Whether every packet came, in order."""
    return all((after - before) % 256 == 1 for before, after in pairwise(heard.sequence))


def test_it_is_armed_flown_at_100_hz_and_landed(port: int) -> None:
    sent = 0

    async def flight(link: Link) -> None:
        nonlocal sent
        await link.arm()
        report = link.report(CLOCK.now_ns())
        assert report.telemetry is not None
        assert report.telemetry.armed
        sent = await stream(link, AttitudeThrust(1.2 * VEHICLE.weight_N, NOSE_DOWN), SETPOINTS)
        await link.disarm()
        after = link.report(CLOCK.now_ns())
        assert after.telemetry is not None
        assert after.telemetry.armed is False
        assert after.lost == 0

    heard = fly(port, flight)
    assert heard.modes == ["OFFBOARD", "LAND"]
    assert armings(heard) == [ARM]
    assert sent == SETPOINTS
    assert is_complete(heard)
    flown = [target for target in heard.targets if target["thrust"] > 0.0]
    assert len(flown) == SETPOINTS
    for target in flown:
        assert (target["type_mask"], target["target_system"], target["target_component"]) == (7, 1, 1)
        assert target["q"] == pytest.approx(attitude_ned(math.pi / 2 - YAW, -PITCH), abs=1e-6)
        assert target["thrust"] == pytest.approx(1.2 * HOVER, abs=1e-6)
    assert all(target["thrust"] == 0.0 for target in heard.targets if target not in flown)
    assert stamps_grow(heard)


def stamps_grow(heard: Heard) -> bool:
    """Whether no setpoint is stamped before the one that it follows."""
    stamps = [target["time_boot_ms"] for target in heard.targets]
    return stamps == sorted(stamps)


def test_it_is_told_its_pose_and_the_time_of_the_same_clock(port: int) -> None:
    async def flight(_link: Link) -> None:
        began_ns = CLOCK.now_ns()
        await CLOCK.sleep_until(began_ns + 500_000_000)

    heard = fly(port, flight)
    assert heard.modes == []
    assert armings(heard) == []
    assert is_complete(heard)
    assert len(heard.poses) > 10
    for pose in heard.poses:
        assert (pose["frame_id"], pose["child_frame_id"], pose["estimator_type"]) == (20, 12, 2)
        assert [pose["x"], pose["y"], pose["z"]] == pytest.approx([2.0, 1.0, -0.03], abs=1e-6)
        assert pose["q"] == pytest.approx(attitude_ned(math.pi / 2 - YAW, 0.0), abs=1e-6)
        forward_right_down = [SPEED * math.cos(YAW), SPEED * math.sin(YAW), 0.0]
        assert [pose["vx"], pose["vy"], pose["vz"]] == pytest.approx(forward_right_down, abs=1e-6)
        assert [pose["rollspeed"], pose["pitchspeed"], pose["yawspeed"]] == pytest.approx([0.1, -0.2, -0.3], abs=1e-6)
        assert 0 < pose["quality"] <= 100
        assert min(pose["pose_covariance"][n] for n in (0, 6, 11, 15, 18, 20)) > 0.0
    answers = [answer for answer in heard.times if answer["tc1"] != 0]
    assert len(answers) > 10
    assert {answer["ts1"] for answer in answers} <= set(heard.asked)
    first, last = min(answer["tc1"] for answer in answers), max(answer["tc1"] for answer in answers)
    stamps_ns = [1000 * pose["time_usec"] for pose in heard.poses]
    assert first - 10**9 < min(stamps_ns) < max(stamps_ns) < last + 10**9
    beats = {(b["type"], b["autopilot"], b["base_mode"], b["system_status"]) for b in heard.heartbeats}
    assert beats == {(18, 8, 0, 4)}


def test_an_emergency_stop_disarms_it_by_force(port: int) -> None:
    async def flight(link: Link) -> None:
        await link.arm()
        await stream(link, AttitudeThrust(VEHICLE.weight_N, NOSE_DOWN), BEFORE_STOP)
        link.stop_motors()
        link.send(AttitudeThrust(VEHICLE.weight_N, NOSE_DOWN), CLOCK.now_ns())
        assert await disarmed(link)

    heard = fly(port, flight, options="&frame=flu")
    assert heard.modes == ["OFFBOARD"]
    assert armings(heard)[0] == ARM
    assert set(armings(heard)[1:]) == {DISARM_BY_FORCE}
    assert is_complete(heard)
    flown = [target for target in heard.targets if target["thrust"] > 0.0]
    assert len(flown) == BEFORE_STOP
    assert flown[-1]["q"] == pytest.approx(attitude_ned(-YAW, -PITCH), abs=1e-6)
    assert heard.poses[-1]["y"] == pytest.approx(-START_M[1])


async def disarmed(link: Link) -> bool:
    """Whether it says so before long: mavsdk's heartbeat comes once a second."""
    for _ in range(50):
        await asyncio.sleep(0.1)
        telemetry = link.report(CLOCK.now_ns()).telemetry
        if telemetry is not None and telemetry.armed is False:
            return True
    return False


def test_a_wrong_parameter_is_read_back_and_refused(port: int) -> None:
    async def flight(_link: Link) -> None:
        raise AssertionError("it connected")

    with pytest.raises(RefusedError) as refused:
        fly(port, flight, "COM_OBL_RC_ACT=5", "COM_OF_LOSS_T=3.5", "EKF2_HGT_REF=1")
    lines = str(refused.value).splitlines()[1:]
    assert [line.split(",")[0].strip() for line in lines] == [
        "COM_OF_LOSS_T is 3.5",
        "EKF2_HGT_REF is 1",
        "COM_OBL_RC_ACT is 5",
    ]


def test_a_refusal_to_arm_is_told_with_its_result(port: int) -> None:
    async def flight(link: Link) -> None:
        with pytest.raises(RefusedError, match=r"the autopilot will not arm: (TEMPORARILY_REJECTED|DENIED|FAILED)"):
            await link.arm()

    heard = fly(port, flight, "armable=0")
    assert heard.modes == ["OFFBOARD"]
    assert {(target["type_mask"], target["thrust"]) for target in heard.targets} == {(7, 0.0)}
