"""Whether the onboard estimate can be flown with: by its own flags, and against motion capture. Pure."""

from __future__ import annotations

import math

from drivers.mavlink.autopilot import Autopilot
from drivers.mavlink.picture import Picture
from lcd_flight.model import Quaternion, RawPose, Vector3
from lcd_flight.model.frames import angle_between

SETTLED_NS = 500_000_000
"""It must be right for so long."""
LIMIT_NS = 30_000_000_000
MAX_DISTANCE_M = 0.05
MAX_ANGLE_RAD = math.radians(5.0)
POSE_AGE_NS = 200_000_000
"""An older pose, or an older report, is none."""


def objection(autopilot: Autopilot, picture: Picture, pose: RawPose | None, now_ns: int) -> str:
    """What speaks against the estimate, with the remedy; empty where nothing does."""
    if pose is None or now_ns - pose.arrival_ns > POSE_AGE_NS:
        return "no pose from motion capture: check motion_capture.endpoint and rigid_body, and that the body is tracked"
    if picture.q_WB is None or _is_old(picture.q_ns, now_ns):
        return "it does not report its attitude"
    flags = autopilot.estimate_objection(picture.estimator_flags)
    if flags:
        return f"its estimator says {flags}: poses do not reach it or are not fused"
    if picture.p_WB is None or _is_old(picture.p_ns, now_ns):
        return "it has no position: poses do not reach it or are not fused"
    return _disagreement(picture.p_WB, picture.q_WB, pose)


def _disagreement(p_WB: Vector3, q_WB: Quaternion, pose: RawPose) -> str:
    """How far the estimate is from motion capture, where that is too far."""
    distance_m, angle_rad = math.dist(p_WB, pose.p_WB), angle_between(q_WB, pose.q_WB)
    if not distance_m <= MAX_DISTANCE_M:
        return f"its position is {distance_m:.2f} m from motion capture (limit {MAX_DISTANCE_M} m): keep it still"
    if not angle_rad <= MAX_ANGLE_RAD:
        return (
            f"its attitude is {math.degrees(angle_rad):.0f} deg from motion capture "
            f"(limit {math.degrees(MAX_ANGLE_RAD):.0f} deg): the rigid body's axes must be forward, left, up, and the "
            "option frame=enu or flu that of the room"
        )
    return ""


def _is_old(stamp_ns: int | None, now_ns: int) -> bool:
    return stamp_ns is None or now_ns - stamp_ns > POSE_AGE_NS
