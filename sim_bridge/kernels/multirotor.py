"""The multirotor's equations of motion: RotorPy's model (Folk, Paulos, Kumar 2023, section II), four rotors in a plane.

Scalars and tuples, `math` only. With u_i = v_a + w x r_i and v_a the airspeed,

    T_i = k_eta O_i^2 + k_h (u_ix^2 + u_iy^2),  H_i = -O_i diag(k_d, k_d, k_z) u_i,  D = -|v_a| diag(c_D) v_a
    F = sum(T_i e3 + H_i) + D,  M = sum(r_i x (T_i e3 + H_i) + dir_i k_m O_i^2 e3 - k_flap O_i (u_i x e3))
    dv/dt = -g e3 + R F / m,  dw/dt = J^-1 (M - w x J w),  dq/dt = q x (w, 0) / 2,  dO/dt = (command - O) / tau

Two rearrangements save half of the work: the wrench is written with the rotors' summed moments (sum of O_i, O_i x_i,
O_i x_i y_i ...), and every coefficient is divided by mass or inertia beforehand.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from lcd_flight.control.geometric import Row4
from lcd_flight.model import GRAVITY_M_PER_S2, Quaternion, Vector3, Vehicle


class Lift(NamedTuple):
    """What only some vehicles have: translational lift and blade flapping. Divided by mass (m) and inertia (x, y)."""

    up: Row4
    """Acceleration in m/s^2 for |v|^2 in the disc plane, w_z v_y, -w_z v_x and w_z^2; roll and pitch in rad/s^2."""
    roll: Row4
    pitch: Row4
    k_flap_x: float
    k_flap_y: float


class Airframe(NamedTuple):
    """A vehicle's constants, as the equations want them: divided by mass (m) and principal inertia (x, y, z)."""

    x_m: Row4
    """Of the rotors."""
    y_m: Row4
    thrust: float
    """k_eta / m"""
    roll: Row4
    """Angular acceleration about x for the square of each rotor's speed; pitch and yaw likewise."""
    pitch: Row4
    yaw: Row4
    k_d_m: float
    k_d_z: float
    k_z_m: float
    k_z_x: float
    k_z_y: float
    parasitic_drag: Vector3
    """c_D / m"""
    coupling: Vector3
    """(J_y - J_z) / J_x and so on round."""
    lifts: bool
    """Whether `lift` holds anything."""
    lift: Lift
    speed_min: float
    speed_max: float


class LinearSums(NamedTuple):
    """Sums of O_i, O_i x_i, O_i y_i, O_i x_i^2, O_i x_i y_i and O_i y_i^2; they lag as the rotors do."""

    total: float
    x: float
    y: float
    xx: float
    xy: float
    yy: float


class RotorSums(NamedTuple):
    """What four rotor speeds O add up to; accelerations are static ones, without airspeed."""

    thrust: float
    """m/s^2 along body z."""
    turn: Vector3
    """rad/s^2, body."""
    linear: LinearSums


class Motion(NamedTuple):
    """The rigid body's state: m, m/s in the world, unit quaternion xyzw, rad/s in the body."""

    p_WB: Vector3
    v_WB_W: Vector3
    q_WB: Quaternion
    w_WB_B: Vector3


class Stage(NamedTuple):
    """What the equations depend on: all of the motion but the position."""

    v_WB_W: Vector3
    q_WB: Quaternion
    w_WB_B: Vector3


class Slope(NamedTuple):
    """Time derivatives of velocity and body rates, and twice that of the attitude."""

    v: Vector3
    q_twice: Quaternion
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
    m, (jx, jy, jz), k_eta = vehicle.mass_kg, vehicle.inertia_kg_m2, vehicle.k_eta
    a, b, c = vehicle.parasitic_drag
    return Airframe(
        x_m=(x1, x2, x3, x4),
        y_m=(y1, y2, y3, y4),
        thrust=k_eta / m,
        roll=scaled4((y1, y2, y3, y4), k_eta / jx),
        pitch=scaled4((x1, x2, x3, x4), -k_eta / jy),
        yaw=scaled4(vehicle.rotor_directions, vehicle.k_m / jz),
        k_d_m=vehicle.k_d / m,
        k_d_z=vehicle.k_d / jz,
        k_z_m=vehicle.k_z / m,
        k_z_x=vehicle.k_z / jx,
        k_z_y=vehicle.k_z / jy,
        parasitic_drag=(a / m, b / m, c / m),
        coupling=((jy - jz) / jx, (jz - jx) / jy, (jx - jy) / jz),
        lifts=vehicle.k_h != 0.0 or vehicle.k_flap != 0.0,
        lift=_lift_of(vehicle),
        speed_min=vehicle.rotor_speed_min,
        speed_max=vehicle.rotor_speed_max,
    )


