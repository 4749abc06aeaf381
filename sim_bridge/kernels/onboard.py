"""The onboard controller below thrust and attitude setpoints: the PID cascade and mixer of crazyflie-firmware 2026.08.

    controller_pid.c            attitude, then rates, both at 500 Hz; thrust 0 stops the motors and resets the PIDs
    attitude_pid_controller.c   what a PID axis is fed; the outputs saturate as int16
    pid.c                       the derivative acts on the measurement; the integral is bounded; yaw wraps
    power_distribution_quadrotor.c   the legacy mixer, and the cap: too much for one motor lowers all four
    motors.c                    with battery compensation thrust counts are linear in force

The firmware's low-pass filters are off in its defaults (platform_defaults.h) and left out. Its pitch is positive nose
up and its mixer is written for its motor order; here angles are those of the body frame (x forward, y left, z up) and
the mixer reads signs from where the rotors are. Angles are degrees, as in the firmware's gains; counts are u16.
Scalars and `math` only: compiled into the kernels.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from lcd_flight.control.geometric import Rotation, Row4, clipped
from lcd_flight.model import PidGains, Vector3, Vehicle
from lcd_flight.model.frames import seen_from_heading
from sim_bridge.kernels.elementary import arctan2

FULL_SCALE = 65535.0
"""Thrust counts at which a motor gives its largest force."""
LARGEST_OUTPUT = 32767.0
"""attitude_pid_controller.c, saturateSignedInt16."""
SMALLEST_THRUST = 1000.0
"""crtp_commander_rpyt.c, MIN_THRUST: a smaller setpoint is none."""
DEGREES = 180.0 / math.pi


class Pid(NamedTuple):
    """Gains of one axis; no limit of the integral is an infinite one."""

    kp: float
    ki: float
    kd: float
    limit: float


class Onboard(NamedTuple):
    """A vehicle's onboard controller, as the equations want it."""

    roll: Pid
    pitch: Pid
    yaw: Pid
    roll_rate: Pid
    pitch_rate: Pid
    yaw_rate: Pid
    period_s: float
    thrust_limit: float
    """Counts."""
    floor: float
    """Counts."""
    roll_signs: Row4
    """Which rotors lift the left side: the sign of y."""
    pitch_signs: Row4
    """Which rotors push the nose down: minus the sign of x."""
    yaw_signs: Row4
    """Which rotors turn it counter-clockwise."""
    counts_per_N: float
    """Collective: full scale over the largest thrust that the vehicle is believed to have."""


class PidMemory(NamedTuple):
    """Integrals of the six axes, and what was measured one period ago."""

    attitude_integral: Vector3
    """deg s"""
    rate_integral: Vector3
    """deg"""
    attitude: Vector3
    """deg"""
    rates: Vector3
    """deg/s"""


class Setpoint(NamedTuple):
    """What the flight loop's setpoint is once it has arrived: thrust in counts, roll, pitch and yaw in deg."""

    thrust: float
    attitude: Vector3


def onboard(vehicle: Vehicle, nominal: Vehicle) -> Onboard:
    """The onboard controller of a vehicle; the thrust scale is that of the vehicle it is believed to be.

    Raises:
        ValueError: the vehicle has none, or one whose rate is not a multiple of 100 Hz.
    """
    controller = vehicle.onboard
    if controller is None:
        raise ValueError(f"vehicle {vehicle.name} has no onboard controller and cannot fly thrust and attitude")
    if controller.rate_hz % 100.0 != 0.0:
        raise ValueError(f"vehicle {vehicle.name}: the onboard rate {controller.rate_hz} Hz is no multiple of 100 Hz")
    r1, r2, r3, r4 = vehicle.rotor_positions_m
    attitude, rates = controller.attitude, controller.rates
    return Onboard(
        roll=_pid(attitude[0]),
        pitch=_pid(attitude[1]),
        yaw=_pid(attitude[2]),
        roll_rate=_pid(rates[0]),
        pitch_rate=_pid(rates[1]),
        yaw_rate=_pid(rates[2]),
        period_s=1.0 / controller.rate_hz,
        thrust_limit=controller.thrust_limit * FULL_SCALE,
        floor=controller.thrust_floor * FULL_SCALE,
        roll_signs=(_sign(r1[1]), _sign(r2[1]), _sign(r3[1]), _sign(r4[1])),
        pitch_signs=(-_sign(r1[0]), -_sign(r2[0]), -_sign(r3[0]), -_sign(r4[0])),
        yaw_signs=vehicle.rotor_directions,
        counts_per_N=FULL_SCALE / nominal.max_thrust_N,
    )


NO_PID = Pid(0.0, 0.0, 0.0, 0.0)
NO_ONBOARD = Onboard(
    *(NO_PID,) * 6,
    period_s=1.0,
    thrust_limit=0.0,
    floor=0.0,
    roll_signs=(0.0,) * 4,
    pitch_signs=(0.0,) * 4,
    yaw_signs=(0.0,) * 4,
    counts_per_N=0.0,
)
"""Stands in where the paper's loop flies a vehicle that has no onboard controller."""


def _pid(gains: PidGains) -> Pid:
    return Pid(gains.kp, gains.ki, gains.kd, gains.integral_limit or math.inf)


def _sign(value: float) -> float:
    return math.copysign(1.0, value) if value else 0.0


