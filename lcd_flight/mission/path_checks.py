"""What a planned flight is held to before it is rehearsed: the fence, the planner's limits, the battery."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from lcd_flight.mission.mission import Mission
from lcd_flight.model import FlightPlan, FloatArray, Leg, LegKind, RefusedError, Vehicle
from lcd_flight.planning.limits import check_limits, peaks
from lcd_flight.safety.fence import stopping_margin_m

SAMPLE_S = 0.01
"""The path is looked at as often as the control loop runs."""
_LIMIT_KEYS = {
    "plan_speed": "max_velocity",
    "plan_thrust": "max_thrust_ratio",
    "plan_tilt": "max_tilt_deg",
    "plan_rate": "max_body_rate_deg",
}
ROUNDING_M = 1e-6
"""A leg that ends on the fence, e.g. on the ground, may be this far outside."""


def require_flyable(plan: FlightPlan, mission: Mission, vehicle: Vehicle) -> None:
    """Do nothing for a plan that keeps to the mission's limits.

    Raises:
        RefusedError: it does not; one line for each leg and limit.
    """
    lines = tuple(violations(plan, mission, vehicle))
    if lines:
        raise RefusedError("\n".join(lines))


def violations(plan: FlightPlan, mission: Mission, vehicle: Vehicle) -> Iterator[str]:
    """One line for each limit that a leg breaks, with where, how much and the remedy."""
    for leg in plan.legs:
        for text in (*_outside_fence(leg, mission), *_beyond_limits(leg, mission, vehicle)):
            yield f"{leg_place(leg, mission)}: {text}"
    endurance_s = mission.vehicle.battery.endurance_s
    if plan.duration_s > endurance_s:
        yield (
            f"{mission.place('plan')}: takes {plan.duration_s:.0f} s, more than vehicle.battery.endurance "
            f"{endurance_s:g} s; fly less, or faster"
        )


def leg_place(leg: Leg, mission: Mission) -> str:
    """Where in the mission a leg comes from, in words for messages."""
    ways = {"trajectory": "the way to its first waypoint", "land": "the way to above the landing"}
    if leg.item is None:
        return leg.kind.value
    kind = next(iter(type(mission.plan[leg.item]).model_fields))
    way = f" ({ways[kind]})" if leg.kind is LegKind.TRANSFER else ""
    return f"{mission.place('plan', leg.item, kind)}{way}"


def _outside_fence(leg: Leg, mission: Mission) -> Iterator[str]:
    """Where the path leaves the fence, and where it flies so fast towards a wall that the flight would brake."""
    times = _sample_times_s(leg)
    positions = leg.trajectory.derivative(times, 0)[:, :3]
    low, high = (np.array(corner) for corner in (mission.safety.geofence.min_m, mission.safety.geofence.max_m))
    outside = np.maximum(low - positions, positions - high).max(axis=1)
    worst = int(np.argmax(outside))
    if outside[worst] > ROUNDING_M:
        yield (
            f"planned path is {outside[worst]:.2f} m outside safety.geofence at {times[worst]:.2f} s, near "
            f"{_point(positions[worst])}; move the waypoints inwards, lower planner.speed or enlarge the fence"
        )
        return
    yield from _too_fast_for_wall(leg, mission, times, positions)


def _too_fast_for_wall(leg: Leg, mission: Mission, times: FloatArray, positions: FloatArray) -> Iterator[str]:
    fence, velocities = mission.geofence(), leg.trajectory.derivative(times, 1)[:, :3]
    rows = zip(positions.tolist(), velocities.tolist(), strict=True)
    margins = np.array([stopping_margin_m(fence, tuple(p), tuple(v)) for p, v in rows])
    worst = int(np.argmin(margins))
    if margins[worst] < -ROUNDING_M:
        yield (
            f"planned path flies so fast towards the fence at {times[worst]:.2f} s, near {_point(positions[worst])}, "
            f"that a stop would end {-margins[worst]:.2f} m outside; lower planner.speed or enlarge safety.geofence"
        )


def _beyond_limits(leg: Leg, mission: Mission, vehicle: Vehicle) -> Iterator[str]:
    for finding in check_limits(peaks(leg.trajectory, vehicle), mission.plan_limits()):
        yield f"{finding.message}; fly slower or raise planner.limits.{_LIMIT_KEYS[finding.code]}"


def _sample_times_s(leg: Leg) -> FloatArray:
    """(T,) every `SAMPLE_S`, and both ends."""
    return np.linspace(0.0, leg.duration_s, math.ceil(leg.duration_s / SAMPLE_S) + 1)


def _point(p_W: FloatArray) -> str:
    return "({:.2f}, {:.2f}, {:.2f})".format(*p_W)
