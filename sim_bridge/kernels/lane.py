"""What one vehicle of a batch does in one tick; the kernel runs each of these over all lanes.

`memory` is laid out by `rows`. No branches and no calls that remain: each function becomes one vector loop.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from lcd_flight.control.flight_law import integrated, thrust_and_attitude
from lcd_flight.control.geometric import (
    Allocation,
    Row4,
    acceleration_setpoint,
    attitude_setpoint,
    clipped,
    dot,
    moment,
    moment_feed_forward,
    rotation_of,
    rotor_speeds,
    scaled,
)
from lcd_flight.model import FloatArray, Vector3
from sim_bridge.kernels import rows
from sim_bridge.kernels.elementary import arctan2, cos_sin
from sim_bridge.kernels.multirotor import Airframe, Motion, lagged, normalized, rotor_sums, step
from sim_bridge.kernels.noise import normal_pair
from sim_bridge.kernels.onboard import (
    DEGREES,
    Onboard,
    PidMemory,
    Setpoint,
    cascade,
    mixed,
    received,
    roll_pitch_yaw,
    speed_of,
)
from sim_bridge.kernels.rows import LANES, load3, load4, load_motion, store3, store4, store_motion

TICK_S = 0.01
"""The control step."""
MAX_SPEED = 20.0
"""m/s, each axis: RotorPy's early exit."""
MAX_RATE = 100.0
"""rad/s, each axis: likewise."""


class Law(NamedTuple):
    """What the controller believes of the vehicle and how it is tuned (`model.GeometricGains`)."""

    mass_kg: float
    inertia_kg_m2: Vector3
    position_gain: Vector3
    velocity_gain: Vector3
    attitude_gain: float
    rate_gain: float
    allocation: Allocation
    feed_forward: bool
    """Whether the paper's last term, which RotorPy drops, is added to the moment."""
    integral_gain: Vector3
    integral_limit: float
    thrust_limit_N: float


class Sample(NamedTuple):
    """The reference at a tick, as the law needs it."""

    p_W: Vector3
    v_W: Vector3
    a_W: Vector3
    yaw_rad: float
    yaw_rate: float
    yaw_acceleration: float


def remember(memory: FloatArray, lane: int) -> None:
    """Keep position and velocity of the tick that ends."""
    motion = load_motion(memory, rows.MOTION, lane)
    store3(memory, rows.BEFORE, lane, motion.p_WB)
    store3(memory, rows.BEFORE + 3, lane, motion.v_WB_W)


def advance(memory: FloatArray, lane: int, air: Airframe, step_s: float, decay: float) -> None:
    """Fly one Runge-Kutta step under constant commands. decay: exp(-t / tau) of half the step."""
    motion = load_motion(memory, rows.MOTION, lane)
    speeds, commands = load4(memory, rows.SPEEDS, lane), load4(memory, rows.COMMANDS, lane)
    middle = lagged(speeds, commands, decay)
    end = lagged(middle, commands, decay)
    moved = step(motion, rotor_sums(speeds, air), rotor_sums(middle, air), rotor_sums(end, air), air, step_s)
    store_motion(memory, rows.MOTION, lane, Motion(moved.p_WB, moved.v_WB_W, normalized(moved.q_WB), moved.w_WB_B))
    store4(memory, rows.SPEEDS, lane, end)


def disturb(memory: FloatArray, lane: int, key: np.uint64, tick: np.uint64, air: Airframe, noise: float) -> None:
    """Add the tick's motor noise, then hold the rotor speeds within their limits. noise: rad/s."""
    speeds = load4(memory, rows.SPEEDS, lane)
    a, b = normal_pair(key, tick + tick)
    c, d = normal_pair(key, tick + tick + np.uint64(1))
    low, high = air.speed_min, air.speed_max
    disturbed = (
        clipped(speeds[0] + noise * a, low, high),
        clipped(speeds[1] + noise * b, low, high),
        clipped(speeds[2] + noise * c, low, high),
        clipped(speeds[3] + noise * d, low, high),
    )
    store4(memory, rows.SPEEDS, lane, disturbed)


