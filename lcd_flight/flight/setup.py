"""What a flight is made of before it begins (FlightSetup), and what one tick hands to the next (Memory)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

from lcd_flight.control import flight_law
from lcd_flight.flight.manoeuvres import pressed_down
from lcd_flight.model import (
    AttitudeThrust,
    FlightPlan,
    LegKind,
    Phase,
    Reference,
    SafetyLimits,
    State,
    Trajectory,
    Vector3,
    Vehicle,
)
from lcd_flight.safety.evidence import SafetyMemory
from lcd_flight.safety.gate import GateLimits
from lcd_flight.safety.monitors import Monitor, monitors


class ControlLaw(Protocol):
    """From state and reference to a setpoint; the integral goes in and comes out."""

    def __call__(
        self, state: State, reference: Reference, vehicle: Vehicle, integral: Vector3, dt_s: float
    ) -> tuple[AttitudeThrust, Vector3]:
        """One control step."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class FlightSetup:
    """Everything that stays the same from the first tick to the last. Built by `FlightSetup.of`."""

    plan: FlightPlan
    vehicle: Vehicle
    limits: SafetyLimits
    law: ControlLaw
    paths: tuple[Trajectory, ...]
    """Of each leg, as flown: a landing goes on to below the ground."""
    lowest_planned_z_m: float
    """Of the plan's start and its landings."""
    monitors: tuple[Monitor, ...]
    gate: GateLimits

    @staticmethod
    def of(
        plan: FlightPlan, vehicle: Vehicle, limits: SafetyLimits, law: ControlLaw = flight_law.command
    ) -> FlightSetup:
        """Derive paths, monitors and gate."""
        paths = tuple(pressed_down(g.trajectory) if g.kind is LegKind.LAND else g.trajectory for g in plan.legs)
        lowest_m = min(float(g.trajectory.waypoints()[:, 2].min()) for g in plan.legs)
        return FlightSetup(plan, vehicle, limits, law, paths, lowest_m, monitors(limits), GateLimits.of(vehicle))

    @property
    def ground_z_m(self) -> float:
        """Height of the ground that flights start from, in the world."""
        return self.plan.start_m[2]

    @property
    def lowest_z_m(self) -> float:
        """The lowest ground that a landing away from the plan may find."""
        return min(self.ground_z_m, self.limits.geofence.low_m[2])


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
    grounded_s: float = 0.0
    """For how long it has stood still although its thrust does not carry it."""
    stuck_s: float = 0.0
    """For how long it has stood on the ground although its reference is well above."""
    sink_speed: float = 0.0
    """m/s downwards, the highest of late."""
    v_smooth_W: Vector3 = (0.0, 0.0, 0.0)
    """m/s, velocity with noise averaged out."""


@dataclass(frozen=True, slots=True)
class Memory:
    """What one tick hands to the next. The default is a flight that has not begun."""

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
    blind_s: float = 0.0
    """Time given to a descent without pose."""
    route: Route = field(default_factory=Route)
    safety: SafetyMemory = field(default_factory=SafetyMemory)
