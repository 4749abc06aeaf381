from __future__ import annotations

from itertools import product

import pytest

from lcd_flight.flight.phases import (
    OF_COMMAND,
    OF_LEG,
    OF_SEVERITY,
    TABLE,
    TIME_LIMITS_S,
    Event,
    advance,
    after,
    as_table,
)
from lcd_flight.model import Command, LegKind, Phase, Severity

GROUND = (Phase.IDLE, Phase.PREFLIGHT, Phase.READY, Phase.ARMED)
ON_THE_WAY = (Phase.TAKEOFF, Phase.HOLD, Phase.TRACK)
SEVERITY = {
    **dict.fromkeys(GROUND, 0),
    **dict.fromkeys(ON_THE_WAY, 0),
    Phase.LAND: 1,
    Phase.BRAKE_HOLD: 1,
    Phase.LAND_NOW: 2,
    Phase.DESCEND_BLIND: 3,
    Phase.LANDED: 4,
    Phase.HANDED_OVER: 4,
    Phase.KILL: 5,
    Phase.CRASHED: 5,
}
FAULTS = (Event.BRAKE, Event.LAND, Event.DESCEND, Event.TAKEN_OVER, Event.KILL, Event.CRASHED)
ALONE = (Event.STOPPED_ALONE, Event.CRASHED_ALONE)

# Every transition there is, written out once more; every other pair must leave the phase as it is.
EXPECTED = """
idle:          CHECK preflight, KILL kill, CRASHED crashed
preflight:     CHECKED ready, BRAKE idle, LAND idle, DESCEND idle, TAKEN_OVER idle, KILL kill,
               CRASHED crashed
ready:         ARM armed, EXPIRED idle, BRAKE idle, LAND idle, DESCEND idle, TAKEN_OVER idle, KILL kill,
               CRASHED crashed
armed:         TAKEOFF takeoff, EXPIRED idle, BRAKE idle, LAND idle, DESCEND idle, TAKEN_OVER idle, KILL kill,
               CRASHED crashed
takeoff:       HOLD_LEG hold, TRACK_LEG track, LAND_LEG land, BRAKE brake_hold, LAND land_now, DESCEND descend_blind,
               TAKEN_OVER handed_over, KILL kill, CRASHED crashed
hold:          HOLD_LEG hold, TRACK_LEG track, LAND_LEG land, BRAKE brake_hold, LAND land_now, DESCEND descend_blind,
               TAKEN_OVER handed_over, KILL kill, CRASHED crashed
track:         HOLD_LEG hold, TRACK_LEG track, LAND_LEG land, BRAKE brake_hold, LAND land_now, DESCEND descend_blind,
               TAKEN_OVER handed_over, KILL kill, CRASHED crashed
land:          TOUCHDOWN landed, EXPIRED land_now, BRAKE land_now, LAND land_now, DESCEND descend_blind,
               TAKEN_OVER handed_over, KILL kill, CRASHED crashed
brake_hold:    RESUME hold, EXPIRED land_now, LAND land_now, DESCEND descend_blind, TAKEN_OVER handed_over,
               KILL kill, CRASHED crashed
land_now:      TOUCHDOWN landed, EXPIRED descend_blind, DESCEND descend_blind, TAKEN_OVER handed_over,
               KILL kill, CRASHED crashed
descend_blind: TOUCHDOWN landed, EXPIRED kill, DESCEND descend_blind, TAKEN_OVER handed_over, KILL kill, CRASHED crashed
landed:        KILL kill, CRASHED crashed
handed_over:   STOPPED_ALONE kill, CRASHED_ALONE crashed
kill:
crashed:
"""


def expected() -> dict[tuple[Phase, Event], Phase]:
    pairs = {}
    for line in EXPECTED.replace(",\n", ", ").strip().splitlines():
        phase, _, moves = line.partition(":")
        for move in filter(None, (part.strip() for part in moves.split(","))):
            event, target = move.split()
            pairs[Phase(phase), Event[event]] = Phase(target)
    return pairs


@pytest.mark.parametrize(("phase", "event"), list(product(Phase, Event)))
def test_every_pair(phase: Phase, event: Event) -> None:
    assert after(phase, event) is expected().get((phase, event), phase)


def test_table_names_every_phase() -> None:
    assert (
        set(TABLE)
        == set(Phase)
        == {phase for phase, _ in expected()}
        | {
            Phase.HANDED_OVER,
            Phase.KILL,
            Phase.CRASHED,
        }
    )


@pytest.mark.parametrize(("phase", "event"), [(p, e) for p, e in product(Phase, Event) if p not in GROUND])
def test_severity_only_rises_except_by_resume(phase: Phase, event: Event) -> None:
    if (phase, event) == (Phase.BRAKE_HOLD, Event.RESUME):
        assert after(phase, event) is Phase.HOLD
    else:
        assert SEVERITY[after(phase, event)] >= SEVERITY[phase]


