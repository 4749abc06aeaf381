"""What whoever watches is told, and how a flight's end is put into an outcome."""

from __future__ import annotations

from dataclasses import replace

import pytest
from flight_bench import Fault, fly, setup, with_telemetry, without_pose

from lcd_flight.flight.progress import Checked, Flying, Reporter
from lcd_flight.flight.result import FlightResult, LoopFigures, Story
from lcd_flight.model import Command, LegKind, Outcome, Phase, TickInputs
from lcd_flight.safety.preflight import Check

TRACKING = 420


def told(fault: Fault = lambda _tick, inputs: inputs, ticks: int = 3000) -> list[Flying]:
    events: list[Flying] = []

    def keep(event: object) -> None:
        assert isinstance(event, Flying)
        events.append(event)

    reporter = Reporter(setup(), keep)
    for inputs, decided in fly(fault=fault, ticks=ticks):
        reporter.observe(inputs, decided)
    return events


class TestReporter:
    def test_reports_at_10_hz_and_at_every_phase_and_leg(self) -> None:
        events = told()
        assert [e.phase for e in events if e.entered][-5:] == [
            *[Phase.TRACK] * 3,
            Phase.LAND,
            Phase.LANDED,
        ]
        between = [e for e in events if not e.entered]
        assert len(between) == pytest.approx(events[-1].time_s * 10, abs=10)

    def test_says_which_leg_and_how_far(self) -> None:
        on_trajectory = [e for e in told() if e.kind is LegKind.TRAJECTORY]
        assert {(e.leg, e.legs, e.leg_duration_s, e.waypoints) for e in on_trajectory} == {(3, 6, 3.0, 3)}
        assert [e.waypoint for e in on_trajectory] == sorted(e.waypoint for e in on_trajectory)
        assert {e.waypoint for e in on_trajectory} >= {1, 2}

    def test_before_take_off_there_is_no_leg(self) -> None:
        first = told(ticks=2)[0]
        assert (first.kind, first.leg, first.leg_duration_s, first.time_s, first.thrust_share) == (None, -1, 0, 0, None)

    def test_a_finding_that_lasts_is_told_once(self) -> None:
        low: Fault = lambda tick, i: with_telemetry(i, battery_V=3.1) if tick >= 100 else i  # noqa: E731
        telling = [e for e in told(low) if e.findings]
        assert [[f.code for f in e.findings] for e in telling] == [["battery_low"]]

    def test_one_that_comes_and_goes_is_told_after_a_second_of_quiet(self) -> None:
        def rejects(tick: int, inputs: TickInputs) -> TickInputs:
            count = sum(tick >= at for at in (300, 310, 350, 500))
            return replace(inputs, pose=replace(inputs.pose, rejected=count, reject_reason="jump"))

        telling = [e for e in told(rejects) if e.findings]
        assert [round(e.time_s, 2) for e in telling] == [3.0, 5.0]

    def test_what_the_vehicle_says_is_told_at_once_and_a_flood_of_it_is_cut(self) -> None:
        def talks(tick: int, inputs: TickInputs) -> TickInputs:
            return with_telemetry(inputs, messages=tuple(f"warning: {n}" for n in range(50)) if tick == 207 else ())

        telling = [e for e in told(talks) if e.messages]
        assert [round(e.time_s, 2) for e in telling] == [2.07]
        assert telling[0].messages == tuple(f"warning: {n}" for n in range(10))

    def test_remembers_the_largest_error(self) -> None:
        events = told()
        assert events[-1].max_error_m == max(e.max_error_m for e in events)
        assert 0.0 < events[-1].max_error_m < 0.1


class TestStory:
    def outcome(self, fault: Fault = lambda _tick, inputs: inputs, **options: object) -> tuple[Outcome, str]:
        story = Story()
        for inputs, decided in fly(fault=fault, **options):  # type: ignore[arg-type]
            story.observe(inputs, decided)
        return story.outcome, story.reason

    def test_a_completed_mission_has_landed(self) -> None:
        assert self.outcome() == (Outcome.LANDED, "")

    def test_a_hold_that_was_resumed_is_no_abort(self) -> None:
        def gap(tick: int, inputs: TickInputs) -> TickInputs:
            return without_pose(inputs, (tick - TRACKING) * 10_000_000) if 0 < tick - TRACKING < 10 else inputs

        assert self.outcome(gap, orders={600: (Command.RESUME,)}) == (Outcome.LANDED, "")
        assert self.outcome(gap) == (Outcome.ABORTED, "pose gap 53 ms (limit 50 ms)")

    def test_the_gravest_reason_is_told(self) -> None:
        orders = {TRACKING: (Command.LAND,), TRACKING + 20: (Command.STOP_MOTORS,)}
        assert self.outcome(orders=orders) == (Outcome.CUT, "the operator stopped the motors")

    def test_motors_stopped_after_landing_do_not_undo_it(self) -> None:
        landed = len(fly(linger=0)) - 3
        assert self.outcome(orders={landed + 1: (Command.STOP_MOTORS,)})[0] is Outcome.LANDED

    def test_a_crash_after_landing_does(self) -> None:
        landed = len(fly(linger=0)) - 3
        tipped: Fault = lambda tick, i: with_telemetry(i, crashed=True) if tick > landed else i  # noqa: E731
        assert self.outcome(tipped)[0] is Outcome.CRASHED

    def test_what_never_took_off_was_refused(self) -> None:
        assert Story().outcome is Outcome.REFUSED


def test_figures_of_the_loop() -> None:
    figures = LoopFigures()
    assert figures.lateness_ms(0.99) == 0.0
    inputs = fly(ticks=1)[0][0]
    for late_ns in range(0, 1_000_000, 10_000):
        figures.note(replace(inputs, now_ns=inputs.deadline_ns + late_ns, missed=2), inputs.deadline_ns + late_ns + 500)
    assert (figures.ticks, figures.missed) == (100, 200)
    assert [figures.lateness_ms(share) for share in (0.0, 0.5, 0.99, 1.0)] == pytest.approx([0.0, 0.5, 0.99, 0.99])
    assert figures.busy_ms(0.5) == pytest.approx(0.0005)


def test_results_are_values() -> None:
    result = FlightResult(Outcome.CUT, "why", Phase.KILL, (), LoopFigures(), ())
    assert result.exit_code == 5
    assert not Checked((Check("a", True, ""), Check("b", False, "no"))).ok
