"""Whole flights in virtual time: mission, simulated link, pose filter, tick, and the way each of them ends."""

from __future__ import annotations

import asyncio
import contextlib
import signal
from collections.abc import Callable
from dataclasses import replace

import pytest
from short_mission import Listener, fly, mission, plan, setup, vehicle

from lcd_flight.flight import loop as loop_module
from lcd_flight.flight import session, virtual_time
from lcd_flight.flight.memory import Memory
from lcd_flight.flight.operator import Operator
from lcd_flight.flight.progress import Checked, Connected, Flying
from lcd_flight.flight.replay import differences
from lcd_flight.flight.session import FlightOptions
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.flight.tick import tick
from lcd_flight.model import InputError, MotorRequest, Outcome, Phase, RefusedError, Severity, Tick, TickInputs

UP = [Phase.IDLE, Phase.PREFLIGHT, Phase.READY, Phase.ARMED, Phase.TAKEOFF, Phase.TRACK]


class TestCleanFlight:
    def test_lands(self) -> None:
        result, listener = fly()
        assert (result.outcome, result.exit_code, result.reason) == (Outcome.LANDED, 0, "")
        assert listener.phases == [*UP, Phase.LAND, Phase.LANDED]
        assert listener.codes == set()
        assert abs(listener.height_m()) < 0.01
        assert all(check.ok for check in result.checks)
        assert result.figures.ticks == len(listener.flight)
        assert result.figures.missed == result.figures.stale == 0
        assert result.notes == ()
        assert listener.closed == 1

    def test_is_the_same_every_time_and_in_its_own_replay(self) -> None:
        (_, one), (_, two) = fly(seed=3), fly(seed=3)
        assert one.flight == two.flight
        assert differences(one.flight, setup()) == []

    def test_differs_by_seed(self) -> None:
        (_, one), (_, two) = fly(seed=3), fly(seed=4)
        assert one.flight[50][0].pose != two.flight[50][0].pose

    def test_other_gains_would_have_commanded_otherwise(self) -> None:
        _, listener = fly()
        gains = replace(vehicle().flight_gains, position=(3.0, 3.0, 8.0))
        softer = FlightSetup.of(plan(), replace(vehicle(), flight_gains=gains), mission().safety_limits())
        found = differences(listener.flight, softer)
        assert found
        assert max(difference.thrust_N for difference in found[:50]) > 0.0
        assert max(difference.angle_rad for difference in found) > 0.001

    def test_tells_who_watches(self) -> None:
        events: list[Connected | Checked | Flying] = []
        fly(progress=events.append)
        assert events[0] == Connected("sim://", "firmware sim-1")
        assert sum(isinstance(event, Checked) and event.ok for event in events) == 1
        flying = [event for event in events if isinstance(event, Flying)]
        entered = [event.phase for event in flying if event.entered]
        assert entered == [*UP, Phase.TRACK, Phase.TRACK, Phase.LAND, Phase.LANDED]
        assert all(event.findings == () for event in flying)
        in_air = [event for event in flying if event.phase is Phase.TRACK]
        assert len(in_air) == pytest.approx(10 * (in_air[-1].time_s - in_air[0].time_s), abs=5)
        assert {event.waypoint for event in in_air if event.waypoints} == {1, 2, 3}
        assert all(event.waypoints in (0, 3) for event in in_air)
        assert all(event.rate_hz == pytest.approx(100.0) for event in in_air[1:])
        assert all(event.battery_V and event.thrust_share and event.error_m is not None for event in in_air)
        assert in_air[-1].max_error_m >= max(event.error_m or 0.0 for event in in_air)

    def test_an_observer_that_fails_costs_a_note(self) -> None:
        def fail(_inputs: TickInputs, _tick: Tick) -> None:
            raise OSError("disk full")

        broken = Listener(act=fail)
        result, listener = fly(others=(broken,))
        assert result.outcome is Outcome.LANDED
        assert result.notes == ("Listener failed and was left out: OSError: disk full",)
        assert broken.closed == listener.closed == 1


# URI, outcome, phases after the climb, a finding that must be there, part of the reason
FAULTS = [
    ("sim://?pose_gap_s=3.5&pose_gap_ms=30", Outcome.LANDED, [Phase.LAND, Phase.LANDED], "pose_late", ""),
    (
        "sim://?pose_gap_s=3.5&pose_gap_ms=200",
        Outcome.ABORTED,
        [Phase.BRAKE_HOLD, Phase.LAND_NOW, Phase.LANDED],
        "pose_gap",
        "pose gap",
    ),
    (
        "sim://?pose_gap_s=3.5&pose_gap_ms=60000",
        Outcome.CUT,
        [Phase.BRAKE_HOLD, Phase.DESCEND_BLIND, Phase.KILL],
        "pose_lost",
        "pose gap 304 ms",
    ),
    ("sim+drop://?drop=0.05", Outcome.LANDED, [Phase.LAND, Phase.LANDED], None, ""),
    ("sim+delay://?delay_ms=12&delay_jitter_ms=4", Outcome.LANDED, [Phase.LAND, Phase.LANDED], None, ""),
    ("sim://?die_s=3.5", Outcome.CRASHED, None, "link_age", ""),
    ("sim+drop://?drop=0.4", Outcome.ABORTED, None, "link_loss_severe", "link loses"),
]


