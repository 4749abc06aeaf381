"""One suite over every link: what the flight relies on, whatever is at the other end.

The simulator's links fly in virtual time; layers must not change what holds, only when. The Crazyflie link flies a
simulated Crazyflie over UDP, with cflib and its threads in between, and so in real time. The MAVLink link flies a
simulated autopilot of each flavour, with its bytes in memory, in virtual time.
"""

from __future__ import annotations

import asyncio
import inspect
import itertools
from collections.abc import Awaitable, Callable

import crazyflie_bench
import mavlink_bench
import numpy as np
import pytest

from lcd_flight import plugins
from lcd_flight.flight import virtual_time
from lcd_flight.flight.clock import RealClock
from lcd_flight.flight.virtual_time import VirtualClock
from lcd_flight.model import AttitudeThrust, Clock, Link, LinkContext, LinkReport, RefusedError, Vehicle
from lcd_flight.model.frames import tilt_of
from lcd_flight.wire.mocap_frame import MocapFrame, decode
from lcd_flight.worlds import load_vehicle

MS = 1_000_000
PERIOD_NS = 10 * MS
LEVEL = (0.0, 0.0, 0.0, 1.0)
VEHICLE: Vehicle = load_vehicle("crazyflie-2.1")

URIS = [
    "sim://",
    "sim://?noise_mm=1&noise_deg=0.5&twist=false",
    "sim+delay://?delay_ms=8",
    "sim+delay+drop://?delay_ms=4&delay_jitter_ms=4&drop=0.05",
]
SLOWEST_MS = 8
"""What the layers above may add."""
CRAZYFLIE = "udp://"
"""Stands for a simulated Crazyflie on a port of its own."""
MAVLINK = ("mavlink px4", "mavlink ardupilot")
"""Stand for simulated autopilots; their heartbeat, ten a second, says what holds."""
HEARTBEAT_MS = 105
REAL_TIME_MS = 60
"""What threads, the vehicle's own reports and a busy machine may add."""

Script = Callable[[Link, list[MocapFrame]], Awaitable[None]]


class SuiteClock:
    """Virtual time, except while a link needs the real one."""

    clock: Clock = VirtualClock()
    late_ms = SLOWEST_MS

    def now_ns(self) -> int:
        return self.clock.now_ns()

    async def sleep_until(self, deadline_ns: int) -> None:
        await self.clock.sleep_until(deadline_ns)


CLOCK = SuiteClock()


def late_ms() -> int:
    """How much later than stated things may be seen."""
    return CLOCK.late_ms


