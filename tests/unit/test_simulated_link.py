"""What is particular to `sim://`: exact instants, faults, noise, late wake-ups. The plant here only takes notes."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import sim_bridge.link
import sim_bridge.vehicle
from lcd_flight.flight import virtual_time
from lcd_flight.flight.virtual_time import VirtualClock
from lcd_flight.model import AttitudeThrust, InputError, LinkContext, RefusedError, State, Vehicle
from lcd_flight.model.frames import from_yaw, yaw_of
from lcd_flight.wire.mocap_frame import MocapFrame, decode
from lcd_flight.worlds import load_vehicle
from sim_bridge.camera import Camera
from sim_bridge.link import SimulatedLink, open_link

MS = 1_000_000
CLOCK = VirtualClock()
VEHICLE = load_vehicle("crazyflie-2.1")
LEVEL = (0.0, 0.0, 0.0, 1.0)


class Notes:
    """In the plant's place: writes down for how long which thrust was flown."""

    newest: Notes

    def __init__(self, vehicle: Vehicle, state: State, seed: int, battery_V: float | None = None) -> None:
        Notes.newest = self
        self.state = state
        self.battery_V = 4.2 if battery_V is None else battery_V
        self.motor_shares = (0.0, 0.0, 0.0, 0.0)
        self.on_ground = True
        self.crashed = False
        self.setpoint = AttitudeThrust(0.0, LEVEL)
        self.flown: list[tuple[int, float]] = []
        self.stops = 0
        self.lag_ns = 0

    def advance(self, dt_ns: int) -> None:
        self.flown.append((dt_ns, round(self.setpoint.thrust_N / VEHICLE.weight_N, 6)))

    def stop(self) -> None:
        self.setpoint = AttitudeThrust(0.0, LEVEL)
        self.stops += 1

    @property
    def timeline_ms(self) -> list[tuple[float, float]]:
        """(until when, thrust over weight), equal neighbours merged, from connecting."""
        line: list[tuple[float, float]] = []
        now_ns = 0
        for dt_ns, share in self.flown:
            now_ns += dt_ns
            if line and line[-1][1] == share:
                line.pop()
            line.append((now_ns / MS, share))
        return line


@pytest.fixture(autouse=True)
def plant_takes_notes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sim_bridge.vehicle, "Plant", Notes)
    monkeypatch.setattr(sim_bridge.link, "warm_up", lambda context: None)


Script = Callable[[SimulatedLink], Awaitable[None]]


def run(script: Script, options: Mapping[str, str] | None = None, **changes: Any) -> list[MocapFrame]:
    """Run a script on an open link, from time zero; returns what was published."""
    frames: list[MocapFrame] = []
    plain = LinkContext(VEHICLE, CLOCK, (1.0, 2.0, 0.0), 0.5, 7, publish_pose=lambda d: frames.append(decode(d)))
    context = replace(plain, **changes)

    async def main() -> None:
        async with open_link("", options or {}, context) as link:
            await script(link)

    virtual_time.run(main())
    return frames


async def until_ms(milliseconds: float) -> None:
    await CLOCK.sleep_until(round(milliseconds * MS))


def share(of_weight: float) -> AttitudeThrust:
    return AttitudeThrust(of_weight * VEHICLE.weight_N, from_yaw(1.0))


def test_a_setpoint_applies_from_its_arrival_to_the_nanosecond() -> None:
    async def script(link: SimulatedLink) -> None:
        await link.arm()
        await until_ms(12.345678)
        link.send(share(1.0), CLOCK.now_ns())
        await until_ms(23.4)
        link.send(share(1.25), CLOCK.now_ns())
        await until_ms(45.0)

    run(script)
    assert Notes.newest.timeline_ms == [(12.345678, 0.0), (23.4, 1.0), (45.0, 1.25)]


def test_the_fallback_acts_a_tenth_of_a_second_after_the_last_arrival() -> None:
    async def script(link: SimulatedLink) -> None:
        await link.arm()
        Notes.newest.on_ground = False
        await until_ms(11.5)
        link.send(share(1.3), CLOCK.now_ns())
        await until_ms(250.0)

    run(script)
    assert Notes.newest.timeline_ms == [(11.5, 0.0), (111.5, 1.3), (250.0, 0.95)]


def test_the_fallback_keeps_the_heading_and_gives_no_thrust_on_the_ground() -> None:
    async def script(link: SimulatedLink) -> None:
        await link.arm()
        link.send(share(0.2), CLOCK.now_ns())
        await until_ms(200.0)
        assert Notes.newest.setpoint.thrust_N == 0.0
        assert yaw_of(Notes.newest.setpoint.q_WB) == pytest.approx(0.5)  # where it stands, not where it was sent

    run(script)


