"""Poses as they come from outside: ODOMETRY and VISION_POSITION_ESTIMATE, checked as the flavours do, in silence.

Sources: PX4, src/modules/mavlink/mavlink_receiver.cpp; ArduPilot, libraries/AP_VisualOdom and GCS_Common.cpp.
"""

from __future__ import annotations

import math
from typing import Any

from pymavlink.dialects.v20 import common

from lcd_flight.model import Vector3
from sim_bridge.mavlink.estimator import SeenPose
from sim_bridge.mavlink.frames import Hamilton, level, product, unit

LOCAL_NED, LOCAL_FRD = common.MAV_FRAME_LOCAL_NED, common.MAV_FRAME_LOCAL_FRD
BODY_FRD = common.MAV_FRAME_BODY_FRD
FAILED_QUALITY = -1
FARTHEST_M = 1e4


def pose_of_odometry(message: Any, frames: frozenset[int], estimators: frozenset[int] | None) -> SeenPose | None:
    """The pose in ODOMETRY; None where the autopilot ignores it.

    frames: of the pose; the velocity is taken in BODY_FRD alone. estimators: types that are taken; None: all.
    """
    if message.frame_id not in frames or message.child_frame_id != BODY_FRD or message.quality == FAILED_QUALITY:
        return None
    if estimators is not None and message.estimator_type not in estimators:
        return None
    velocity = (message.vx, message.vy, message.vz)
    known = velocity if all(map(math.isfinite, velocity)) else None
    return _pose((message.x, message.y, message.z), tuple(message.q), known, message.reset_counter)


def pose_of_vision(message: Any) -> SeenPose | None:
    """The pose in VISION_POSITION_ESTIMATE; None where it is not finite."""
    angles = (message.roll, message.pitch, message.yaw)
    if not all(map(math.isfinite, angles)):
        return None
    roll, pitch, yaw = (math.remainder(angle, math.tau) for angle in angles)
    about_y = (math.cos(0.5 * pitch), 0.0, math.sin(0.5 * pitch), 0.0)
    about_x = (math.cos(0.5 * roll), math.sin(0.5 * roll), 0.0, 0.0)
    q = product(level(yaw), product(about_y, about_x))
    return _pose((message.x, message.y, message.z), q, None, message.reset_counter)


def _pose(position: Vector3, q: tuple[float, ...], velocity_B: Vector3 | None, resets: int) -> SeenPose | None:
    """None where it is no place that a vehicle can be at, or no attitude."""
    w, x, y, z = q
    attitude: Hamilton = (w, x, y, z)
    fits = all(abs(value) <= FARTHEST_M for value in (*position, *(velocity_B or ())))
    if not (fits and all(map(math.isfinite, attitude)) and abs(math.hypot(*attitude) - 1.0) < 0.1):
        return None
    return SeenPose(position, unit(attitude), velocity_B, resets)