def _lift_of(vehicle: Vehicle) -> Lift:
    """Translational lift and blade flapping of a vehicle."""
    jx, jy, _ = vehicle.inertia_kg_m2
    points = [(x, y) for x, y, _ in vehicle.rotor_positions_m]

    def sums(weights: list[float], factor: float) -> Row4:
        rows = [(s, 2.0 * s * x, 2.0 * s * y, s * (x * x + y * y)) for s, (x, y) in zip(weights, points, strict=True)]
        a, b, c, d = (factor * math.fsum(column) for column in zip(*rows, strict=True))
        return (a, b, c, d)

    return Lift(
        up=sums([1.0] * 4, vehicle.k_h / vehicle.mass_kg),
        roll=sums([y for _, y in points], vehicle.k_h / jx),
        pitch=sums([-x for x, _ in points], vehicle.k_h / jy),
        k_flap_x=vehicle.k_flap / jx,
        k_flap_y=vehicle.k_flap / jy,
    )


def scaled4(a: Row4, factor: float) -> Row4:
    """`a` times a number."""
    return (factor * a[0], factor * a[1], factor * a[2], factor * a[3])


def weighted(weights: Row4, values: Row4) -> float:
    """Sum of the products."""
    return weights[0] * values[0] + weights[1] * values[1] + weights[2] * values[2] + weights[3] * values[3]


def product(a: Row4, b: Row4) -> Row4:
    """One by one."""
    return (a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3])


def linear_sums(speeds: Row4, air: Airframe) -> LinearSums:
    """Sums that are linear in the rotor speeds, in rad/s."""
    x, y = product(speeds, air.x_m), product(speeds, air.y_m)
    return LinearSums(
        total=speeds[0] + speeds[1] + speeds[2] + speeds[3],
        x=x[0] + x[1] + x[2] + x[3],
        y=y[0] + y[1] + y[2] + y[3],
        xx=weighted(x, air.x_m),
        xy=weighted(x, air.y_m),
        yy=weighted(y, air.y_m),
    )


def lagged_sums(now: LinearSums, goal: LinearSums, decay: float) -> LinearSums:
    """The sums after a time in which decay = exp(-t / tau)."""
    return LinearSums(
        goal.total + decay * (now.total - goal.total),
        goal.x + decay * (now.x - goal.x),
        goal.y + decay * (now.y - goal.y),
        goal.xx + decay * (now.xx - goal.xx),
        goal.xy + decay * (now.xy - goal.xy),
        goal.yy + decay * (now.yy - goal.yy),
    )


def rotor_sums(speeds: Row4, linear: LinearSums, air: Airframe) -> RotorSums:
    """All sums over the rotors at `speeds` in rad/s, whose linear ones are known."""
    square = product(speeds, speeds)
    return RotorSums(
        air.thrust * (square[0] + square[1] + square[2] + square[3]),
        (weighted(air.roll, square), weighted(air.pitch, square), weighted(air.yaw, square)),
        linear,
    )


