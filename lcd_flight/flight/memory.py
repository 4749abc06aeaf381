"""What one tick hands to the next. Frozen; the defaults are a flight that has not begun."""

from __future__ import annotations

from dataclasses import dataclass, field

from lcd_flight.model import AttitudeThrust, Phase, State, Trajectory, Vector3
from lcd_flight.safety.evidence import SafetyMemory


@dataclass(frozen=True, slots=True)
class Route:
    """What is being flown, and how far."""

    leg: int = -1
    """Index into the plan's legs; -1 before take-off."""
    leg_time_s: float = 0.0
    """Along the leg; stands still while a manoeuvre is flown."""
    path: Trajectory | None = None
    """The leg's, or a manoeuvre's."""
    path_time_s: float = 0.0
    on_leg: bool = False
    """Whether the path is the leg's own."""
    calm_s: float = 0.0
    """For how long the vehicle has stood still at the reference."""


@dataclass(frozen=True, slots=True)
class Contact:
    """How the vehicle moves, as far as it tells whether it stands on the ground."""

    v_smooth_W: Vector3 = (0.0, 0.0, 0.0)
    """m/s, velocity with noise averaged out."""
    still: bool = False
    """Whether that is next to nothing."""
    grounded_s: float = 0.0
    """For how long it has stood still although its thrust does not carry it."""
    stuck_s: float = 0.0
    """For how long it has stood on the ground although its reference is well above."""
    sink_speed: float = 0.0
    """m/s downwards, as fast as it may still be."""
    impact_speed: float = 0.0
    """m/s that the ground has taken from it at once, at the hardest."""


@dataclass(frozen=True, slots=True)
class Memory:
    """Everything but the inputs and the setup that decides a tick."""

    phase: Phase = Phase.IDLE
    phase_since_ns: int = 0
    now_ns: int | None = None
    """When the tick before began."""
    state: State | None = None
    """Newest known or predicted."""
    setpoint: AttitudeThrust | None = None
    """The newest that the control law gave."""
    integral: Vector3 = (0.0, 0.0, 0.0)
    invalid_commands: int = 0
    """Control steps in a row that were not finite."""
    saturated: bool = False
    hover_N: float | None = None
    """Thrust at which this flight hovers, as seen so far; None before the first hold."""
    limit_s: float | None = None
    """How long the phase may last."""
    route: Route = field(default_factory=Route)
    contact: Contact = field(default_factory=Contact)
    safety: SafetyMemory = field(default_factory=SafetyMemory)