def look(memory: FloatArray, lane: int, tick: float) -> None:
    """Give the controller the motion; within a gap of the pose its last velocity and attitude go on."""
    motion = load_motion(memory, rows.MOTION, lane)
    seen = load_motion(memory, rows.SEEN, lane)
    p, v, q, _ = seen
    gap = (tick >= memory[rows.GAP_START * LANES + lane]) & (tick < memory[rows.GAP_END * LANES + lane])
    coasted = (p[0] + TICK_S * v[0], p[1] + TICK_S * v[1], p[2] + TICK_S * v[2])
    store3(memory, rows.SEEN, lane, chosen3(gap, coasted, motion.p_WB))
    store3(memory, rows.SEEN + 3, lane, chosen3(gap, v, motion.v_WB_W))
    store4(memory, rows.SEEN + 6, lane, chosen4(gap, q, motion.q_WB))
    store3(memory, rows.SEEN + 10, lane, chosen3(gap, (0.0, 0.0, 0.0), motion.w_WB_B))


def chosen3(condition: bool, a: Vector3, b: Vector3) -> Vector3:
    """`a` where the condition holds, else `b`."""
    return (a[0] if condition else b[0], a[1] if condition else b[1], a[2] if condition else b[2])


def chosen4(condition: bool, a: Row4, b: Row4) -> Row4:
    """`a` where the condition holds, else `b`."""
    return (
        a[0] if condition else b[0],
        a[1] if condition else b[1],
        a[2] if condition else b[2],
        a[3] if condition else b[3],
    )


def refer(memory: FloatArray, lane: int, tick: float) -> None:
    """Sample the plan at a tick; after its end, at rest there (plans end at rest)."""
    time = min(TICK_S * tick, memory[rows.DURATION * LANES + lane]) - memory[rows.SEGMENT_START * LANES + lane]
    x = horner(memory, rows.COEFFICIENTS, lane, time)
    y = horner(memory, rows.COEFFICIENTS + 8, lane, time)
    z = horner(memory, rows.COEFFICIENTS + 16, lane, time)
    yaw = horner(memory, rows.COEFFICIENTS + 24, lane, time)
    store3(memory, rows.REFERENCE, lane, (x[0], y[0], z[0]))
    store3(memory, rows.REFERENCE + 3, lane, (x[1], y[1], z[1]))
    store3(memory, rows.REFERENCE + 6, lane, (x[2], y[2], z[2]))
    store3(memory, rows.REFERENCE + 9, lane, yaw)


def reference(memory: FloatArray, lane: int) -> Sample:
    """The plan at this tick."""
    return Sample(
        load3(memory, rows.REFERENCE, lane),
        load3(memory, rows.REFERENCE + 3, lane),
        load3(memory, rows.REFERENCE + 6, lane),
        memory[(rows.REFERENCE + 9) * LANES + lane],
        memory[(rows.REFERENCE + 10) * LANES + lane],
        memory[(rows.REFERENCE + 11) * LANES + lane],
    )


def horner(memory: FloatArray, row: int, lane: int, time: float) -> Vector3:
    """Value, first and second derivative of the polynomial of order 7 whose coefficients begin at `row`."""
    value, first, half_second = memory[(row + 7) * LANES + lane], 0.0, 0.0
    for k in range(6, -1, -1):
        half_second = half_second * time + first
        first = first * time + value
        value = value * time + memory[(row + k) * LANES + lane]
    return (value, first, 2.0 * half_second)