def accelerations(
    airspeed_B: Vector3, w_WB_B: Vector3, rotors: RotorSums, air: Airframe, lifts: bool
) -> tuple[Vector3, Vector3]:
    """Specific force in m/s^2 without gravity, and angular acceleration in rad/s^2, both in the body frame.

    lifts: whether the vehicle has translational lift or blade flapping; where it has not, they cost nothing.
    """
    vx, vy, vz = airspeed_B
    wx, wy, wz = w_WB_B
    s = rotors.linear
    speed = math.sqrt(vx * vx + vy * vy + vz * vz)
    flow_x = s.total * vx - wz * s.y
    flow_y = s.total * vy + wz * s.x
    flow_z = s.total * vz + wx * s.y - wy * s.x
    force = (
        -air.k_d_m * flow_x - speed * air.parasitic_drag[0] * vx,
        -air.k_d_m * flow_y - speed * air.parasitic_drag[1] * vy,
        rotors.thrust - air.k_z_m * flow_z - speed * air.parasitic_drag[2] * vz,
    )
    turn = (
        rotors.turn[0] + air.coupling[0] * (wy * wz) - air.k_z_x * (s.y * vz + s.yy * wx - s.xy * wy),
        rotors.turn[1] + air.coupling[1] * (wz * wx) + air.k_z_y * (s.x * vz + s.xy * wx - s.xx * wy),
        rotors.turn[2] + air.coupling[2] * (wx * wy) - air.k_d_z * (s.x * vy - s.y * vx + (s.xx + s.yy) * wz),
    )
    if lifts:
        up, roll, pitch = _lift(vx, vy, wz, air.lift)
        flap_x, flap_y = air.lift.k_flap_x * flow_y, air.lift.k_flap_y * flow_x
        return (force[0], force[1], force[2] + up), (turn[0] + roll - flap_x, turn[1] + pitch + flap_y, turn[2])
    return force, turn


def _lift(vx: float, vy: float, wz: float, lift: Lift) -> Vector3:
    """Sums of k_h (u_ix^2 + u_iy^2) over the rotors as acceleration, and with y_i and x_i as angular acceleration."""
    along, turn = vx * vx + vy * vy, wz * wz
    a, b = wz * vy, wz * vx
    up, roll, pitch = lift.up, lift.roll, lift.pitch
    return (
        up[0] * along + up[1] * a - up[2] * b + up[3] * turn,
        roll[0] * along + roll[1] * a - roll[2] * b + roll[3] * turn,
        pitch[0] * along + pitch[1] * a - pitch[2] * b + pitch[3] * turn,
    )


def slope_of(stage: Stage, rotors: RotorSums, air: Airframe, lifts: bool) -> Slope:
    """The equations of motion in still air. lifts: as in `accelerations`."""
    v, q, w = stage
    qx, qy, qz, qw = q
    x2, y2, z2 = qx + qx, qy + qy, qz + qz
    zz = 1.0 - z2 * qz
    xx, yy = zz - y2 * qy, zz - x2 * qx
    zz = 1.0 - x2 * qx - y2 * qy
    xy, yx = x2 * qy - z2 * qw, x2 * qy + z2 * qw
    xz, zx = x2 * qz + y2 * qw, x2 * qz - y2 * qw
    yz, zy = y2 * qz - x2 * qw, y2 * qz + x2 * qw
    airspeed_B = (
        xx * v[0] + yx * v[1] + zx * v[2],
        xy * v[0] + yy * v[1] + zy * v[2],
        xz * v[0] + yz * v[1] + zz * v[2],
    )
    f, turn = accelerations(airspeed_B, w, rotors, air, lifts)
    return Slope(
        v=(
            xx * f[0] + xy * f[1] + xz * f[2],
            yx * f[0] + yy * f[1] + yz * f[2],
            zx * f[0] + zy * f[1] + zz * f[2] - GRAVITY_M_PER_S2,
        ),
        q_twice=(
            qw * w[0] + qy * w[2] - qz * w[1],
            qw * w[1] + qz * w[0] - qx * w[2],
            qw * w[2] + qx * w[1] - qy * w[0],
            -qx * w[0] - qy * w[1] - qz * w[2],
        ),
        w=turn,
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


def ahead(stage: Stage, slope: Slope, h: float) -> Stage:
    """`stage` after h seconds of a slope; the attitude is not normalised."""
    v, q, w = stage
    return Stage(moved(v, slope.v, h), turned(q, slope.q_twice, 0.5 * h), moved(w, slope.w, h))


def normalized(q: Quaternion) -> Quaternion:
    """`q` scaled to unit length."""
    scale = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (scale * q[0], scale * q[1], scale * q[2], scale * q[3])
