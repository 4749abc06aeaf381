"""Where the vehicle would come to rest, and whether that is inside the geofence."""

from __future__ import annotations

import math

from lcd_flight.model import Geofence, Vector3

STOPPING_DECELERATION = 4.0
"""m/s^2, what a stop is planned with: a tilt of 22 degrees, which every shipped vehicle can do."""


def stopping_point_m(p_W: Vector3, v_W: Vector3) -> Vector3:
    """Where a vehicle at `p_W` in m with `v_W` in m/s comes to rest, braking straight on: p + v |v| / (2 a)."""
    reach_s = math.hypot(*v_W) / (2.0 * STOPPING_DECELERATION)
    return (p_W[0] + v_W[0] * reach_s, p_W[1] + v_W[1] * reach_s, p_W[2] + v_W[2] * reach_s)


def stopping_margin_m(fence: Geofence, p_W: Vector3, v_W: Vector3) -> float:
    """Clearance in m of the vehicle and of its stopping point from the walls and the ceiling; negative is outside.

    The floor is left out: it is the ground, which every flight leaves and comes back to.
    """
    stop = stopping_point_m(p_W, v_W)
    return min(_wall_clearance_m(fence, p_W), _wall_clearance_m(fence, stop))


def _wall_clearance_m(fence: Geofence, p_W: Vector3) -> float:
    low, high = fence.low_m, fence.high_m
    return min(p_W[0] - low[0], high[0] - p_W[0], p_W[1] - low[1], high[1] - p_W[1], high[2] - p_W[2])