@pytest.fixture(params=[*URIS, *MAVLINK, pytest.param(CRAZYFLIE, marks=pytest.mark.realtime)])
def uri(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    uri: str = request.param
    if uri == CRAZYFLIE:
        monkeypatch.setattr(SuiteClock, "clock", RealClock())
        monkeypatch.setattr(SuiteClock, "late_ms", REAL_TIME_MS)
    elif uri in MAVLINK:
        monkeypatch.setattr(SuiteClock, "late_ms", HEARTBEAT_MS)
    return uri


@pytest.fixture(params=URIS)
def simulated(request: pytest.FixtureRequest) -> str:
    uri: str = request.param
    return uri


def context(frames: list[MocapFrame], seed: int = 3) -> LinkContext:
    return LinkContext(
        vehicle=VEHICLE,
        clock=CLOCK,
        initial_position_m=(1.0, -2.0, 0.0),
        initial_yaw_rad=0.5,
        seed=seed,
        publish_pose=lambda data: frames.append(decode(data)),
        rigid_body="cf1",
    )


def fly(uri: str, script: Script, seed: int = 3) -> list[MocapFrame]:
    """Run a script on an open link; returns all poses that were published meanwhile."""
    if uri == CRAZYFLIE:
        return asyncio.run(fly_crazyflie(script))
    if uri in MAVLINK:
        return fly_mavlink(uri, script)
    frames: list[MocapFrame] = []

    async def main() -> None:
        async with plugins.open_link(uri, context(frames, seed)) as link:
            await script(link, frames)
        assert asyncio.all_tasks() == {asyncio.current_task()}, "a task was left"

    virtual_time.run(main())
    return frames


async def fly_crazyflie(script: Script) -> list[MocapFrame]:
    """The same with a simulated Crazyflie. What is still in the air at the end is cut, to save time."""
    async with crazyflie_bench.bench() as bench:
        async with bench.link() as link:
            bench.frames.clear()
            await script(link, bench.frames)
            frames = list(bench.frames)
            link.stop_motors()
        assert not bench.left_over(), "a thread was left"
    return frames


def fly_mavlink(uri: str, script: Script) -> list[MocapFrame]:
    """The same with a simulated autopilot."""
    frames: list[MocapFrame] = []
    seen: list[MocapFrame] = []

    async def main() -> None:
        place = {"start_m": (1.0, -2.0, 0.0), "yaw_rad": 0.5}
        vehicle = mavlink_bench.bench(uri.split()[1], airframe=VEHICLE, published=frames, **place)
        async with vehicle as bench, bench.link() as link:
            frames.clear()
            await script(link, frames)
            seen.extend(frames)

    mavlink_bench.run(main)
    return seen


async def wait_ms(milliseconds: float) -> None:
    await CLOCK.sleep_until(CLOCK.now_ns() + round(milliseconds * MS))


def thrust(share_of_weight: float) -> AttitudeThrust:
    return AttitudeThrust(share_of_weight * VEHICLE.weight_N, LEVEL)


async def stream(link: Link, setpoint: AttitudeThrust, seconds: float) -> None:
    """What a healthy loop does: a fresh setpoint every 10 ms."""
    for _ in range(round(seconds * 100)):
        link.send(setpoint, CLOCK.now_ns())
        await wait_ms(10)


def report(link: Link) -> LinkReport:
    return link.report(CLOCK.now_ns())


async def climb(link: Link, seconds: float = 1.0) -> None:
    await link.arm()
    await stream(link, thrust(1.3), seconds)
    telemetry = report(link).telemetry
    assert telemetry is not None
    assert telemetry.airborne


def vertical_acceleration(frames: list[MocapFrame]) -> float:
    """m/s^2, of a parabola through the published heights."""
    times_s = np.array([frame.source_time_ns * 1e-9 for frame in frames])
    heights_m = np.array([frame.position[2] for frame in frames])
    return float(2.0 * np.polyfit(times_s - times_s[0], heights_m, 2)[0])


def test_connecting_gives_description_and_telemetry(uri: str) -> None:
    async def script(link: Link, frames: list[MocapFrame]) -> None:
        assert link.description
        await wait_ms(100)
        now = report(link)
        assert now.connected
        assert now.age_ns is not None
        assert 0 <= now.age_ns <= PERIOD_NS + late_ms() * MS
        assert now.telemetry is not None
        assert now.telemetry.battery_V is not None
        assert now.telemetry.battery_V > 3.0
        assert (now.telemetry.armed, now.telemetry.airborne, now.telemetry.crashed) == (False, False, False)
        assert now.telemetry.q_WB is not None
        assert tilt_of(now.telemetry.q_WB) < 0.01

    fly(uri, script)


def test_poses_are_published_at_a_steady_hundred_hertz_in_order(simulated: str) -> None:
    async def script(link: Link, frames: list[MocapFrame]) -> None:
        await wait_ms(1_000)

    frames = fly(simulated, script)
    assert len(frames) == 100
    assert {b.source_time_ns - a.source_time_ns for a, b in itertools.pairwise(frames)} == {PERIOD_NS}
    assert [f.sequence for f in frames] == list(range(100))
    assert {f.body for f in frames} == {"cf1"}
    assert frames[-1].position == pytest.approx((1.0, -2.0, 0.0), abs=0.02)


def test_sending_never_blocks(uri: str) -> None:
    async def script(link: Link, frames: list[MocapFrame]) -> None:
        assert not inspect.iscoroutinefunction(link.send)
        await link.arm()
        began = CLOCK.now_ns()
        for _ in range(1_000):
            link.send(thrust(0.1), began)
        assert CLOCK.now_ns() - began <= 10 * late_ms() * MS if uri == CRAZYFLIE else CLOCK.now_ns() == began
        await wait_ms(50)
        assert report(link).connected

    fly(uri, script)


def test_nothing_moves_before_arming(uri: str) -> None:
    async def script(link: Link, frames: list[MocapFrame]) -> None:
        await stream(link, thrust(1.5), 1.0)

    frames = fly(uri, script)
    assert frames[-1].position == pytest.approx((1.0, -2.0, 0.0), abs=0.02)


def test_an_armed_vehicle_flies_its_setpoints(uri: str) -> None:
    async def script(link: Link, frames: list[MocapFrame]) -> None:
        await climb(link)
        now = report(link)
        assert now.sent > 0
        assert now.telemetry is not None
        assert now.telemetry.armed
        if uri not in MAVLINK:  # which of its outputs are motors, an autopilot does not say
            assert now.telemetry.motor_shares is not None
            assert all(0.0 < share < 1.0 for share in now.telemetry.motor_shares)

    assert fly(uri, script)[-1].position[2] > 0.5


def test_the_freshest_setpoint_wins(uri: str) -> None:
    async def script(link: Link, frames: list[MocapFrame]) -> None:
        await climb(link)
        before = report(link).stale
        for _ in range(100):
            now_ns = CLOCK.now_ns()
            link.send(thrust(1.0), now_ns)
            await wait_ms(SLOWEST_MS + 1)
            link.send(thrust(0.0), now_ns - PERIOD_NS)
            await wait_ms(1)
        assert report(link).stale - before >= 75  # a layer may lose some
        telemetry = report(link).telemetry
        assert telemetry is not None
        assert telemetry.airborne

    fly(uri, script)


def test_a_stale_setpoint_is_never_flown(uri: str) -> None:
    async def script(link: Link, frames: list[MocapFrame]) -> None:
        await link.arm()
        for _ in range(100):
            link.send(thrust(1.5), CLOCK.now_ns() - 51 * MS)
            await wait_ms(10)
        assert report(link).stale >= 85
        assert report(link).sent <= 15  # what a lossy layer counts as sent

    frames = fly(uri, script)
    assert frames[-1].position[2] < 0.02


def test_from_a_tenth_of_a_second_without_a_setpoint_the_fallback_acts_and_says_so(uri: str) -> None:
    async def script(link: Link, frames: list[MocapFrame]) -> None:
        await climb(link, 2.0)
        assert not report(link).fallback_active
        last_ns = CLOCK.now_ns() - PERIOD_NS  # when `stream` sent the last one
        await CLOCK.sleep_until(last_ns + 70 * MS)
        assert not report(link).fallback_active
        await CLOCK.sleep_until(last_ns + (100 + late_ms() + 15) * MS)
        now = report(link)
        assert now.fallback_active
        assert now.telemetry is not None
        assert any("no fresh setpoint for 100 ms" in text for text in now.telemetry.messages)
        again = report(link).telemetry
        assert again is not None
        assert again.messages == ()

    fly(uri, script)


def test_the_fallback_is_level_and_comes_down_slowly(uri: str) -> None:
    if uri in MAVLINK:
        pytest.skip("its fallback is silence: the autopilot's own failsafe flies")

    async def script(link: Link, frames: list[MocapFrame]) -> None:
        await climb(link, 1.0)
        await stream(link, AttitudeThrust(VEHICLE.weight_N, (0.1, 0.0, 0.0, 0.995)), 0.3)
        await wait_ms(1_500)
        telemetry = report(link).telemetry
        assert telemetry is not None
        assert telemetry.q_WB is not None
        assert tilt_of(telemetry.q_WB) < 0.05

    assert -1.0 < vertical_acceleration(fly(uri, script)[-60:]) < 0.0


def test_a_fresh_setpoint_ends_the_fallback(uri: str) -> None:
    async def script(link: Link, frames: list[MocapFrame]) -> None:
        await climb(link)
        await wait_ms(300)
        assert report(link).fallback_active
        await stream(link, thrust(1.0), 0.2)
        assert not report(link).fallback_active

    fly(uri, script)


def test_without_a_first_setpoint_there_is_no_fallback(uri: str) -> None:
    async def script(link: Link, frames: list[MocapFrame]) -> None:
        await link.arm()
        await wait_ms(1_000)
        assert not report(link).fallback_active

    assert fly(uri, script)[-1].position[2] < 0.02


def test_a_stop_is_latched(uri: str) -> None:
    async def script(link: Link, frames: list[MocapFrame]) -> None:
        await climb(link)
        link.stop_motors()
        await wait_ms(late_ms() + 20)
        telemetry = report(link).telemetry
        assert telemetry is not None
        assert not telemetry.armed
        await stream(link, thrust(1.5), 2.0)
        telemetry = report(link).telemetry
        assert telemetry is not None
        if uri not in MAVLINK:
            assert telemetry.motor_shares is not None
            assert max(telemetry.motor_shares) == 0.0
        with pytest.raises(RefusedError, match="motors were stopped"):
            await link.arm()

    fly(uri, script)


def test_disarming_on_the_ground_can_be_undone(uri: str) -> None:
    async def script(link: Link, frames: list[MocapFrame]) -> None:
        await link.arm()
        await stream(link, thrust(0.3), 0.2)
        await link.disarm()
        await stream(link, thrust(1.5), 0.5)
        telemetry = report(link).telemetry
        assert telemetry is not None
        assert not telemetry.armed
        if uri not in MAVLINK:
            assert telemetry.motor_shares is not None
            assert max(telemetry.motor_shares) == 0.0
        await climb(link)

    fly(uri, script)


def test_it_closes_after_an_exception_and_leaves_no_task(uri: str) -> None:
    opened: list[Link] = []

    async def script(link: Link, frames: list[MocapFrame]) -> None:
        opened.append(link)
        await climb(link, 0.5)
        raise KeyError("flight code")

    with pytest.raises(KeyError, match="flight code"):
        fly(uri, script)

    async def afterwards() -> None:
        link = opened[0]
        link.send(thrust(1.0), 0)
        link.stop_motors()
        assert not link.report(0).connected
        with pytest.raises(RefusedError):
            await link.arm()

    virtual_time.run(afterwards())


def test_the_same_seed_gives_the_same_flight_and_another_seed_another(simulated: str) -> None:
    async def script(link: Link, frames: list[MocapFrame]) -> None:
        await climb(link, 0.5)
        await wait_ms(300)

    first = fly(simulated, script)
    assert first == fly(simulated, script)
    assert first != fly(simulated, script, seed=4)
