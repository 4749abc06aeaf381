"""The geometric law on SE(3) (paper, equation 2; Lee et al. 2010), in the form that RotorPy's SE3Control gives it.

Scalars and tuples in, scalars and tuples out, `math` only and no branches: the tick calls these functions as they
stand, and `sim_bridge` compiles the very same ones into its kernels, where they run on many vehicles at a time.

Rotations are three columns (b1, b2, b3): the body axes in the world. Where RotorPy divides by zero (no force asked
for, thrust along the heading), a stated direction is taken instead; NaN in gives NaN out.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from lcd_flight.model.types import GRAVITY_M_PER_S2, Quaternion, Vector3

Rotation = tuple[Vector3, Vector3, Vector3]
"""Columns b1, b2, b3 of a rotation matrix."""

Row4 = tuple[float, float, float, float]

NEGLIGIBLE_FORCE_N = 1e-9
"""Below it a force has no direction: the vehicle is asked to be level."""
NEGLIGIBLE_SINE = 1e-9
"""Sine of the angle between thrust and heading below which the heading does not fix the attitude."""


class Allocation(NamedTuple):
    """From collective thrust and moment to rotor speeds."""

    inverse: tuple[Row4, Row4, Row4, Row4]
    """Rotor forces in N from (thrust in N, moments in N m about x, y, z)."""
    k_eta: float
    """N/(rad/s)^2"""


def dot(a: Vector3, b: Vector3) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector3, b: Vector3) -> Vector3:
    """Vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def scaled(a: Vector3, factor: float) -> Vector3:
    """`a` times a number."""
    return (factor * a[0], factor * a[1], factor * a[2])


def rotation_of(q_WB: Quaternion) -> Rotation:
    """The columns of R_WB of a unit quaternion."""
    x, y, z, w = q_WB
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
        (2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
        (2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)),
    )


def acceleration_setpoint(
    p_WB: Vector3,
    v_WB_W: Vector3,
    p_ref_W: Vector3,
    v_ref_W: Vector3,
    a_ref_W: Vector3,
    position_gain: Vector3,
    velocity_gain: Vector3,
) -> Vector3:
    """Acceleration in m/s^2, world, that thrust must give: -Kx e_x - Kv e_v + a_d + g e3 (per unit of mass)."""
    return (
        a_ref_W[0] - position_gain[0] * (p_WB[0] - p_ref_W[0]) - velocity_gain[0] * (v_WB_W[0] - v_ref_W[0]),
        a_ref_W[1] - position_gain[1] * (p_WB[1] - p_ref_W[1]) - velocity_gain[1] * (v_WB_W[1] - v_ref_W[1]),
        a_ref_W[2]
        - position_gain[2] * (p_WB[2] - p_ref_W[2])
        - velocity_gain[2] * (v_WB_W[2] - v_ref_W[2])
        + GRAVITY_M_PER_S2,
    )


def attitude_setpoint(force_W: Vector3, heading: tuple[float, float]) -> Rotation:
    """The attitude R_WD whose b3 lies along the force and whose b1 lies nearest to the heading.

    force_W: N, world. heading: (cos, sin) of the yaw. Without a force b3 is up; with the force along the heading b2 is
    the heading turned by 90 degrees, the limit that a level vehicle has.
    """
    size = math.sqrt(dot(force_W, force_W))
    no_force = size < NEGLIGIBLE_FORCE_N
    b3 = scaled(force_W, 0.0 if no_force else 1.0 / size)
    b3 = (b3[0], b3[1], 1.0 if no_force else b3[2])
    side = cross(b3, (heading[0], heading[1], 0.0))
    sine = math.sqrt(dot(side, side))
    aligned = sine < NEGLIGIBLE_SINE
    side = scaled(side, 0.0 if aligned else 1.0 / sine)
    b2 = (-heading[1] if aligned else side[0], heading[0] if aligned else side[1], 0.0 if aligned else side[2])
    return (cross(b2, b3), b2, b3)


def attitude_error(R_WB: Rotation, R_WD: Rotation) -> Vector3:
    """e_R = 1/2 vee(R_d' R - R' R_d): the sine of the error angle about its axis, in the body.

    It is zero at an error of 180 degrees too (a property of the law, an unstable equilibrium).
    """
    return (
        0.5 * (dot(R_WB[1], R_WD[2]) - dot(R_WD[1], R_WB[2])),
        0.5 * (dot(R_WD[0], R_WB[2]) - dot(R_WB[0], R_WD[2])),
        0.5 * (dot(R_WB[0], R_WD[1]) - dot(R_WD[0], R_WB[1])),
    )