@pytest.mark.parametrize("event", Event)
def test_kill_and_crash_are_latched(event: Event) -> None:
    assert after(Phase.KILL, event) is Phase.KILL
    assert after(Phase.CRASHED, event) is Phase.CRASHED


@pytest.mark.parametrize("event", [e for e in Event if e not in ALONE])
def test_a_hand_over_is_latched_while_it_is_not_left_alone(event: Event) -> None:
    assert after(Phase.HANDED_OVER, event) is Phase.HANDED_OVER


@pytest.mark.parametrize(("phase", "event"), [(p, e) for p, e in product(Phase, ALONE) if p is not Phase.HANDED_OVER])
def test_what_counts_for_a_vehicle_alone_counts_after_a_hand_over_only(phase: Phase, event: Event) -> None:
    assert after(phase, event) is phase


@pytest.mark.parametrize("phase", [p for p in Phase if p not in (Phase.KILL, Phase.CRASHED, Phase.HANDED_OVER)])
def test_the_motors_can_be_stopped_from_everywhere_while_we_fly(phase: Phase) -> None:
    assert after(phase, Event.KILL) is Phase.KILL


@pytest.mark.parametrize(("phase", "event"), list(product(GROUND[1:], (Event.BRAKE, Event.LAND, Event.DESCEND))))
def test_faults_on_the_ground_never_lift_off(phase: Phase, event: Event) -> None:
    assert after(phase, event) is Phase.IDLE


def test_only_an_armed_vehicle_takes_off() -> None:
    flying = {p for p in Phase if p.airborne}
    lifts = {(p, e) for p, e in product(GROUND, Event) if after(p, e) in flying}
    assert lifts == {(Phase.ARMED, Event.TAKEOFF)}


@pytest.mark.parametrize("phase", [Phase.LANDED, Phase.HANDED_OVER, Phase.KILL, Phase.CRASHED])
def test_a_finished_flight_never_flies_again(phase: Phase) -> None:
    reached, fringe = {phase}, [phase]
    while fringe:
        here = fringe.pop()
        for event in Event:
            target = after(here, event)
            if target not in reached:
                reached.add(target)
                fringe.append(target)
    assert all(p.over for p in reached)


@pytest.mark.parametrize("phase", [p for p in Phase if p.airborne])
def test_every_flight_can_end(phase: Phase) -> None:
    events = (Event.LAND_LEG, Event.TOUCHDOWN, Event.EXPIRED, Event.LAND)
    for event in events:
        phase = after(phase, event)
    assert after(phase, Event.TOUCHDOWN).over or after(after(phase, Event.TOUCHDOWN), Event.EXPIRED).over


def test_the_gravest_event_of_a_tick_wins_whatever_the_order() -> None:
    assert advance(Phase.TRACK, [Event.DESCEND, Event.BRAKE, Event.LAND]) is Phase.DESCEND_BLIND
    assert advance(Phase.TRACK, [Event.LAND, Event.LAND_LEG]) is Phase.LAND_NOW
    assert advance(Phase.BRAKE_HOLD, [Event.BRAKE, Event.RESUME]) is Phase.BRAKE_HOLD
    assert advance(Phase.HOLD, []) is Phase.HOLD


def test_faults_are_ordered_by_severity_and_come_last() -> None:
    assert sorted((*FAULTS, *ALONE)) == [*FAULTS, *ALONE]
    assert min(FAULTS) > max(set(Event) - {*FAULTS, *ALONE})


def test_every_command_severity_and_leg_leads_somewhere() -> None:
    assert set(OF_COMMAND) == set(Command) - {Command.LAND, Command.DESCEND, Command.STOP_MOTORS}
    assert set(OF_SEVERITY) == {s for s in Severity if s >= Severity.BRAKE}
    assert set(OF_LEG) == set(LegKind)


def test_waiting_phases_have_a_time_limit_that_leads_on() -> None:
    assert set(TIME_LIMITS_S) == {Phase.READY, Phase.ARMED, Phase.BRAKE_HOLD}
    timed = {*TIME_LIMITS_S, Phase.LAND, Phase.LAND_NOW, Phase.DESCEND_BLIND}
    assert all(after(phase, Event.EXPIRED) is not phase for phase in timed)


def test_markdown_has_a_row_for_each_phase_and_a_column_for_each_event() -> None:
    lines = as_table().splitlines()
    assert len(lines) == len(Phase) + 2
    assert {line.count("|") for line in lines} == {len(Event) + 2}
    assert "| brake_hold |" in as_table()