@pytest.mark.parametrize(("uri", "outcome", "then", "code", "reason"), FAULTS, ids=[row[0] for row in FAULTS])
def test_fault(uri: str, outcome: Outcome, then: list[Phase] | None, code: str | None, reason: str) -> None:
    result, listener = fly(uri)
    assert result.outcome is outcome
    assert reason in result.reason
    if then is not None:
        assert listener.phases == [*UP, *then]
    assert code is None or code in listener.codes
    assert all(t.setpoint is None for _, t in listener.flight if t.phase.over)


def test_the_lost_pose_is_answered_in_time() -> None:
    _, listener = fly("sim://?pose_gap_s=3.5&pose_gap_ms=60000")
    lost_ns = next(i.now_ns - (i.pose.age_ns or 0) for i, t in listener.flight if t.phase is Phase.BRAKE_HOLD)
    reached = {t.phase: i.now_ns - lost_ns for i, t in reversed(listener.flight)}
    assert 50e6 < reached[Phase.BRAKE_HOLD] <= 60e6
    assert 300e6 < reached[Phase.DESCEND_BLIND] <= 310e6


def test_an_empty_battery_lands() -> None:
    """Criticality is above what the battery holds under load, so that it is reached in the air."""
    battery = {"voltage_takeoff": 3.9, "voltage_warning": 3.88, "voltage_critical": 3.87}
    tired = mission(vehicle={"type": "crazyflie", "uri": "sim://", "battery": battery})
    result, listener = fly(flown=tired)
    assert result.outcome is Outcome.ABORTED
    assert listener.phases[-2:] == [Phase.LAND_NOW, Phase.LANDED]
    assert 2.0 <= listener.began_s(Phase.LAND_NOW) < 4.0
    assert "battery" in result.reason


class TestOperator:
    def pressed(self, at_s: list[float]) -> tuple[Operator, Callable[[TickInputs, Tick], None]]:
        """An operator who presses Ctrl-C at these times after take-off."""
        operator, begun, waiting = Operator(), list[int](), list(at_s)

        def act(inputs: TickInputs, tick: Tick) -> None:
            if not begun and tick.phase is Phase.TAKEOFF:
                begun.append(inputs.now_ns)
            while begun and waiting and inputs.now_ns - begun[0] >= waiting[0] * 1e9:
                waiting.pop(0)
                signal.raise_signal(signal.SIGINT)

        return operator, act

    @pytest.mark.parametrize(
        ("at_s", "outcome", "then"),
        [
            ([3.0], Outcome.ABORTED, [Phase.LAND_NOW, Phase.LANDED]),
            ([3.0, 3.3], Outcome.ABORTED, [Phase.LAND_NOW, Phase.DESCEND_BLIND, Phase.LANDED]),
            ([3.0, 3.3, 3.6], Outcome.CUT, [Phase.LAND_NOW, Phase.DESCEND_BLIND, Phase.KILL]),
        ],
    )
    def test_interrupts(self, at_s: list[float], outcome: Outcome, then: list[Phase]) -> None:
        operator, act = self.pressed(at_s)
        result, listener = fly(listener=Listener(act=act), operator=operator)
        assert result.outcome is outcome
        assert listener.phases == [*UP, *then]
        assert "the operator" in result.reason
        assert listener.closed == 1

    def test_an_interrupt_before_take_off_ends_it_on_the_ground(self) -> None:
        def act(inputs: TickInputs, tick: Tick) -> None:
            if tick.sequence == 100:
                signal.raise_signal(signal.SIGINT)

        result, listener = fly(listener=Listener(act=act))
        assert (result.outcome, result.exit_code) == (Outcome.REFUSED, 3)
        assert result.reason == "stopped before take-off: the operator asked to land"
        assert all(t.motors is MotorRequest.NONE for _, t in listener.flight)

    def test_signal_handlers_are_put_back(self) -> None:
        before = signal.getsignal(signal.SIGINT)
        fly()
        assert signal.getsignal(signal.SIGINT) is before