@pytest.mark.parametrize(("age_ms", "stale"), [(50.0, 0), (50.000001, 1)])
def test_fifty_milliseconds_is_the_oldest_setpoint(age_ms: float, stale: int) -> None:
    async def script(link: SimulatedLink) -> None:
        await link.arm()
        await until_ms(100.0)
        link.send(share(1.0), CLOCK.now_ns() - round(age_ms * MS))
        report = link.report(CLOCK.now_ns())
        assert (report.stale, report.sent) == (stale, 1 - stale)

    run(script)


def test_a_setpoint_older_than_the_newest_is_refused_and_an_equal_one_replaces_it() -> None:
    async def script(link: SimulatedLink) -> None:
        await link.arm()
        await until_ms(30.0)
        link.send(share(1.0), 20 * MS)
        link.send(share(1.1), 20 * MS)
        link.send(share(1.2), 19 * MS)
        assert link.report(CLOCK.now_ns()).stale == 1
        assert Notes.newest.setpoint == share(1.1)

    run(script)


def test_a_setpoint_that_is_not_finite_is_refused() -> None:
    async def script(link: SimulatedLink) -> None:
        await link.arm()
        link.send(AttitudeThrust(math.nan, LEVEL), CLOCK.now_ns())
        link.send(AttitudeThrust(1.0, (math.inf, 0.0, 0.0, 1.0)), CLOCK.now_ns())
        report = link.report(CLOCK.now_ns())
        assert (report.stale, report.sent) == (2, 0)

    run(script)


