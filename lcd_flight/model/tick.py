"""The record of one control step: what it knew (TickInputs) and what it decided (Tick).

`tick(inputs, plan, memory) -> (Tick, memory)` is pure; inputs are logged whole, so a log can be fed back.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from lcd_flight.model.finding import Finding
from lcd_flight.model.phase import Phase
from lcd_flight.model.state import AttitudeThrust, Reference
from lcd_flight.model.telemetry import LinkReport, PoseReport
from lcd_flight.model.types import Vector3


class Command(StrEnum):
    """What the operator or the flight manager may ask of the tick."""

    CHECK = "check"
    """Begin the pre-flight."""
    CHECKED = "checked"
    """The pre-flight passed."""
    ARM = "arm"
    """The operator agreed."""
    TAKEOFF = "takeoff"
    RESUME = "resume"
    """Go on from BRAKE_HOLD."""
    LAND = "land"
    DESCEND = "descend"
    STOP_MOTORS = "stop_motors"


class MotorRequest(StrEnum):
    """What a tick asks of the link apart from its setpoint."""

    NONE = "none"
    ARM = "arm"
    DISARM = "disarm"
    STOP = "stop"
    """Emergency stop."""


@dataclass(frozen=True, slots=True)
class TickInputs:
    """All that a tick may know."""

    sequence: int
    now_ns: int
    """Host's monotonic time at which the tick began."""
    deadline_ns: int
    """When it should have begun."""
    missed: int
    """Ticks skipped since the last one."""
    pose: PoseReport
    link: LinkReport
    commands: tuple[Command, ...] = ()


@dataclass(frozen=True, slots=True)
class Tick:
    """What one control step decided. This record is what is sent, judged and logged."""

    sequence: int
    now_ns: int
    dt_s: float
    """Measured, since the tick before; what the step counted with, so at most 50 ms."""
    phase: Phase
    leg: int
    """Index into the plan's legs; -1 before take-off."""
    leg_time_s: float
    """Time along the leg's trajectory."""
    reference: Reference | None
    setpoint: AttitudeThrust | None
    """As transmitted, behind the gate; None where nothing is sent."""
    motors: MotorRequest
    position_error_W: Vector3 | None
    """Position minus reference in m; a reference that presses down to below the ground counts as on it."""
    saturated: bool
    """Whether a motor, or the thrust command, was at its limit."""
    findings: tuple[Finding, ...] = ()
