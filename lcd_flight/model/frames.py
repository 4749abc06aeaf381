"""Rotations on plain floats: quaternions are (x, y, z, w) and rotate body vectors into the world.

World W: z up, right-handed. Body B: x forward, y left, z up.
"""

from __future__ import annotations

import math

from lcd_flight.model.types import Quaternion, Vector3

IDENTITY: Quaternion = (0.0, 0.0, 0.0, 1.0)


def normalized(q: Quaternion) -> Quaternion:
    """Return `q` scaled to unit length.

    Raises:
        ValueError: the quaternion is zero or not finite.
    """
    length = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    if not (math.isfinite(length) and length > 1e-9):
        raise ValueError(f"not a rotation: {q}")
    return (q[0] / length, q[1] / length, q[2] / length, q[3] / length)


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Hamilton product: the rotation `b` followed by `a` (q_AC = q_AB * q_BC)."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def conjugate(q: Quaternion) -> Quaternion:
    """The inverse rotation of a unit quaternion."""
    return (-q[0], -q[1], -q[2], q[3])


def rotate(q_AB: Quaternion, v_B: Vector3) -> Vector3:
    """Express in A a vector that is given in B."""
    x, y, z, w = q_AB
    vx, vy, vz = v_B
    tx = 2.0 * (y * vz - z * vy)
    ty = 2.0 * (z * vx - x * vz)
    tz = 2.0 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


def body_z_axis(q_WB: Quaternion) -> Vector3:
    """The direction of collective thrust, R_WB e3, in the world."""
    x, y, z, w = q_WB
    return (2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y))


def yaw_of(q_WB: Quaternion) -> float:
    """Heading in rad, counter-clockwise from +x, in (-pi, pi]."""
    x, y, z, w = q_WB
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def body_x_axis(q_WB: Quaternion) -> Vector3:
    """Where the nose points, R_WB e1, in the world."""
    x, y, z, w = q_WB
    return (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y))


def seen_from_heading(axis_W: Vector3, nose_W: Vector3) -> tuple[float, float]:
    """Forward and left component of a vector, for a vehicle whose nose points along `nose_W`; tilt does not matter.

    Firmware that corrects roll, pitch and yaw apart is told roll and pitch of the desired thrust axis as seen from the
    heading that the vehicle has: those of the desired attitude itself would point the thrust astray by as much as the
    heading lags behind.
    """
    ahead_x, ahead_y = nose_W[0], nose_W[1]
    size = math.sqrt(ahead_x * ahead_x + ahead_y * ahead_y)
    scale = 1.0 / size if size > 0.0 else 0.0
    x, y = axis_W[0], axis_W[1]
    return scale * (ahead_x * x + ahead_y * y), scale * (ahead_x * y - ahead_y * x)


def tilt_of(q_WB: Quaternion) -> float:
    """Angle between the body z axis and the vertical, in rad, in [0, pi]."""
    return math.acos(max(-1.0, min(1.0, body_z_axis(q_WB)[2])))


def from_yaw(yaw_rad: float) -> Quaternion:
    """A level attitude with the given heading."""
    return (0.0, 0.0, math.sin(0.5 * yaw_rad), math.cos(0.5 * yaw_rad))


def angle_between(a: Quaternion, b: Quaternion) -> float:
    """The angle in rad, in [0, pi], of the rotation that takes one attitude to the other."""
    dot = abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3])
    return 2.0 * math.acos(min(1.0, dot))


def wrapped(angle_rad: float) -> float:
    """The same angle in [-pi, pi)."""
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi
