"""Somebody else flies: the flight sends nothing more, ends early, and says who it was."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
import synthetic_flight
from flight_bench import LIMITS, TAKEOFF_TICK, Flight, codes, first, fly, healthy, phases, plan, setup, with_link

from lcd_flight.flight.replay import compare
from lcd_flight.flight.result import Story
from lcd_flight.model import MotorRequest, Outcome, Phase, State, TickInputs
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
    del record["link"]["taken_over"]
    assert json_records.decode(msgspec.json.encode(record), TickInputs) == inputs
    with pytest.raises(msgspec.ValidationError):
        json_records.decode(b'{"link": {"taken_over": 1}}', TickInputs)