def judge(memory: FloatArray, lane: int, tick: float) -> None:
    """Add this tick's errors to the labels, unless the rollout is over or has left the model's validity."""
    p, v, q, w = load_motion(memory, rows.MOTION, lane)
    ref = reference(memory, lane)
    fastest = max(abs(v[0]), abs(v[1]), abs(v[2]))
    quickest = max(abs(w[0]), abs(w[1]), abs(w[2]))
    alive = (memory[rows.ALIVE * LANES + lane] > 0.0) & (fastest <= MAX_SPEED) & (quickest <= MAX_RATE)
    running = tick <= memory[rows.LAST_TICK * LANES + lane]
    memory[rows.ALIVE * LANES + lane] = 1.0 if alive else (0.0 if running else memory[rows.ALIVE * LANES + lane])
    counts = alive & running
    e = (p[0] - ref.p_W[0], p[1] - ref.p_W[1], p[2] - ref.p_W[2])
    e_v = (v[0] - ref.v_W[0], v[1] - ref.v_W[1], v[2] - ref.v_W[2])
    square = dot(e, e)
    yaw = arctan2(2.0 * (q[3] * q[2] + q[0] * q[1]), 1.0 - 2.0 * (q[1] * q[1] + q[2] * q[2]))
    e_yaw = yaw - ref.yaw_rad
    wrapped = e_yaw - 2.0 * math.pi * np.floor(e_yaw / (2.0 * math.pi) + 0.5)
    largest = memory[rows.LARGEST * LANES + lane]
    record = counts & (square > largest)
    memory[rows.LARGEST * LANES + lane] = square if record else largest
    memory[rows.LARGEST_TICK * LANES + lane] = tick if record else memory[rows.LARGEST_TICK * LANES + lane]
    segment_largest = memory[rows.SEGMENT_LARGEST * LANES + lane]
    memory[rows.SEGMENT_LARGEST * LANES + lane] = max(segment_largest, square) if counts else segment_largest
    add(memory, rows.SAMPLES, lane, 1.0, counts)
    add(memory, rows.SUM, lane, math.sqrt(square), counts)
    add(memory, rows.SUM_2, lane, square, counts)
    add(memory, rows.SUM_8, lane, (square * square) * (square * square), counts)
    add(memory, rows.YAW_COST, lane, 2.0 * (1.0 - cos_sin(e_yaw)[0]), counts)
    add(memory, rows.PAPER_COST, lane, square + wrapped * wrapped, counts)
    add(memory, rows.RELEASED_COST, lane, square + dot(e_v, e_v) + e_yaw * e_yaw, counts)


def add(memory: FloatArray, row: int, lane: int, value: float, counts: bool) -> None:
    """Add to a label where the tick counts."""
    memory[row * LANES + lane] += value if counts else 0.0


def command_rotors(memory: FloatArray, lane: int, law: Law, air: Airframe) -> None:
    """The paper's loop: the law's force and moment straight to rotor speeds."""
    p, v, q, w = load_motion(memory, rows.SEEN, lane)
    ref = reference(memory, lane)
    acceleration = acceleration_setpoint(p, v, ref.p_W, ref.v_W, ref.a_W, law.position_gain, law.velocity_gain)
    force = scaled(acceleration, law.mass_kg)
    R_WB = rotation_of(q)
    R_WD = attitude_setpoint(force, cos_sin(ref.yaw_rad))
    turn = moment(R_WB, R_WD, w, ref.yaw_rate, law.inertia_kg_m2, law.attitude_gain, law.rate_gain)
    if law.feed_forward:
        desired, change = (0.0, 0.0, ref.yaw_rate), (0.0, 0.0, ref.yaw_acceleration)
        more = moment_feed_forward(R_WB, R_WD, w, desired, change, law.inertia_kg_m2)
        turn = (turn[0] + more[0], turn[1] + more[1], turn[2] + more[2])
    wanted = rotor_speeds(dot(force, R_WB[2]), turn, law.allocation)
    low, high = air.speed_min, air.speed_max
    given = (
        clipped(wanted[0], low, high),
        clipped(wanted[1], low, high),
        clipped(wanted[2], low, high),
        clipped(wanted[3], low, high),
    )
    store4(memory, rows.COMMANDS, lane, given)
    memory[rows.CLIPS * LANES + lane] = differing(wanted, given)


