"""Somebody else flies: the flight sends nothing more, ends early, and says who it was."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
import synthetic_flight
from flight_bench import (
    LIMITS,
    TAKEOFF_TICK,
    Fault,
    Flight,
    codes,
    first,
    fly,
    healthy,
    phases,
    plan,
    setup,
    with_link,
    with_telemetry,
)

from lcd_flight.flight.replay import compare
from lcd_flight.flight.result import Story
from lcd_flight.model import Command, MotorRequest, Outcome, Phase, Severity, State, TickInputs
from lcd_flight.model.frames import IDENTITY
from lcd_flight.record import LogWriter, read_log
from lcd_flight.review.figures import figures_of
from lcd_flight.wire import json_records

WHO = "the pilot took over: mode POSCTL"
AFTER = 150
"""Ticks since take-off."""


def taken_over(after: int, inputs: TickInputs) -> TickInputs:
    return with_link(inputs, taken_over=WHO) if after >= AFTER else inputs


def story_of(flight: Flight) -> Story:
    story = Story()
    for inputs, decided in flight:
        story.observe(inputs, decided)
    return story


def test_it_ends_in_the_tick_that_sees_it_and_nothing_is_sent_any_more() -> None:
    flight = fly(fault=taken_over)
    assert phases(flight)[-1] is Phase.HANDED_OVER
    assert first(flight, Phase.HANDED_OVER) == AFTER
    assert "taken_over" in codes(flight)
    for _, decided in flight[TAKEOFF_TICK + AFTER :]:
        assert decided.setpoint is None
        assert decided.motors is MotorRequest.NONE


def test_it_is_an_early_end_and_who_took_over_is_its_reason() -> None:
    story = story_of(fly(fault=taken_over))
    assert story.outcome is Outcome.ABORTED
    assert story.outcome.exit_code == 4
    assert story.reason == WHO


def test_a_fault_of_the_same_tick_or_later_changes_nothing() -> None:
    def everything(after: int, inputs: TickInputs) -> TickInputs:
        inputs = taken_over(after, inputs)
        return with_link(inputs, connected=False, age_ns=2_000_000_000) if after >= AFTER else inputs

    flight = fly(fault=everything)
    assert phases(flight)[-1] is Phase.HANDED_OVER
    assert all(decided.motors is MotorRequest.NONE for _, decided in flight[TAKEOFF_TICK + AFTER :])


def test_a_landed_vehicle_has_landed_whoever_flies_it_then() -> None:
    def afterwards(after: int, inputs: TickInputs) -> TickInputs:
        return with_link(inputs, taken_over=WHO) if after > landed else inputs

    landed = first(fly(), Phase.LANDED)
    flight = fly(fault=afterwards)
    assert phases(flight)[-1] is Phase.LANDED
    assert story_of(flight).outcome is Outcome.LANDED


def test_a_replay_hands_over_too() -> None:
    assert compare(fly(fault=taken_over), setup()).equal


def test_the_log_of_it_tells_the_same(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    writer = LogWriter(path, synthetic_flight.header(plan=plan(), limits=LIMITS))
    for inputs, decided in fly(fault=taken_over):
        writer.write(inputs, decided)
    writer.close()
    log = read_log(path)
    assert figures_of(log).outcome is Outcome.ABORTED
    assert [timed.finding.message for timed in log.findings if timed.finding.code == "taken_over"] == [WHO]


def test_a_log_from_before_reads_as_nobody() -> None:
    state = State((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), IDENTITY, (0.0, 0.0, 0.0))
    inputs = healthy(0, state, 0)
    record = msgspec.json.decode(json_records.encode(inputs))
    del record["link"]["taken_over"], record["link"]["flown_by_pilot"]
    assert json_records.decode(msgspec.json.encode(record), TickInputs) == inputs
    with pytest.raises(msgspec.ValidationError):
        json_records.decode(b'{"link": {"taken_over": 1}}', TickInputs)


def handed_over(pilot: bool | None, crash: bool = False) -> Fault:
    """Somebody takes over; a second later, maybe, the vehicle says that it has crashed."""

    def fault(after: int, inputs: TickInputs) -> TickInputs:
        if after < AFTER:
            return inputs
        inputs = with_link(inputs, taken_over=WHO, flown_by_pilot=pilot)
        return with_telemetry(inputs, crashed=True) if crash and after >= AFTER + 100 else inputs

    return fault


STOPPED = {AFTER + 50: (Command.STOP_MOTORS,)}


def test_the_operator_stops_what_flies_by_itself_for_as_long_as_it_takes() -> None:
    flight = fly(fault=handed_over(pilot=False), orders=STOPPED, linger=100)
    assert phases(flight)[-2:] == [Phase.HANDED_OVER, Phase.KILL]
    stops = [decided.motors for _, decided in flight if decided.phase is Phase.KILL]
    assert len(stops) > 40
    assert set(stops) == {MotorRequest.STOP}
    assert story_of(flight).outcome is Outcome.CUT
    assert compare(flight, setup()).equal


def test_he_does_so_also_in_the_tick_that_sees_it() -> None:
    flight = fly(fault=handed_over(pilot=False), orders={AFTER: (Command.STOP_MOTORS,)})
    assert phases(flight)[-1] is Phase.KILL


@pytest.mark.parametrize("at", [AFTER, AFTER + 50])
def test_what_a_pilot_flies_is_not_stopped_and_the_screen_says_why(at: int) -> None:
    flight = fly(fault=handed_over(pilot=True), orders={at: (Command.STOP_MOTORS,)}, linger=100)
    assert phases(flight)[-1] is Phase.HANDED_OVER
    assert MotorRequest.STOP not in {decided.motors for _, decided in flight}
    told = [finding for _, decided in flight for finding in decided.findings if finding.code == "operator_stop"]
    assert [(f.severity, f.message) for f in told] == [
        (Severity.WARN, f"not sent ({WHO}): the operator stopped the motors")
    ]


@pytest.mark.parametrize(("pilot", "last"), [(False, Phase.CRASHED), (True, Phase.HANDED_OVER)])
def test_a_crash_counts_where_nobody_else_flies(pilot: bool, last: Phase) -> None:
    flight = fly(fault=handed_over(pilot, crash=True), linger=200)
    assert phases(flight)[-1] is last
    assert MotorRequest.STOP not in {decided.motors for _, decided in flight}


def test_what_a_log_from_before_tells_is_decided_as_then() -> None:
    """It does not say who flew: whatever was ordered, the hand-over stood, with the findings of that time."""
    flight = fly(fault=handed_over(pilot=None, crash=True), orders=STOPPED, linger=200)
    assert phases(flight)[-1] is Phase.HANDED_OVER
    (stop,) = [f for _, decided in flight for f in decided.findings if f.code == "operator_stop"]
    assert (stop.severity, stop.message) == (Severity.KILL, "the operator stopped the motors")