def moment(
    R_WB: Rotation,
    R_WD: Rotation,
    w_WB_B: Vector3,
    yaw_rate: float,
    inertia_kg_m2: Vector3,
    attitude_gain: float,
    rate_gain: float,
) -> Vector3:
    """M = J(-k_R e_R - k_w e_w) + w x J w in N m, body, with the desired rates taken as (0, 0, yaw_rate).

    This is RotorPy's form: gains are per unit of inertia, and the paper's last term is `moment_feed_forward`.
    """
    e_R = attitude_error(R_WB, R_WD)
    jx, jy, jz = inertia_kg_m2
    wx, wy, wz = w_WB_B
    return (
        jx * (-attitude_gain * e_R[0] - rate_gain * wx) + wy * wz * (jz - jy),
        jy * (-attitude_gain * e_R[1] - rate_gain * wy) + wz * wx * (jx - jz),
        jz * (-attitude_gain * e_R[2] - rate_gain * (wz - yaw_rate)) + wx * wy * (jy - jx),
    )


def moment_feed_forward(
    R_WB: Rotation,
    R_WD: Rotation,
    w_WB_B: Vector3,
    w_WD_D: Vector3,
    dw_WD_D: Vector3,
    inertia_kg_m2: Vector3,
) -> Vector3:
    """The paper's last term, -J (w^ R' R_d w_d - R' R_d dw_d / dt) in N m, body; RotorPy's form drops it.

    w_WD_D, dw_WD_D: desired body rates in rad/s and their derivative in rad/s^2, in the desired frame.
    """
    rates = into_body(R_WB, into_world(R_WD, w_WD_D))
    accelerations = into_body(R_WB, into_world(R_WD, dw_WD_D))
    carried = cross(w_WB_B, rates)
    return (
        inertia_kg_m2[0] * (accelerations[0] - carried[0]),
        inertia_kg_m2[1] * (accelerations[1] - carried[1]),
        inertia_kg_m2[2] * (accelerations[2] - carried[2]),
    )


def into_world(R_WB: Rotation, v_B: Vector3) -> Vector3:
    """R v."""
    return (
        R_WB[0][0] * v_B[0] + R_WB[1][0] * v_B[1] + R_WB[2][0] * v_B[2],
        R_WB[0][1] * v_B[0] + R_WB[1][1] * v_B[1] + R_WB[2][1] * v_B[2],
        R_WB[0][2] * v_B[0] + R_WB[1][2] * v_B[1] + R_WB[2][2] * v_B[2],
    )


def into_body(R_WB: Rotation, v_W: Vector3) -> Vector3:
    """R' v."""
    return (dot(R_WB[0], v_W), dot(R_WB[1], v_W), dot(R_WB[2], v_W))


def rotor_speeds(thrust_N: float, moment_N_m: Vector3, allocation: Allocation) -> Row4:
    """Rotor speeds in rad/s before any limit; where a force would have to be negative, so is the speed."""
    a, b, c, d = allocation.inverse
    return (
        _rotor_speed(a, thrust_N, moment_N_m, allocation.k_eta),
        _rotor_speed(b, thrust_N, moment_N_m, allocation.k_eta),
        _rotor_speed(c, thrust_N, moment_N_m, allocation.k_eta),
        _rotor_speed(d, thrust_N, moment_N_m, allocation.k_eta),
    )


def rotor_force(row: Row4, thrust_N: float, moment_N_m: Vector3) -> float:
    """One rotor's share in N; row: its row of `Allocation.inverse`."""
    return row[0] * thrust_N + row[1] * moment_N_m[0] + row[2] * moment_N_m[1] + row[3] * moment_N_m[2]


def _rotor_speed(row: Row4, thrust_N: float, moment_N_m: Vector3, k_eta: float) -> float:
    """sign(f) sqrt(|f| / k_eta) of one rotor's force f."""
    force = rotor_force(row, thrust_N, moment_N_m)
    speed = math.sqrt(abs(force) / k_eta)
    return speed if force >= 0.0 else -speed


def clipped(value: float, low: float, high: float) -> float:
    """`value` within [low, high]; NaN stays NaN."""
    above = low if value < low else value
    return high if above > high else above