def command_attitude(memory: FloatArray, lane: int, law: Law, controller: Onboard) -> None:
    """The flight loop: the law's thrust and attitude as the setpoint of the onboard controller."""
    p, v, q, _ = load_motion(memory, rows.SEEN, lane)
    ref = reference(memory, lane)
    integral = load3(memory, rows.INTEGRAL, lane)
    acceleration = acceleration_setpoint(p, v, ref.p_W, ref.v_W, ref.a_W, law.position_gain, law.velocity_gain)
    heading = cos_sin(ref.yaw_rad)
    thrust_N, R_WD = thrust_and_attitude(acceleration, integral, rotation_of(q)[2], heading, law.mass_kg)
    dt_s = 0.0 if thrust_N > law.thrust_limit_N else TICK_S
    error = (p[0] - ref.p_W[0], p[1] - ref.p_W[1], p[2] - ref.p_W[2])
    store3(memory, rows.INTEGRAL, lane, integrated(integral, error, law.integral_gain, law.integral_limit, dt_s))
    setpoint = received(thrust_N, R_WD, rotation_of(load4(memory, rows.MOTION + 6, lane)), controller)
    memory[rows.SETPOINT * LANES + lane] = setpoint.thrust
    store3(memory, rows.SETPOINT + 1, lane, setpoint.attitude)
    memory[rows.CLIPS * LANES + lane] = 0.0


def stabilise(memory: FloatArray, lane: int, air: Airframe, controller: Onboard) -> None:
    """One period of the onboard controller: from its setpoint to commanded rotor speeds."""
    _, _, q, w = load_motion(memory, rows.MOTION, lane)
    setpoint = Setpoint(memory[rows.SETPOINT * LANES + lane], load3(memory, rows.SETPOINT + 1, lane))
    before = PidMemory(
        load3(memory, rows.PID, lane),
        load3(memory, rows.PID + 3, lane),
        load3(memory, rows.PID + 6, lane),
        load3(memory, rows.PID + 9, lane),
    )
    outputs, after = cascade(setpoint, roll_pitch_yaw(rotation_of(q)), scaled(w, DEGREES), before, controller)
    store3(memory, rows.PID, lane, after.attitude_integral)
    store3(memory, rows.PID + 3, lane, after.rate_integral)
    store3(memory, rows.PID + 6, lane, after.attitude)
    store3(memory, rows.PID + 9, lane, after.rates)
    asked, given = mixed(setpoint.thrust, outputs, controller)
    low, high = air.speed_min, air.speed_max
    speeds = (
        clipped(speed_of(given[0], high), low, high),
        clipped(speed_of(given[1], high), low, high),
        clipped(speed_of(given[2], high), low, high),
        clipped(speed_of(given[3], high), low, high),
    )
    store4(memory, rows.COMMANDS, lane, speeds)
    memory[rows.CLIPS * LANES + lane] += differing(asked, given) * (controller.period_s / TICK_S)


def differing(a: Row4, b: Row4) -> float:
    """How many of the four differ."""
    return (
        (1.0 if a[0] != b[0] else 0.0)
        + (1.0 if a[1] != b[1] else 0.0)
        + (1.0 if a[2] != b[2] else 0.0)
        + (1.0 if a[3] != b[3] else 0.0)
    )


def count_clips(memory: FloatArray, lane: int, tick: float) -> None:
    """Add this tick's clipped motor commands to the saturation labels."""
    clips = memory[rows.CLIPS * LANES + lane]
    counts = (memory[rows.ALIVE * LANES + lane] > 0.0) & (tick <= memory[rows.LAST_TICK * LANES + lane])
    add(memory, rows.CLIPPED, lane, clips, counts)
    run = memory[rows.RUN * LANES + lane] + 1.0 if clips > 0.0 else 0.0
    memory[rows.RUN * LANES + lane] = run
    longest = memory[rows.LONGEST_RUN * LANES + lane]
    memory[rows.LONGEST_RUN * LANES + lane] = max(longest, run) if counts else longest
