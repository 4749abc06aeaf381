"""The autopilot's own flying, where no client tells it an attitude: hold a place, climb, land, stay level.

Proportional, from position to velocity to acceleration, with PX4's gains (MPC_XY_P 0.95, MPC_XY_VEL_P_ACC 1.8,
MPC_Z_P 1, MPC_Z_VEL_P_ACC 4).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from lcd_flight.model import GRAVITY_M_PER_S2, Vector3
from sim_bridge.mavlink.estimator import Estimator
from sim_bridge.mavlink.frames import Hamilton, level, product

LARGEST_TILT = math.radians(25.0)
LARGEST_SPEED = 2.0
"""m/s towards a place."""
CLIMB = 1.0
"""m/s to a height."""


class Wish(NamedTuple):
    """What is to be flown: an attitude, and collective force as a share of the weight."""

    attitude: Hamilton
    force: float


class Goal(NamedTuple):
    """Where to be; None: that axis is not held."""

    place: tuple[float, float] | None
    """m along the frame's x and y; None: level, whatever it drifts."""
    down: float | None
    """m; None: `sink` alone."""
    sink: float
    """m/s downwards, beside what holds a height."""
    yaw: float
    """rad"""


def towards(goal: Goal, estimate: Estimator) -> Wish:
    """The attitude and force that take it there."""
    position, velocity = estimate.position, estimate.velocity
    wanted_sink = goal.sink if goal.down is None else _within(goal.down - position[2], CLIMB)
    up = -4.0 * (wanted_sink - velocity[2])
    lift = max(0.3, 1.0 + up / GRAVITY_M_PER_S2)
    forward, right = _ahead(_brake(goal, position, velocity), goal.yaw)
    pitch = -_within(math.atan2(forward, GRAVITY_M_PER_S2), LARGEST_TILT)
    roll = _within(math.atan2(right, GRAVITY_M_PER_S2), LARGEST_TILT)
    tilted = product(level(goal.yaw), _tilt(roll, pitch))
    return Wish(tilted, lift / (math.cos(roll) * math.cos(pitch)))


def _brake(goal: Goal, position: Vector3, velocity: Vector3) -> tuple[float, float]:
    """Acceleration along the frame's x and y."""
    if goal.place is None:
        return (0.0, 0.0)
    x, y = (
        1.8 * (_within(0.95 * (wanted - there), LARGEST_SPEED) - speed)
        for wanted, there, speed in zip(goal.place, position, velocity, strict=False)
    )
    return (x, y)


def _ahead(vector: tuple[float, float], yaw: float) -> tuple[float, float]:
    """A horizontal vector as seen from a heading: forward and right."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    return (cos * vector[0] + sin * vector[1], cos * vector[1] - sin * vector[0])


def _tilt(roll: float, pitch: float) -> Hamilton:
    """First roll, then pitch."""
    about_y = (math.cos(0.5 * pitch), 0.0, math.sin(0.5 * pitch), 0.0)
    return product(about_y, (math.cos(0.5 * roll), math.sin(0.5 * roll), 0.0, 0.0))


def _within(value: float, most: float) -> float:
    return max(-most, min(most, value))
