"""What a flight is made of before it begins."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lcd_flight.control import flight_law
from lcd_flight.flight.manoeuvres import pressed_down
from lcd_flight.model import (
    GRAVITY_M_PER_S2,
    ControlLaw,
    FlightPlan,
    LegKind,
    SafetyLimits,
    Trajectory,
    Vehicle,
)
from lcd_flight.safety.gate import GateLimits
from lcd_flight.safety.monitors import Monitor, monitors

SPARE_SHARE = 0.85
"""Of the thrust limit: a plan that stays below leaves what control needs."""


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
    foreseen_saturation: tuple[bool, ...]
    """For each leg, whether its plan alone comes so near the thrust limit that motors will reach theirs: it was
    rehearsed so, and the position error tells whether it goes well."""
    monitors: tuple[Monitor, ...]
    gate: GateLimits

    @staticmethod
    def of(
        plan: FlightPlan, vehicle: Vehicle, limits: SafetyLimits, law: ControlLaw = flight_law.command
    ) -> FlightSetup:
        """Derive paths, monitors and gate."""
        paths = tuple(pressed_down(g.trajectory) if g.kind is LegKind.LAND else g.trajectory for g in plan.legs)
        lowest_m = min(float(g.trajectory.waypoints()[:, 2].min()) for g in plan.legs)
        gate = GateLimits.of(vehicle)
        saturating = tuple(_peak_thrust_N(g.trajectory, vehicle) > SPARE_SHARE * gate.thrust_N for g in plan.legs)
        return FlightSetup(plan, vehicle, limits, law, paths, lowest_m, saturating, monitors(limits), gate)

    @property
    def ground_z_m(self) -> float:
        """Height of the ground that flights start from, in the world."""
        return self.plan.start_m[2]

    @property
    def lowest_z_m(self) -> float:
        """The lowest ground that a landing away from the plan may find."""
        return min(self.ground_z_m, self.limits.geofence.low_m[2])


def _peak_thrust_N(trajectory: Trajectory, vehicle: Vehicle) -> float:
    """Largest thrust that a trajectory takes by itself, m |a + g e3|, sampled at 100 Hz."""
    times_s = np.linspace(0.0, trajectory.duration_s, math.ceil(100.0 * trajectory.duration_s) + 1)
    acceleration = trajectory.derivative(times_s, 2)[:, :3] + (0.0, 0.0, GRAVITY_M_PER_S2)
    return vehicle.mass_kg * float(np.linalg.norm(acceleration, axis=1).max())
