"""Where the vehicle is, where it should be, and what is asked of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from lcd_flight.model.types import Quaternion, Vector3


@dataclass(frozen=True, slots=True)
class State:
    """Pose and twist of the vehicle, as the controller is given it."""

    p_WB: Vector3
    """Position in m."""
    v_WB_W: Vector3
    """Velocity in m/s, expressed in the world."""
    q_WB: Quaternion
    """Attitude, unit quaternion xyzw."""
    w_WB_B: Vector3
    """Body rates in rad/s."""


@dataclass(frozen=True, slots=True)
class Reference:
    """One instant of a trajectory: the flat outputs and their derivatives (paper, section II)."""

    p_W: Vector3
    """Position in m."""
    v_W: Vector3
    """Velocity in m/s."""
    a_W: Vector3
    """Acceleration in m/s^2."""
    j_W: Vector3
    """Jerk in m/s^3."""
    s_W: Vector3
    """Snap in m/s^4."""
    yaw_rad: float
    yaw_rate: float
    """rad/s"""
    yaw_acceleration: float
    """rad/s^2"""


@dataclass(frozen=True, slots=True)
class AttitudeThrust:
    """A setpoint of the flight loop: collective thrust and desired attitude."""

    thrust_N: float
    """Collective thrust in N, along the body z axis, >= 0."""
    q_WB: Quaternion
    """Desired attitude, unit quaternion xyzw."""
    yaw_rate: float = 0.0
    """Feed-forward yaw rate in rad/s, for links that can use it."""

    def is_finite(self) -> bool:
        """Whether every number in it is finite."""
        return math.isfinite(self.thrust_N) and math.isfinite(self.yaw_rate) and all(map(math.isfinite, self.q_WB))
