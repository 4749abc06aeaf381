"""ODOMETRY (331): where motion capture sees the vehicle, in the one form that both flavours fuse."""

from __future__ import annotations

import math
from dataclasses import dataclass

from drivers.mavlink import frames_wire
from drivers.mavlink.dialect import Message, mavlink
from drivers.mavlink.options import Frame
from lcd_flight.model import Quaternion, Vector3
from lcd_flight.model.frames import conjugate, rotate

POSITION_SIGMA_M = 0.005
ATTITUDE_SIGMA_RAD = 0.02
VELOCITY_SIGMA = 0.05
"""m/s, of a velocity that comes from differences of positions."""
RATE_SIGMA = 0.2
"""rad/s"""
FULL_QUALITY = 100
"""Percent; ArduPilot ignores a message of quality -1 without a word."""


@dataclass(frozen=True, slots=True)
class Odometry:
    """Pose and twist in our frames."""

    stamp_ns: int
    """Of our clock, which TIMESYNC tells the vehicle."""
    p_WB: Vector3
    q_WB: Quaternion
    v_WB_W: Vector3
    w_WB_B: Vector3
    resets: int = 0
    """Jumps of the pose so far."""


def message(odometry: Odometry, frame: Frame) -> Message:
    """LOCAL_FRD to BODY_FRD, from a vision estimator; velocity and rates in the body's axes.

    Raises:
        ValueError: a number is not finite.
    """
    numbers = (*odometry.p_WB, *odometry.q_WB, *odometry.v_WB_W, *odometry.w_WB_B)
    if not all(map(math.isfinite, numbers)):
        raise ValueError("a pose that is not finite")
    velocity = frames_wire.body(rotate(conjugate(odometry.q_WB), odometry.v_WB_W))
    return mavlink.MAVLink_odometry_message(
        odometry.stamp_ns // 1000,
        mavlink.MAV_FRAME_LOCAL_FRD,
        mavlink.MAV_FRAME_BODY_FRD,
        *frames_wire.vector(odometry.p_WB, frame),
        frames_wire.attitude(odometry.q_WB, frame),
        *velocity,
        *frames_wire.body(odometry.w_WB_B),
        _diagonal(POSITION_SIGMA_M, ATTITUDE_SIGMA_RAD),
        _diagonal(VELOCITY_SIGMA, RATE_SIGMA),
        odometry.resets % 256,
        mavlink.MAV_ESTIMATOR_TYPE_VISION,
        FULL_QUALITY,
    )


def _diagonal(first_sigma: float, second_sigma: float) -> list[float]:
    """The upper triangle of a 6 x 6 covariance, row by row: three variances, and three others."""
    values = [0.0] * 21
    for axis, index in enumerate((0, 6, 11, 15, 18, 20)):
        values[index] = (first_sigma if axis < 3 else second_sigma) ** 2
    return values
