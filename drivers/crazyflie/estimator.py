"""Whether the onboard estimate can be flown with: reset while poses stream, then judged against motion capture.

cflib's own helper waits until variances stop changing: without poses that can be for ever, or at 87 m below the floor.
Here the variance has an absolute bound, and the estimate must be where motion capture sees the vehicle.
"""

from __future__ import annotations

import math

from drivers.crazyflie.picture import Picture
from lcd_flight.model import RawPose
from lcd_flight.model.frames import angle_between

RESET = "kalman.resetEstimation"
RESET_S = 0.1
SETTLED_NS = 500_000_000
"""It must be right for so long."""
LIMIT_NS = 10_000_000_000
MAX_VARIANCE_M2 = 1e-3
MAX_DISTANCE_M = 0.05
MAX_ANGLE_RAD = math.radians(5.0)
POSE_AGE_NS = 200_000_000
"""An older pose is none."""


def objection(picture: Picture, pose: RawPose | None, now_ns: int) -> str:
    """What speaks against the estimate, with the remedy; empty where nothing does."""
    if pose is None or now_ns - pose.arrival_ns > POSE_AGE_NS:
        return "no pose from motion capture: check motion_capture.endpoint and rigid_body, and that the body is tracked"
    if picture.p_WB is None or picture.q_WB is None or picture.variance_m2 is None:
        return "the vehicle does not report its estimate"
    if not picture.variance_m2 <= MAX_VARIANCE_M2:
        return (
            f"its position variance is {picture.variance_m2:.2g} m^2 (limit {MAX_VARIANCE_M2:g}): poses do not reach it"
        )
    distance_m = math.dist(picture.p_WB, pose.p_WB)
    if not distance_m <= MAX_DISTANCE_M:
        return f"its position is {distance_m:.2f} m from motion capture (limit {MAX_DISTANCE_M} m): keep it still"
    angle_rad = angle_between(picture.q_WB, pose.q_WB)
    if not angle_rad <= MAX_ANGLE_RAD:
        return (
            f"its attitude is {math.degrees(angle_rad):.0f} deg from motion capture "
            f"(limit {math.degrees(MAX_ANGLE_RAD):.0f} deg): the rigid body's axes must be forward, left, up"
        )
    return ""
