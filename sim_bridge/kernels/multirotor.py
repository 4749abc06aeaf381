"""The multirotor's equations of motion: RotorPy's model (Folk, Paulos, Kumar 2023, section II), four rotors in a plane.

Scalars and tuples, `math` only. The wrench of all rotors is written with their summed moments (sum of O_i, O_i x_i,
O_i x_i y_i ...), which is the sum over rotors rearranged: with u_i = v_a + w x r_i and v_a the airspeed,

    T_i = k_eta O_i^2 + k_h (u_ix^2 + u_iy^2),  H_i = -O_i diag(k_d, k_d, k_z) u_i,  D = -|v_a| diag(c_D) v_a
    F = sum(T_i e3 + H_i) + D,  M = sum(r_i x (T_i e3 + H_i) + dir_i k_m O_i^2 e3 - k_flap O_i (u_i x e3))
    dv/dt = -g e3 + R F / m,  dw/dt = J^-1 (M - w x J w),  dq/dt = q x (w, 0) / 2,  dO/dt = (command - O) / tau
"""

from __future__ import annotations

import math
from typing import NamedTuple

from lcd_flight.control.geometric import Row4
from lcd_flight.model import GRAVITY_M_PER_S2, Quaternion, Vector3, Vehicle


class Airframe(NamedTuple):
    """A vehicle's constants, as the equations want them."""

    mass_kg: float
    inertia_kg_m2: Vector3
    x_m: Row4
    """Of the rotors."""
    y_m: Row4
    directions: Row4
    k_eta: float
    k_m: float
    k_d: float
    k_z: float
    k_h: float
    k_flap: float
    parasitic_drag: Vector3
    first_moments_m: tuple[float, float]
    """Sums of x and y over the rotors."""
    second_moments_m2: Vector3
    """Sums of x x, x y and y y."""
    third_moments_m3: tuple[float, float]
    """Sums of x (x x + y y) and y (x x + y y)."""
    speed_min: float
    speed_max: float


class RotorSums(NamedTuple):
    """What four rotor speeds O add up to; forces and moments are static, without airspeed."""

    thrust_N: float
    moment_N_m: Vector3
    total: float
    """Sum of O."""
    x: float
    """Sum of O x; the others likewise."""
    y: float
    xx: float
    xy: float
    yy: float


class Motion(NamedTuple):
    """The rigid body's state: m, m/s in the world, unit quaternion xyzw, rad/s in the body."""

    p_WB: Vector3
    v_WB_W: Vector3
    q_WB: Quaternion
    w_WB_B: Vector3


class Rates(NamedTuple):
    """Time derivatives of velocity, attitude and body rates."""

    v: Vector3
    q: Quaternion
    w: Vector3


def airframe(vehicle: Vehicle) -> Airframe:
    """The constants of a vehicle whose rotors lie in the plane through its centre of mass.

    Raises:
        ValueError: they do not.
    """
    if any(r[2] != 0.0 for r in vehicle.rotor_positions_m):
        raise ValueError(f"vehicle {vehicle.name}: rotors must lie in the plane of the centre of mass (z = 0)")
    x1, x2, x3, x4 = (r[0] for r in vehicle.rotor_positions_m)
    y1, y2, y3, y4 = (r[1] for r in vehicle.rotor_positions_m)
    points = ((x1, y1), (x2, y2), (x3, y3), (x4, y4))
    return Airframe(
        mass_kg=vehicle.mass_kg,
        inertia_kg_m2=vehicle.inertia_kg_m2,
        x_m=(x1, x2, x3, x4),
        y_m=(y1, y2, y3, y4),
        directions=vehicle.rotor_directions,
        k_eta=vehicle.k_eta,
        k_m=vehicle.k_m,
        k_d=vehicle.k_d,
        k_z=vehicle.k_z,
        k_h=vehicle.k_h,
        k_flap=vehicle.k_flap,
        parasitic_drag=vehicle.parasitic_drag,
        first_moments_m=(math.fsum(x for x, _ in points), math.fsum(y for _, y in points)),
        second_moments_m2=(
            math.fsum(x * x for x, _ in points),
            math.fsum(x * y for x, y in points),
            math.fsum(y * y for _, y in points),
        ),
        third_moments_m3=(
            math.fsum(x * (x * x + y * y) for x, y in points),
            math.fsum(y * (x * x + y * y) for x, y in points),
        ),
        speed_min=vehicle.rotor_speed_min,
        speed_max=vehicle.rotor_speed_max,
    )


