"""The phases of a flight and what leads from one to another: one table, in which severity only rises.

The one way back up is the operator's RESUME from BRAKE_HOLD. On the ground a fault leads back to IDLE.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import IntEnum

from lcd_flight.model import Command, LegKind, Phase, Severity


class Event(IntEnum):
    """What may happen in a tick, in the order in which events of one tick are applied: the gravest last."""

    CHECK = 0
    """The flight manager begins the pre-flight."""
    CHECKED = 1
    """The pre-flight passed."""
    ARM = 2
    """The operator agreed."""
    TAKEOFF = 3
    RESUME = 4
    """The operator lets a held flight go on."""
    HOLD_LEG = 5
    """A leg that holds begins."""
    TRACK_LEG = 6
    LAND_LEG = 7
    TOUCHDOWN = 8
    EXPIRED = 9
    """The phase has lasted as long as it may (`TIME_LIMITS_S`)."""
    BRAKE = 10
    LAND = 11
    DESCEND = 12
    TAKEN_OVER = 13
    """Somebody else flies the vehicle now."""
    KILL = 14
    CRASHED = 15
    """The vehicle says so itself, or it is seen on the ground."""
    STOPPED_ALONE = 16
    """The operator stops the motors of a vehicle that its own failsafe flies."""
    CRASHED_ALONE = 17
    """A vehicle that its own failsafe flies says that it has crashed."""


OF_COMMAND: Mapping[Command, Event] = {
    Command.CHECK: Event.CHECK,
    Command.CHECKED: Event.CHECKED,
    Command.ARM: Event.ARM,
    Command.TAKEOFF: Event.TAKEOFF,
    Command.RESUME: Event.RESUME,
}
"""The other commands become findings, and lead on by their severity."""

OF_SEVERITY: Mapping[Severity, Event] = {
    Severity.BRAKE: Event.BRAKE,
    Severity.LAND: Event.LAND,
    Severity.DESCEND: Event.DESCEND,
    Severity.KILL: Event.KILL,
}

OF_LEG: Mapping[LegKind, Event] = {
    LegKind.TAKEOFF: Event.TAKEOFF,
    LegKind.HOLD: Event.HOLD_LEG,
    LegKind.TRANSFER: Event.TRACK_LEG,
    LegKind.TRAJECTORY: Event.TRACK_LEG,
    LegKind.LAND: Event.LAND_LEG,
}

TIME_LIMITS_S: Mapping[Phase, float] = {
    Phase.READY: 30.0,
    Phase.ARMED: 10.0,
    Phase.BRAKE_HOLD: 5.0,
}
"""How long a phase may last, where that does not depend on the flight.

DESCEND_BLIND is timed by the height at which it begins (`manoeuvres.blind_time_s`), LAND and LAND_NOW by their path and
`LANDING_GRACE_S`.
"""
LANDING_GRACE_S = 10.0
"""After the end of a landing's path; a vehicle that still has not touched down descends level, and its motors stop."""

_ON_GROUND = {
    Event.BRAKE: Phase.IDLE,
    Event.LAND: Phase.IDLE,
    Event.DESCEND: Phase.IDLE,
    Event.TAKEN_OVER: Phase.IDLE,
    Event.KILL: Phase.KILL,
    Event.CRASHED: Phase.CRASHED,
}
_ON_THE_WAY = {
    Event.HOLD_LEG: Phase.HOLD,
    Event.TRACK_LEG: Phase.TRACK,
    Event.LAND_LEG: Phase.LAND,
    Event.BRAKE: Phase.BRAKE_HOLD,
    Event.LAND: Phase.LAND_NOW,
    Event.DESCEND: Phase.DESCEND_BLIND,
    Event.TAKEN_OVER: Phase.HANDED_OVER,
    Event.KILL: Phase.KILL,
    Event.CRASHED: Phase.CRASHED,
}
_GOING_DOWN = {
    Event.TOUCHDOWN: Phase.LANDED,
    Event.DESCEND: Phase.DESCEND_BLIND,
    Event.TAKEN_OVER: Phase.HANDED_OVER,
    Event.KILL: Phase.KILL,
    Event.CRASHED: Phase.CRASHED,
}

TABLE: Mapping[Phase, Mapping[Event, Phase]] = {
    Phase.IDLE: {Event.CHECK: Phase.PREFLIGHT, Event.KILL: Phase.KILL, Event.CRASHED: Phase.CRASHED},
    Phase.PREFLIGHT: {Event.CHECKED: Phase.READY, **_ON_GROUND},
    Phase.READY: {Event.ARM: Phase.ARMED, Event.EXPIRED: Phase.IDLE, **_ON_GROUND},
    Phase.ARMED: {Event.TAKEOFF: Phase.TAKEOFF, Event.EXPIRED: Phase.IDLE, **_ON_GROUND},
    Phase.TAKEOFF: _ON_THE_WAY,
    Phase.HOLD: _ON_THE_WAY,
    Phase.TRACK: _ON_THE_WAY,
    Phase.LAND: {Event.BRAKE: Phase.LAND_NOW, Event.LAND: Phase.LAND_NOW, Event.EXPIRED: Phase.LAND_NOW, **_GOING_DOWN},
    Phase.BRAKE_HOLD: {
        Event.RESUME: Phase.HOLD,
        Event.EXPIRED: Phase.LAND_NOW,
        Event.LAND: Phase.LAND_NOW,
        Event.DESCEND: Phase.DESCEND_BLIND,
        Event.TAKEN_OVER: Phase.HANDED_OVER,
        Event.KILL: Phase.KILL,
        Event.CRASHED: Phase.CRASHED,
    },
    Phase.LAND_NOW: {Event.EXPIRED: Phase.DESCEND_BLIND, **_GOING_DOWN},
    Phase.DESCEND_BLIND: {Event.EXPIRED: Phase.KILL, **_GOING_DOWN},
    Phase.LANDED: {Event.KILL: Phase.KILL, Event.CRASHED: Phase.CRASHED},
    Phase.HANDED_OVER: {Event.STOPPED_ALONE: Phase.KILL, Event.CRASHED_ALONE: Phase.CRASHED},
    Phase.KILL: {},
    Phase.CRASHED: {},
}
"""What is not listed leaves the phase as it is."""


def after(phase: Phase, event: Event) -> Phase:
    """The phase that follows one event."""
    return TABLE[phase].get(event, phase)


def advance(phase: Phase, events: Iterable[Event]) -> Phase:
    """The phase that follows the events of one tick, the gravest applied last."""
    for event in sorted(events):
        phase = after(phase, event)
    return phase


def as_table() -> str:
    """The table in Markdown, one row a phase; empty cells change nothing."""
    head = ["phase", *(event.name for event in Event)]
    rows = [[phase, *(TABLE[phase].get(event, "") for event in Event)] for phase in Phase]
    return "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows])
