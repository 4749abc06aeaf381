"""How a trajectory asks a multirotor to move, at one instant: thrust, tilt and body rates, forward and reverse.

By differential flatness (Mellinger and Kumar 2011) the thrust direction is b3 = F / |F| with the specific force
F = a + g e3, and jerk and snap give its rate and acceleration. Everything is expressed in the heading frame H: the
world turned about z by the yaw. Plain scalars without branches, so that numba can vectorise over instants.
"""

from __future__ import annotations

import math
from typing import TypeAlias

Motion: TypeAlias = tuple[float, float, float, float, float, float]
"""|F| in m/s^2; b3_z; rate of b3 along body x and y in rad/s; its acceleration along body x and y in rad/s^2."""

Reverse: TypeAlias = tuple[float, float, float, float, float, float, float, float, float]
"""Derivatives with respect to F_H, its first and its second time derivative."""

FORCE_FLOOR_SQUARED = 0.5**2
"""(m/s^2)^2, added below the root of |F|: in free fall the thrust direction is not defined."""

HEADING_FLOOR_SQUARED = 0.05**2
"""Added below the root of the body frame's norm: thrust along the heading leaves the body y axis undefined."""


def thrust_motion(
    Fx: float, Fy: float, Fz: float, Jx: float, Jy: float, Jz: float, Sx: float, Sy: float, Sz: float
) -> Motion:
    """Thrust, tilt and motion of the thrust direction from F, dF/dt = J and d2F/dt2 = S, in the heading frame.

    Body axes as the SE(3) law has them (paper, section II): b2 = b3 x heading, normalised, b1 = b2 x b3.
    """
    f = math.sqrt(Fx * Fx + Fy * Fy + Fz * Fz + FORCE_FLOOR_SQUARED)
    i = 1.0 / f
    m, n, b = Fx * i, Fy * i, Fz * i
    R = b * b + n * n
    h = 1.0 / math.sqrt(R + HEADING_FLOOR_SQUARED)
    mh, bh, nh = m * h, b * h, n * h
    d = m * Jx + n * Jy + b * Jz
    rate_x = (R * h * Jx - n * mh * Jy - b * mh * Jz) * i
    rate_y = (bh * Jy - nh * Jz) * i
    acceleration_x = (R * h * Sx - n * mh * Sy - b * mh * Sz - 2.0 * d * rate_x) * i
    acceleration_y = (bh * Sy - nh * Sz - 2.0 * d * rate_y) * i
    return f, b, rate_x, rate_y, acceleration_x, acceleration_y


def thrust_motion_reverse(
    Fx: float,
    Fy: float,
    Fz: float,
    Jx: float,
    Jy: float,
    Jz: float,
    Sx: float,
    Sy: float,
    Sz: float,
    g_f: float,
    g_b: float,
    g_rate_x: float,
    g_rate_y: float,
    g_acceleration_x: float,
    g_acceleration_y: float,
) -> Reverse:
    """Reverse mode of `thrust_motion`: `g_name` is the derivative of a scalar with respect to output `name`."""
    f = math.sqrt(Fx * Fx + Fy * Fy + Fz * Fz + FORCE_FLOOR_SQUARED)
    i = 1.0 / f
    m, n, b = Fx * i, Fy * i, Fz * i
    R = b * b + n * n
    h = 1.0 / math.sqrt(R + HEADING_FLOOR_SQUARED)
    # Body axes: e1 = (R h, -n m h, -b m h), e2 = (0, b h, -n h).
    e1x, e1y, e1z, e2y, e2z = R * h, -n * m * h, -b * m * h, b * h, -n * h
    d = m * Jx + n * Jy + b * Jz
    rate_x = (e1x * Jx + e1y * Jy + e1z * Jz) * i
    rate_y = (e2y * Jy + e2z * Jz) * i
    acceleration_x = (e1x * Sx + e1y * Sy + e1z * Sz - 2.0 * d * rate_x) * i
    acceleration_y = (e2y * Sy + e2z * Sz - 2.0 * d * rate_y) * i

    ax, ay = g_acceleration_x * i, g_acceleration_y * i
    rx, ry = (g_rate_x - 2.0 * d * ax) * i, (g_rate_y - 2.0 * d * ay) * i
    g_d = -2.0 * (ax * rate_x + ay * rate_y)
    g_i = f * (g_acceleration_x * acceleration_x + g_acceleration_y * acceleration_y)
    g_i += f * f * (rx * rate_x + ry * rate_y)
    g_Sx, g_Sy, g_Sz = e1x * ax, e1y * ax + e2y * ay, e1z * ax + e2z * ay
    g_Jx, g_Jy, g_Jz = e1x * rx + m * g_d, e1y * rx + e2y * ry + n * g_d, e1z * rx + e2z * ry + b * g_d
    g_e1x, g_e1y, g_e1z = Sx * ax + Jx * rx, Sy * ax + Jy * rx, Sz * ax + Jz * rx
    g_e2y, g_e2z = Sy * ay + Jy * ry, Sz * ay + Jz * ry

    g_h = R * g_e1x - m * (n * g_e1y + b * g_e1z) + b * g_e2y - n * g_e2z
    g_R = h * g_e1x - 0.5 * h * h * h * g_h
    g_m = Jx * g_d - h * (n * g_e1y + b * g_e1z)
    g_n = Jy * g_d - h * (m * g_e1y + g_e2z) + 2.0 * n * g_R
    g_z = Jz * g_d - h * (m * g_e1z - g_e2y) + 2.0 * b * g_R + g_b
    g_i += Fx * g_m + Fy * g_n + Fz * g_z
    along = i * g_f - i * i * i * g_i
    return (
        g_m * i + Fx * along,
        g_n * i + Fy * along,
        g_z * i + Fz * along,
        g_Jx,
        g_Jy,
        g_Jz,
        g_Sx,
        g_Sy,
        g_Sz,
    )


def compress(x: float, scale: float) -> float:
    """`x` where it is small against `scale`, growing like a square root where it is large: tames heavy tails."""
    u = x / scale
    return x / math.sqrt(math.sqrt(1.0 + u * u))


def compress_slope(x: float, scale: float) -> float:
    """Derivative of `compress` with respect to `x`."""
    u = x / scale
    root = math.sqrt(1.0 + u * u)
    return (1.0 + 0.5 * u * u) / (root * root * math.sqrt(root))


def soft_excess(x: float) -> float:
    """The positive part of `x`, rounded at zero over about `SOFTNESS`."""
    return 0.5 * (x + math.sqrt(x * x + SOFTNESS * SOFTNESS))


def soft_excess_slope(x: float) -> float:
    """Derivative of `soft_excess`."""
    return 0.5 + 0.5 * x / math.sqrt(x * x + SOFTNESS * SOFTNESS)


SOFTNESS = 0.1