def weighted(weights: Row4, values: Row4) -> float:
    """Sum of the products."""
    return weights[0] * values[0] + weights[1] * values[1] + weights[2] * values[2] + weights[3] * values[3]


def product(a: Row4, b: Row4) -> Row4:
    """One by one."""
    return (a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3])


def rotor_sums(speeds: Row4, air: Airframe) -> RotorSums:
    """Sums over the rotors at `speeds` in rad/s."""
    square = product(speeds, speeds)
    along_x, along_y = product(speeds, air.x_m), product(speeds, air.y_m)
    return RotorSums(
        thrust_N=air.k_eta * (square[0] + square[1] + square[2] + square[3]),
        moment_N_m=(
            air.k_eta * weighted(square, air.y_m),
            -air.k_eta * weighted(square, air.x_m),
            air.k_m * weighted(square, air.directions),
        ),
        total=speeds[0] + speeds[1] + speeds[2] + speeds[3],
        x=along_x[0] + along_x[1] + along_x[2] + along_x[3],
        y=along_y[0] + along_y[1] + along_y[2] + along_y[3],
        xx=weighted(along_x, air.x_m),
        xy=weighted(along_x, air.y_m),
        yy=weighted(along_y, air.y_m),
    )


def wrench(airspeed_B: Vector3, w_WB_B: Vector3, rotors: RotorSums, air: Airframe) -> tuple[Vector3, Vector3]:
    """Force in N and moment in N m on the body, in the body frame, gravity left out."""
    vx, vy, vz = airspeed_B
    wx, wy, wz = w_WB_B
    speed = math.sqrt(vx * vx + vy * vy + vz * vz)
    inflow_x = rotors.total * vx - wz * rotors.y
    inflow_y = rotors.total * vy + wz * rotors.x
    inflow_z = rotors.total * vz + wx * rotors.y - wy * rotors.x
    lift, lift_x, lift_y = _translational_lift(vx, vy, wz, air)
    force = (
        -air.k_d * inflow_x - speed * air.parasitic_drag[0] * vx,
        -air.k_d * inflow_y - speed * air.parasitic_drag[1] * vy,
        rotors.thrust_N + lift - air.k_z * inflow_z - speed * air.parasitic_drag[2] * vz,
    )
    moment = (
        rotors.moment_N_m[0]
        + lift_y
        - air.k_z * (rotors.y * vz + rotors.yy * wx - rotors.xy * wy)
        - air.k_flap * inflow_y,
        rotors.moment_N_m[1]
        - lift_x
        + air.k_z * (rotors.x * vz + rotors.xy * wx - rotors.xx * wy)
        + air.k_flap * inflow_x,
        rotors.moment_N_m[2] - air.k_d * (rotors.x * vy - rotors.y * vx + (rotors.xx + rotors.yy) * wz),
    )
    return force, moment


def _translational_lift(vx: float, vy: float, wz: float, air: Airframe) -> Vector3:
    """Sums of k_h (u_ix^2 + u_iy^2) over the rotors, times 1, x_i and y_i."""
    x, y = air.first_moments_m
    xx, xy, yy = air.second_moments_m2
    along = vx * vx + vy * vy
    turn = wz * wz
    lift = 4.0 * along + 2.0 * wz * (vy * x - vx * y) + turn * (xx + yy)
    lift_x = along * x + 2.0 * wz * (vy * xx - vx * xy) + turn * air.third_moments_m3[0]
    lift_y = along * y + 2.0 * wz * (vy * xy - vx * yy) + turn * air.third_moments_m3[1]
    return (air.k_h * lift, air.k_h * lift_x, air.k_h * lift_y)


