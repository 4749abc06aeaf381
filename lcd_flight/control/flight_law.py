"""The flight loop's law: the geometric law up to collective thrust and desired attitude; the vehicle does the rest.

The paper's lab flew it so (section V). The optional integral is what hardware needs against a steady offset (a tired
battery, a bent frame); it is off while `GeometricGains.integral` is zero.
"""

from __future__ import annotations

import math

from lcd_flight.control.geometric import (
    Rotation,
    acceleration_setpoint,
    attitude_setpoint,
    clipped,
    dot,
    rotation_of,
    scaled,
)
from lcd_flight.model import AttitudeThrust, Quaternion, Reference, State, Vector3, Vehicle

NO_INTEGRAL: Vector3 = (0.0, 0.0, 0.0)
"""What a flight starts with, and what it goes back to at take-off."""


def command(
    state: State, reference: Reference, vehicle: Vehicle, integral: Vector3, dt_s: float
) -> tuple[AttitudeThrust, Vector3]:
    """The setpoint of one tick and the integral to hand to the next.

    integral: acceleration in m/s^2, world, that the integral asks for; dt_s: time since the last tick. A state or
    reference that is not finite gives a setpoint that is not finite (`AttitudeThrust.is_finite`).
    """
    gains = vehicle.flight_gains
    error = _difference(state.p_WB, reference.p_W)
    R_WB = rotation_of(state.q_WB)
    heading = (math.cos(reference.yaw_rad), math.sin(reference.yaw_rad))
    thrust_N, R_WD = thrust_and_attitude(
        acceleration_setpoint(
            state.p_WB, state.v_WB_W, reference.p_W, reference.v_W, reference.a_W, gains.position, gains.velocity
        ),
        integral,
        R_WB[2],
        heading,
        vehicle.mass_kg,
    )
    saturated = thrust_N > thrust_limit_N(vehicle)
    held = integrated(integral, error, gains.integral, gains.integral_limit, 0.0 if saturated else dt_s)
    return AttitudeThrust(thrust_N, quaternion_of(R_WD), reference.yaw_rate), held


def thrust_and_attitude(
    acceleration_W: Vector3, integral_W: Vector3, b3_W: Vector3, heading: tuple[float, float], mass_kg: float
) -> tuple[float, Rotation]:
    """Collective thrust in N, never negative, and the attitude R_WD for an acceleration (gravity made up for) in m/s^2.

    b3_W: the body z axis, onto which the force is projected. heading: (cos, sin) of the yaw.
    """
    force_W = scaled(_sum(acceleration_W, integral_W), mass_kg)
    return clipped(dot(force_W, b3_W), 0.0, math.inf), attitude_setpoint(force_W, heading)


def integrated(integral_W: Vector3, error_W: Vector3, gain: Vector3, limit: float, dt_s: float) -> Vector3:
    """The integral after dt_s more of a position error in m, each axis within +-limit m/s^2.

    Anti-windup: the bound, and no growth while thrust is at its limit (the caller passes dt_s = 0).
    """
    return (
        clipped(integral_W[0] - gain[0] * error_W[0] * dt_s, -limit, limit),
        clipped(integral_W[1] - gain[1] * error_W[1] * dt_s, -limit, limit),
        clipped(integral_W[2] - gain[2] * error_W[2] * dt_s, -limit, limit),
    )


def thrust_limit_N(vehicle: Vehicle) -> float:
    """The largest collective thrust that the vehicle's onboard controller takes."""
    share = 1.0 if vehicle.onboard is None else vehicle.onboard.thrust_limit
    return share * vehicle.max_thrust_N


def quaternion_of(R_WB: Rotation) -> Quaternion:
    """The unit quaternion xyzw, w >= 0, of a rotation given by its columns (Shepperd 1978: divide by the largest)."""
    (xx, yx, zx), (xy, yy, zy), (xz, yz, zz) = R_WB
    trace = xx + yy + zz
    largest = max(trace, xx, yy, zz)
    if largest == trace:
        q = (zy - yz, xz - zx, yx - xy, 1.0 + trace)
    elif largest == xx:
        q = (1.0 + xx - yy - zz, yx + xy, xz + zx, zy - yz)
    elif largest == yy:
        q = (yx + xy, 1.0 + yy - xx - zz, zy + yz, xz - zx)
    else:
        q = (xz + zx, zy + yz, 1.0 + zz - xx - yy, yx - xy)
    size = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    scale = math.copysign(1.0 / size, q[3])
    return (scale * q[0], scale * q[1], scale * q[2], scale * q[3])


def _difference(a: Vector3, b: Vector3) -> Vector3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _sum(a: Vector3, b: Vector3) -> Vector3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])