def roll_pitch_yaw(R_WB: Rotation) -> Vector3:
    """Roll, pitch and yaw in deg of the attitude with these columns (turns about x, y, z; yaw first)."""
    b1, b2, b3 = R_WB
    level = math.sqrt(b1[0] * b1[0] + b1[1] * b1[1])
    return (
        DEGREES * arctan2(b2[2], b3[2]),
        DEGREES * arctan2(-b1[2], level),
        DEGREES * arctan2(b1[1], b1[0]),
    )


def tilt_and_heading(R_WD: Rotation, R_WB: Rotation) -> Vector3:
    """Roll, pitch and yaw setpoint in deg for the attitude R_WD of a vehicle that has R_WB.

    The firmware corrects the three angles apart: roll and pitch point the thrust along R_WD's b3 at the heading that
    the vehicle has (`seen_from_heading`).
    """
    forward, left = seen_from_heading(R_WD[2], R_WB[0])
    z = R_WD[2][2]
    return (
        DEGREES * arctan2(-left, math.sqrt(forward * forward + z * z)),
        DEGREES * arctan2(forward, z),
        DEGREES * arctan2(R_WD[0][1], R_WD[0][0]),
    )


def received(thrust_N: float, R_WD: Rotation, R_WB: Rotation, controller: Onboard) -> Setpoint:
    """A setpoint as the firmware is given it: thrust in counts within its limits, or none. R_WB: where it is now."""
    counts = clipped(thrust_N * controller.counts_per_N, 0.0, controller.thrust_limit)
    return Setpoint(0.0 if counts < SMALLEST_THRUST else counts, tilt_and_heading(R_WD, R_WB))


def wrapped_deg(angle: float) -> float:
    """The same angle within +-180 degrees, for one that is less than a turn outside."""
    return angle - 360.0 if angle > 180.0 else (angle + 360.0 if angle < -180.0 else angle)


def pid_step(error: float, change: float, integral: float, gains: Pid, period_s: float) -> tuple[float, float]:
    """One period of one axis: output and the new integral. change: of the measurement, since a period ago."""
    grown = clipped(integral + error * period_s, -gains.limit, gains.limit)
    return gains.kp * error + gains.ki * grown - gains.kd * change / period_s, grown


def cascade(
    setpoint: Setpoint, attitude: Vector3, rates: Vector3, memory: PidMemory, controller: Onboard
) -> tuple[Vector3, PidMemory]:
    """One period: roll, pitch and yaw output in counts, and the memory for the next. attitude deg, rates deg/s."""
    wanted, before, held = setpoint.attitude, memory.attitude, memory.attitude_integral
    period = controller.period_s
    p, p_integral = pid_step(wanted[0] - attitude[0], attitude[0] - before[0], held[0], controller.roll, period)
    q, q_integral = pid_step(wanted[1] - attitude[1], attitude[1] - before[1], held[1], controller.pitch, period)
    yaw_error = wrapped_deg(wanted[2] - attitude[2])
    yaw_change = wrapped_deg(attitude[2] - before[2])
    r, r_integral = pid_step(yaw_error, yaw_change, held[2], controller.yaw, period)
    was, kept = memory.rates, memory.rate_integral
    roll, roll_integral = pid_step(p - rates[0], rates[0] - was[0], kept[0], controller.roll_rate, period)
    pitch, pitch_integral = pid_step(q - rates[1], rates[1] - was[1], kept[1], controller.pitch_rate, period)
    yaw, yaw_integral = pid_step(r - rates[2], rates[2] - was[2], kept[2], controller.yaw_rate, period)
    flies = 1.0 if setpoint.thrust > 0.0 else 0.0
    outputs = (
        flies * clipped(roll, -LARGEST_OUTPUT, LARGEST_OUTPUT),
        flies * clipped(pitch, -LARGEST_OUTPUT, LARGEST_OUTPUT),
        flies * clipped(yaw, -LARGEST_OUTPUT, LARGEST_OUTPUT),
    )
    integrals = (flies * p_integral, flies * q_integral, flies * r_integral)
    rate_integrals = (flies * roll_integral, flies * pitch_integral, flies * yaw_integral)
    return outputs, PidMemory(integrals, rate_integrals, attitude, rates)


def mixed(thrust: float, outputs: Vector3, controller: Onboard) -> tuple[Row4, Row4]:
    """Motor commands in counts, as asked for and as given: one above full scale lowers all, none is below the floor."""
    roll, pitch, yaw = 0.5 * outputs[0], 0.5 * outputs[1], outputs[2]
    x, y, z = controller.roll_signs, controller.pitch_signs, controller.yaw_signs
    a = thrust + x[0] * roll + y[0] * pitch + z[0] * yaw
    b = thrust + x[1] * roll + y[1] * pitch + z[1] * yaw
    c = thrust + x[2] * roll + y[2] * pitch + z[2] * yaw
    d = thrust + x[3] * roll + y[3] * pitch + z[3] * yaw
    excess = clipped(max(a, b, c, d) - FULL_SCALE, 0.0, math.inf)
    low = controller.floor if thrust > 0.0 else 0.0
    given = (
        clipped(a - excess, low, FULL_SCALE),
        clipped(b - excess, low, FULL_SCALE),
        clipped(c - excess, low, FULL_SCALE),
        clipped(d - excess, low, FULL_SCALE),
    )
    return (a, b, c, d), given


def speed_of(counts: float, speed_max: float) -> float:
    """Rotor speed in rad/s whose thrust is the share counts / full scale of the largest."""
    return speed_max * math.sqrt(counts / FULL_SCALE)