def rates(v: Vector3, q: Quaternion, w: Vector3, rotors: RotorSums, air: Airframe) -> Rates:
    """The equations of motion in still air."""
    qx, qy, qz, qw = q
    xx, yy, zz = 1.0 - 2.0 * (qy * qy + qz * qz), 1.0 - 2.0 * (qx * qx + qz * qz), 1.0 - 2.0 * (qx * qx + qy * qy)
    xy, yx = 2.0 * (qx * qy - qw * qz), 2.0 * (qx * qy + qw * qz)
    xz, zx = 2.0 * (qx * qz + qw * qy), 2.0 * (qx * qz - qw * qy)
    yz, zy = 2.0 * (qy * qz - qw * qx), 2.0 * (qy * qz + qw * qx)
    airspeed_B = (
        xx * v[0] + yx * v[1] + zx * v[2],
        xy * v[0] + yy * v[1] + zy * v[2],
        xz * v[0] + yz * v[1] + zz * v[2],
    )
    force, moment = wrench(airspeed_B, w, rotors, air)
    fx, fy, fz = force[0] / air.mass_kg, force[1] / air.mass_kg, force[2] / air.mass_kg
    jx, jy, jz = air.inertia_kg_m2
    return Rates(
        v=(
            xx * fx + xy * fy + xz * fz,
            yx * fx + yy * fy + yz * fz,
            zx * fx + zy * fy + zz * fz - GRAVITY_M_PER_S2,
        ),
        q=(
            0.5 * (qw * w[0] + qy * w[2] - qz * w[1]),
            0.5 * (qw * w[1] + qz * w[0] - qx * w[2]),
            0.5 * (qw * w[2] + qx * w[1] - qy * w[0]),
            -0.5 * (qx * w[0] + qy * w[1] + qz * w[2]),
        ),
        w=(
            (moment[0] + (jy - jz) * w[1] * w[2]) / jx,
            (moment[1] + (jz - jx) * w[2] * w[0]) / jy,
            (moment[2] + (jx - jy) * w[0] * w[1]) / jz,
        ),
    )


def lagged(speeds: Row4, commands: Row4, decay: float) -> Row4:
    """Rotor speeds after a time t in which decay = exp(-t / tau): the exact solution for a constant command."""
    return (
        commands[0] + decay * (speeds[0] - commands[0]),
        commands[1] + decay * (speeds[1] - commands[1]),
        commands[2] + decay * (speeds[2] - commands[2]),
        commands[3] + decay * (speeds[3] - commands[3]),
    )


def moved(v: Vector3, rate: Vector3, h: float) -> Vector3:
    """v + h rate."""
    return (v[0] + h * rate[0], v[1] + h * rate[1], v[2] + h * rate[2])


def turned(q: Quaternion, rate: Quaternion, h: float) -> Quaternion:
    """q + h rate."""
    return (q[0] + h * rate[0], q[1] + h * rate[1], q[2] + h * rate[2], q[3] + h * rate[3])


def step(
    motion: Motion, at_start: RotorSums, at_middle: RotorSums, at_end: RotorSums, air: Airframe, h: float
) -> Motion:
    """One Runge-Kutta step of order 4 over h seconds, with the rotors' sums at its start, middle and end.

    The attitude is not normalised. Positions follow from the stages' velocities: dp/dt = v.
    """
    p, v, q, w = motion
    a = rates(v, q, w, at_start, air)
    b = rates(moved(v, a.v, 0.5 * h), turned(q, a.q, 0.5 * h), moved(w, a.w, 0.5 * h), at_middle, air)
    c = rates(moved(v, b.v, 0.5 * h), turned(q, b.q, 0.5 * h), moved(w, b.w, 0.5 * h), at_middle, air)
    d = rates(moved(v, c.v, h), turned(q, c.q, h), moved(w, c.w, h), at_end, air)
    sixth = h / 6.0
    mean = (a.v[0] + b.v[0] + c.v[0], a.v[1] + b.v[1] + c.v[1], a.v[2] + b.v[2] + c.v[2])
    return Motion(
        moved(moved(p, v, h), mean, h * sixth),
        moved(moved(v, a.v, sixth), moved(moved(d.v, b.v, 2.0), c.v, 2.0), sixth),
        turned(turned(q, a.q, sixth), turned(turned(d.q, b.q, 2.0), c.q, 2.0), sixth),
        moved(moved(w, a.w, sixth), moved(moved(d.w, b.w, 2.0), c.w, 2.0), sixth),
    )


def normalized(q: Quaternion) -> Quaternion:
    """`q` scaled to unit length."""
    scale = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (scale * q[0], scale * q[1], scale * q[2], scale * q[3])