def test_the_simulation_is_compiled_before_the_vehicle_lives(monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[str] = []

    class Watched(VirtualClock):
        def now_ns(self) -> int:
            order.append("clock")
            return super().now_ns()

    monkeypatch.setattr(sim_bridge.link, "warm_up", lambda context: order.append("compiled"))

    async def script(link: SimulatedLink) -> None:
        pass

    run(script, clock=Watched())
    assert order[0] == "compiled"


def test_a_pose_is_stamped_with_the_time_at_which_it_was_true() -> None:
    async def script(link: SimulatedLink) -> None:
        Notes.newest.lag_ns = 700_000
        await until_ms(8.0)

    (frame,) = run(script)
    assert (frame.source_time_ns, frame.send_time_ns) == (5_300_000, 6_000_000)


def test_stop_disarm_and_closing_stop_the_motors() -> None:
    async def script(link: SimulatedLink) -> None:
        await link.arm()
        link.send(share(1.0), CLOCK.now_ns())
        await link.disarm()
        assert Notes.newest.stops == 1
        await link.arm()
        link.stop_motors()
        assert Notes.newest.stops == 2

    run(script)
    assert Notes.newest.stops == 3


def test_a_crash_is_reported_and_locks_the_vehicle() -> None:
    async def script(link: SimulatedLink) -> None:
        await link.arm()
        link.send(share(1.0), CLOCK.now_ns())
        Notes.newest.crashed = True
        await until_ms(20.0)
        telemetry = link.report(CLOCK.now_ns()).telemetry
        assert telemetry is not None
        assert telemetry.crashed
        assert not telemetry.armed
        assert telemetry.messages == ("crashed: motors stopped",)
        with pytest.raises(RefusedError, match="it has crashed; connect anew"):
            await link.arm()

    run(script)


def test_a_pose_gap_begins_after_arming_and_loses_the_frames_in_it() -> None:
    async def script(link: SimulatedLink) -> None:
        await until_ms(100.0)
        await link.arm()
        await until_ms(1_000.0)

    frames = run(script, {"pose_gap_s": "0.3", "pose_gap_ms": "200"})
    missing = sorted(set(range(100)) - {frame.sequence for frame in frames})
    assert missing == list(range(40, 60))  # from 400 to 600 ms


def test_a_vehicle_that_dies_falls_silent_while_the_camera_still_sees_it() -> None:
    async def script(link: SimulatedLink) -> None:
        await until_ms(50.0)
        await link.arm()
        await until_ms(60.0)
        link.send(share(1.0), CLOCK.now_ns())
        await until_ms(500.0)
        report = link.report(CLOCK.now_ns())
        assert report.connected
        assert report.age_ns == (500 - 116) * MS
        with pytest.raises(RefusedError, match="it has no power"):
            await link.arm()

    frames = run(script, {"die_s": "0.0725"})
    assert Notes.newest.timeline_ms == [(60.0, 0.0), (122.5, 1.0), (500.0, 0.0)]
    assert len(frames) == 50


def test_the_dead_do_not_fall_back_even_where_both_are_noticed_at_once() -> None:
    async def script(link: SimulatedLink) -> None:
        await link.arm()
        Notes.newest.on_ground = False
        link.send(share(1.0), CLOCK.now_ns())
        await until_ms(300.0)

    run(script, {"die_s": "0.099"})
    assert Notes.newest.timeline_ms == [(99.0, 1.0), (300.0, 0.0)]


@pytest.mark.parametrize(("options", "expected_V"), [({}, 4.2), ({"battery_V": "3.1"}, 3.1)])
def test_the_battery_is_full_or_that_of_the_option(options: dict[str, str], expected_V: float) -> None:
    async def script(link: SimulatedLink) -> None:
        telemetry = link.report(CLOCK.now_ns()).telemetry
        assert telemetry is not None
        assert telemetry.battery_V == expected_V

    run(script, options)


def test_a_late_wake_up_goes_on_by_what_has_passed_and_skips_what_was_missed() -> None:
    class Sluggish(VirtualClock):
        """Wakes 37 ms late, once."""

        late = True

        async def sleep_until(self, deadline_ns: int) -> None:
            if self.late and deadline_ns >= 45 * MS:
                self.late = False
                deadline_ns += 37 * MS
            await super().sleep_until(deadline_ns)

    async def script(link: SimulatedLink) -> None:
        await until_ms(120.0)

    frames = run(script, clock=Sluggish())
    assert [f.source_time_ns / MS for f in frames] == [6, 16, 26, 36, 83, 86, 96, 106, 116]
    assert sum(dt for dt, _ in Notes.newest.flown) == 120 * MS


def test_an_error_of_the_simulation_is_not_swallowed() -> None:
    async def script(link: SimulatedLink) -> None:
        Notes.newest.state = None  # type: ignore[assignment]
        await until_ms(50.0)
        assert not link.report(CLOCK.now_ns()).connected

    with pytest.raises(AttributeError):
        run(script)


def test_before_connecting_nothing_is_known_and_nothing_can_be_armed() -> None:
    async def main() -> None:
        link = open_link("", {}, LinkContext(VEHICLE, CLOCK, (0.0, 0.0, 0.0), 0.0, 0))
        report = link.report(0)
        assert (report.connected, report.age_ns, report.telemetry) == (False, None, None)
        link.send(share(1.0), 0)
        link.stop_motors()
        with pytest.raises(RefusedError, match="not open"):
            await link.arm()

    asyncio.run(main())


@pytest.mark.parametrize(
    ("address", "options", "message"),
    [
        ("hall", {}, "sim:// takes no address, but was given 'hall'"),
        (
            "",
            {"noise_mm": "0"},
            r"sim://: option noise_mm=0: expected float >= 0.001; sim:// has the options noise_mm, ",
        ),
        ("", {"wind": "3"}, r"sim://: unknown option wind=3; sim:// has the options noise_mm, noise_deg, twist"),
        ("", {"battery_V": "full"}, r"sim://: option battery_V=full: expected"),
    ],
)
def test_wrong_options_are_input_errors(address: str, options: dict[str, str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        open_link(address, options, LinkContext(VEHICLE, CLOCK, (0.0, 0.0, 0.0), 0.0, 0))


def test_a_vehicle_without_an_onboard_controller_is_an_input_error() -> None:
    with pytest.raises(InputError, match="vehicle hummingbird has no onboard controller"):
        open_link("", {}, LinkContext(load_vehicle("hummingbird"), CLOCK, (0.0, 0.0, 0.0), 0.0, 0))


def test_camera_noise_has_the_stated_size_and_depends_on_seed_and_number_alone() -> None:
    state = State((1.0, 2.0, 3.0), (0.1, 0.2, 0.3), from_yaw(0.7), (0.4, 0.5, 0.6))

    def seen(seed: int, count: int = 2000) -> list[MocapFrame]:
        camera = Camera("cf1", seed, 0.3, 0.1, twist=True)
        return [decode(camera.frame(state, n, n)) for n in range(count)]

    frames = seen(1)
    assert frames[:50] == seen(1, 50)
    assert frames[:50] != seen(2, 50)
    positions = np.array([f.position for f in frames]) - state.p_WB
    velocities = np.array([f.velocity for f in frames]) - state.v_WB_W
    rates = np.array([f.body_rates for f in frames]) - state.w_WB_B
    yaws = np.array([yaw_of(f.quaternion) for f in frames]) - 0.7
    np.testing.assert_allclose(positions.std(axis=0), 0.3e-3, rtol=0.1)
    np.testing.assert_allclose(velocities.std(axis=0), 0.02, rtol=0.1)
    np.testing.assert_allclose(rates.std(axis=0), 0.05, rtol=0.1)
    np.testing.assert_allclose(yaws.std(), math.radians(0.1), rtol=0.1)
    assert abs(positions.mean(axis=0)).max() < 0.3e-3 / 10


def test_a_camera_may_leave_the_twist_to_the_filter() -> None:
    state = State((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), LEVEL, (0.0, 0.0, 0.0))
    frame = decode(Camera("cf1", 0, 0.3, 0.1, twist=False).frame(state, 3, 5))
    assert (frame.velocity, frame.body_rates) == (None, None)
    assert (frame.source_time_ns, frame.send_time_ns) == (3, 5)
