"""The simple legs of a flight: straight ways from rest to rest, and standing still.

A leg begins exactly where the one before ended: what is handed on is a pose (x, y, z in m, yaw in rad, unwrapped).
"""

from __future__ import annotations

import math

import numpy as np

from lcd_flight.model import FloatArray, Leg, LegKind, Trajectory
from lcd_flight.planning.minimum_snap import minimum_snap
from lcd_flight.planning.times import SAME_POINT

TURN_RATE = math.radians(45.0)
"""rad/s, mean, of a turn during a transfer."""
SHORTEST_TRANSFER_S = 1.0
DESCENT_SPEED = 0.25
"""m/s, mean, of a landing whose duration is left open."""


def straight(start: FloatArray, end: FloatArray, duration_s: float) -> Trajectory:
    """The way of least snap between two poses (4,), at rest at both; standing still where they are the same."""
    if np.abs(end - start).max() < SAME_POINT:
        return Trajectory.hover(start[:3].tolist(), float(start[3]), duration_s)
    return minimum_snap(np.stack([start, end]), np.array([duration_s]))


def takeoff(start: FloatArray, height_m: float, duration_s: float, item: int) -> Leg:
    """Straight up."""
    end = start + np.array([0.0, 0.0, height_m, 0.0])
    return Leg(LegKind.TAKEOFF, straight(start, end, duration_s), item=item)


def hold(pose: FloatArray, duration_s: float, item: int) -> Leg:
    """Stand still."""
    return Leg(LegKind.HOLD, Trajectory.hover(pose[:3].tolist(), float(pose[3]), duration_s), item=item)


def transfer(start: FloatArray, end: FloatArray, speed: float, item: int) -> Leg:
    """A gentle way at a mean `speed` in m/s, after which the vehicle settles; also where it is there already."""
    distance_m, turn_rad = float(np.linalg.norm(end[:3] - start[:3])), abs(float(end[3] - start[3]))
    duration_s = max(distance_m / speed, turn_rad / TURN_RATE, SHORTEST_TRANSFER_S)
    return Leg(LegKind.TRANSFER, straight(start, end, duration_s), settle=True, item=item)


def land(above: FloatArray, height_m: float, duration_s: float | None, item: int) -> Leg:
    """Straight down, at `DESCENT_SPEED` where no duration is given."""
    end = above - np.array([0.0, 0.0, height_m, 0.0])
    return Leg(LegKind.LAND, straight(above, end, duration_s or height_m / DESCENT_SPEED), item=item)