class TestRefusals:
    def test_a_low_battery(self) -> None:
        result, listener = fly("sim://?battery_V=3.5")
        assert (result.outcome, result.exit_code) == (Outcome.REFUSED, 3)
        assert result.reason == "battery 3.50 V, below vehicle.battery.voltage_takeoff 3.8 V: charge it"
        assert [check.name for check in result.checks if not check.ok] == ["battery"]
        assert listener.phases == [Phase.IDLE, Phase.PREFLIGHT]

    def test_every_failed_check_is_named(self) -> None:
        capture = {"rate": 50.0}
        result, _ = fly("sim://?battery_V=3.5", flown=mission(motion_capture=capture))
        assert [check.name for check in result.checks if not check.ok] == ["pose rate", "battery"]
        assert len(result.reason.splitlines()) == 2

    def test_no_pose_at_all(self, monkeypatch: pytest.MonkeyPatch) -> None:
        class Nowhere:
            def __call__(self, data: bytes) -> None:
                """Frames go nowhere."""

            def close(self) -> None:
                """Nothing is held."""

        monkeypatch.setattr(session, "pose_publisher", lambda _endpoint: Nowhere())
        result, listener = fly()
        assert result.outcome is Outcome.REFUSED
        assert "no pose: check motion_capture.endpoint" in result.reason
        waited_s = (listener.flight[-1][0].now_ns - listener.flight[0][0].now_ns) * 1e-9
        assert waited_s == pytest.approx(7.0, abs=0.2)

    def test_virtual_time_is_for_the_simulator(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(session, "is_simulated", lambda _uri: False)
        with pytest.raises(InputError, match="--fast flies the simulator only"):
            fly()

    def test_a_real_vehicle_is_not_armed_unasked(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(session, "is_simulated", lambda _uri: False)
        with pytest.raises(RefusedError, match="nobody was asked"):
            session.run_flight(mission(), plan(), vehicle(), FlightOptions())

    @pytest.mark.parametrize("agrees", [True, False])
    def test_who_is_asked_decides(self, agrees: bool) -> None:
        asked = []

        async def confirm(operator: Operator) -> bool:
            asked.append(operator)
            await asyncio.sleep(1.0)
            return agrees

        result, listener = fly(options=FlightOptions(confirm=confirm))
        assert len(asked) == 1
        assert result.outcome is (Outcome.LANDED if agrees else Outcome.REFUSED)
        assert result.reason == ("" if agrees else "arming was not confirmed")
        assert (Phase.ARMED in listener.phases) is agrees

    def test_an_answer_that_takes_too_long_comes_too_late(self) -> None:
        async def never(operator: Operator) -> bool:
            await asyncio.sleep(1e6)
            return True

        result, listener = fly(options=FlightOptions(confirm=never))
        assert result.reason == "stopped before take-off: ready has lasted 30.0 s"
        assert listener.phases == [Phase.IDLE, Phase.PREFLIGHT, Phase.READY, Phase.IDLE]


def test_everything_but_the_motors() -> None:
    result, listener = fly(options=FlightOptions(arm=False, idle_s=3.0))
    assert (result.outcome, result.exit_code) == (Outcome.OK, 0)
    assert listener.phases == [Phase.IDLE, Phase.PREFLIGHT, Phase.READY]
    assert all(t.setpoint is None and t.motors is MotorRequest.NONE for _, t in listener.flight)
    assert len(listener.flight) == pytest.approx(500, abs=15)


class TestBreakage:
    """The loop itself fails in the air: the vehicle comes down before anybody hears of it."""

    @pytest.fixture
    def links(self, monkeypatch: pytest.MonkeyPatch) -> list[object]:
        opened: list[object] = []
        original = session.open_link

        def open_link(uri: str, context: object) -> object:
            opened.append(original(uri, context))  # type: ignore[arg-type]
            return opened[-1]

        monkeypatch.setattr(session, "open_link", open_link)
        return opened

    def test_a_broken_tick_ends_in_a_level_descent(self, monkeypatch: pytest.MonkeyPatch, links: list[object]) -> None:
        def breaks(inputs: TickInputs, setup: FlightSetup, memory: Memory) -> tuple[Tick, Memory]:
            if memory.phase is Phase.TRACK and memory.route.leg_time_s > 0.5:
                raise ZeroDivisionError("a fault of ours")
            return tick(inputs, setup, memory)

        monkeypatch.setattr(loop_module, "tick", breaks)
        listener = Listener()
        with pytest.raises(ZeroDivisionError):
            fly(listener=listener)
        assert listener.flight[-1][1].phase is Phase.TRACK
        assert listener.closed == 1
        self.check_down(links)

    def test_a_cancelled_flight_too(self, links: list[object]) -> None:
        async def main() -> None:
            options = FlightOptions(fast=True)
            listener = Listener()
            flight = asyncio.ensure_future(session.fly(mission(), plan(), vehicle(), options, observers=(listener,)))
            while not listener.flight or listener.flight[-1][1].phase is not Phase.TRACK:
                await asyncio.sleep(0.1)
            await asyncio.sleep(1.0)
            flight.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await flight
            assert flight.cancelled()
            assert listener.closed == 1

        virtual_time.run(main())
        self.check_down(links)

    @staticmethod
    def check_down(links: list[object]) -> None:
        (link,) = links
        plant = link._vehicle._plant  # type: ignore[attr-defined]
        assert plant.on_ground
        assert not plant.crashed


def test_no_clean_flight_is_aborted() -> None:
    """Twenty seeds of noise."""
    for seed in range(20):
        result, listener = fly(seed=seed)
        gravest = [f.message for _, t in listener.flight for f in t.findings if f.severity >= Severity.BRAKE]
        assert (result.outcome, gravest) == (Outcome.LANDED, []), f"seed {seed}"
