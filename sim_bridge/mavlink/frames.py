"""The autopilot's axes: world north, east, down (NED) and body forward, right, down (FRD); quaternions (w, x, y, z).

This is the vehicle's own code, written out by components. What clients use is written apart from it on purpose: an
error would have to be made twice to go unseen.
"""

from __future__ import annotations

import math

from lcd_flight.model import Quaternion, Vector3

Hamilton = tuple[float, float, float, float]
"""A rotation as MAVLink has it: (w, x, y, z), body FRD to a frame whose z is down."""

_HALF = math.sqrt(0.5)


def swapped(p: Vector3) -> Vector3:
    """A vector of east, north, up in north, east, down, and back again."""
    return (p[1], p[0], -p[2])


def forward_right_down(v: Vector3) -> Vector3:
    """A vector of forward, left, up in forward, right, down, and back again."""
    return (v[0], -v[1], -v[2])


def ned_attitude(q_WB: Quaternion) -> Hamilton:
    """The attitude of FRD in NED from that of FLU in ENU (xyzw)."""
    x, y, z, w = q_WB
    return (_HALF * (w + z), _HALF * (x + y), _HALF * (x - y), _HALF * (w - z))


def level(yaw_rad: float) -> Hamilton:
    """Upright, with this heading, clockwise from the frame's x."""
    return (math.cos(0.5 * yaw_rad), 0.0, 0.0, math.sin(0.5 * yaw_rad))


def product(a: Hamilton, b: Hamilton) -> Hamilton:
    """First `b`, then `a`."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def inverse(q: Hamilton) -> Hamilton:
    """The rotation back, of a unit quaternion."""
    return (q[0], -q[1], -q[2], -q[3])


def turn(q: Hamilton, v: Vector3) -> Vector3:
    """A body's vector in the frame that the attitude is given in."""
    _, x, y, z = product(product(q, (0.0, v[0], v[1], v[2])), inverse(q))
    return (x, y, z)


def unit(q: Hamilton) -> Hamilton:
    """Of length one; what has none is no turn."""
    size = math.hypot(*q)
    return (q[0] / size, q[1] / size, q[2] / size, q[3] / size) if size > 1e-12 else (1.0, 0.0, 0.0, 0.0)


def small_turn(rotation: Vector3) -> Hamilton:
    """A turn by a rotation vector of a few hundredths of a radian, not quite of length one."""
    return (1.0, 0.5 * rotation[0], 0.5 * rotation[1], 0.5 * rotation[2])


def heading(q: Hamilton) -> float:
    """Yaw in rad, clockwise from the frame's x, in (-pi, pi]."""
    w, x, y, z = q
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def angles(q: Hamilton) -> Vector3:
    """Roll, pitch and yaw in rad."""
    w, x, y, z = q
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
    return (roll, pitch, heading(q))


def wrapped(angle_rad: float) -> float:
    """The same angle in [-pi, pi)."""
    return (angle_rad + math.pi) % math.tau - math.pi
