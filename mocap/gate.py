"""What is not believed: poses that are no pose, and poses that no quadrotor can have reached since the last one."""

from __future__ import annotations

import math

from lcd_flight.model import MocapAxes, PoseOptions, RawPose
from lcd_flight.model.frames import angle_between
from lcd_flight.wire.mocap_frame import MocapFrame

JUMP_MARGIN_M = 0.05
"""Beside what the greatest speed allows."""
FLIP_RAD = math.radians(30.0)
"""From one frame to the next; more where a gap leaves time for more."""
MAX_TURN_RAD_PER_S = 30.0
FREEZE_FRAMES = 3
"""The very same numbers so often are a camera system that has stopped: a real one is never without noise."""
UNIT_TOLERANCE = 0.01
MAX_POSITION_M = 1e3
MAX_VELOCITY_M_PER_S = 100.0
MAX_BODY_RATE_RAD_PER_S = 200.0


def unusable(frame: MocapFrame, raw: RawPose, axes: MocapAxes) -> str:
    """Why a frame is worth nothing by itself; empty where it is a pose.

    axes: what the mission says of the source.
    """
    if frame.occluded:
        return "occluded"
    if frame.axes != axes:
        return f"frame is {frame.axes}, the mission expects {axes}"
    length = math.sqrt(sum(component * component for component in raw.q_WB))
    if not abs(length - 1.0) <= UNIT_TOLERANCE:
        return f"quaternion is not of unit length ({length:.3f})"
    for name, vector, limit, unit in (
        ("position", raw.p_WB, MAX_POSITION_M, "m"),
        ("velocity", raw.v_WB_W, MAX_VELOCITY_M_PER_S, "m/s"),
        ("body rates", raw.w_WB_B, MAX_BODY_RATE_RAD_PER_S, "rad/s"),
    ):
        # Written so that NaN fails too.
        if vector is not None and not all(abs(component) <= limit for component in vector):
            return f"{name} not finite, or beyond {limit:.0f} {unit}"
    return ""


def implausible(raw: RawPose, before: RawPose, dt_s: float, options: PoseOptions) -> str:
    """Why a pose cannot follow the one before it; empty where it can."""
    distance = math.dist(raw.p_WB, before.p_WB)
    reach = options.max_speed_m_s * dt_s + JUMP_MARGIN_M
    if distance > reach:
        return f"jump of {distance:.2f} m in {dt_s * 1e3:.0f} ms (limit {reach:.2f} m)"
    angle = angle_between(raw.q_WB, before.q_WB)
    turn = max(FLIP_RAD, MAX_TURN_RAD_PER_S * dt_s)
    if angle > turn:
        return f"flip of {math.degrees(angle):.0f} deg in {dt_s * 1e3:.0f} ms (limit {math.degrees(turn):.0f} deg)"
    return ""
