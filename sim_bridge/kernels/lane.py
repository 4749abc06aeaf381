"""How one vehicle of a batch flies for one tick; `block` runs each of these over all lanes.

`memory` is laid out by `rows`. No branches and no calls that remain: each function becomes one vector loop. They are
short on purpose: the processor works on as many rounds of a loop at a time as it can hold instructions (decision 0083).
"""

from __future__ import annotations

import numpy as np

from lcd_flight.control.geometric import Row4, clipped
from lcd_flight.model import FloatArray, Vector3
from sim_bridge.kernels import rows
from sim_bridge.kernels.multirotor import (
    Airframe,
    Slope,
    Stage,
    ahead,
    lagged,
    lagged_sums,
    linear_sums,
    moved,
    normalized,
    rotor_sums,
    slope_of,
)
from sim_bridge.kernels.noise import normal_pair
from sim_bridge.kernels.rows import (
    LANES,
    load3,
    load4,
    load_linear,
    load_motion,
    load_rotors,
    load_stage,
    store3,
    store4,
    store_linear,
    store_rotors,
    store_stage,
)

TICK_S = 0.01
"""The control step."""


def turn_rotors(memory: FloatArray, lane: int, speeds: Row4, air: Airframe) -> None:
    """Set the rotor speeds, and what they add up to."""
    store4(memory, rows.SPEEDS, lane, speeds)
    store_rotors(memory, rows.ROTORS_NOW, lane, rotor_sums(speeds, linear_sums(speeds, air), air))


def aim_rotors(memory: FloatArray, lane: int, commands: Row4, air: Airframe) -> None:
    """Set the commanded rotor speeds, and what they add up to."""
    store4(memory, rows.COMMANDS, lane, commands)
    store_linear(memory, rows.GOAL, lane, linear_sums(commands, air))


def first_stage(memory: FloatArray, lane: int, air: Airframe, step_s: float, lifts: bool) -> None:
    """Begin a Runge-Kutta step of order 4 with the slope at its start. lifts: as in `multirotor.accelerations`.

    With y2, y3, y4 the stages that follow from the slopes k1, k2, k3, the step ends at (y2 + 2 y3 + y4 - y) / 3 +
    step k4 / 6: the textbook's mean of slopes in fewer multiplications. The position's slope is the velocity.
    """
    start = load_stage(memory, rows.MOTION + 3, lane)
    slope = slope_of(start, load_rotors(memory, rows.ROTORS_NOW, lane), air, lifts)
    second = ahead(start, slope, 0.5 * step_s)
    store_stage(memory, rows.STAGE, lane, second)
    both = sum3(start.v_WB_W, second.v_WB_W)
    store3(memory, rows.MOTION, lane, moved(load3(memory, rows.MOTION, lane), both, step_s / 6.0))


def spin(memory: FloatArray, lane: int, air: Airframe, decay: float) -> None:
    """Bring the rotors to the step's middle and end under constant commands. decay: exp(-t / tau) of half the step."""
    speeds, commands = load4(memory, rows.SPEEDS, lane), load4(memory, rows.COMMANDS, lane)
    now, goal = load_linear(memory, rows.ROTORS_NOW + 4, lane), load_linear(memory, rows.GOAL, lane)
    middle, end = lagged(speeds, commands, decay), lagged(speeds, commands, decay * decay)
    store_rotors(memory, rows.ROTORS_MIDDLE, lane, rotor_sums(middle, lagged_sums(now, goal, decay), air))
    store_rotors(memory, rows.ROTORS_NOW, lane, rotor_sums(end, lagged_sums(now, goal, decay * decay), air))
    store4(memory, rows.SPEEDS, lane, end)


def second_stage(memory: FloatArray, lane: int, air: Airframe, step_s: float, lifts: bool) -> None:
    """The slope in the step's middle."""
    second = load_stage(memory, rows.STAGE, lane)
    slope = slope_of(second, load_rotors(memory, rows.ROTORS_MIDDLE, lane), air, lifts)
    third = ahead(load_stage(memory, rows.MOTION + 3, lane), slope, 0.5 * step_s)
    store_stage(memory, rows.STAGE, lane, third)
    store_stage(memory, rows.STAGES, lane, added(added(second, third), third))


def third_stage(memory: FloatArray, lane: int, air: Airframe, step_s: float, lifts: bool) -> None:
    """The slope in the step's middle once more."""
    third = load_stage(memory, rows.STAGE, lane)
    slope = slope_of(third, load_rotors(memory, rows.ROTORS_MIDDLE, lane), air, lifts)
    fourth = ahead(load_stage(memory, rows.MOTION + 3, lane), slope, step_s)
    store_stage(memory, rows.STAGE, lane, fourth)
    store_stage(memory, rows.STAGES, lane, added(load_stage(memory, rows.STAGES, lane), fourth))


def last_stage(memory: FloatArray, lane: int, air: Airframe, step_s: float, lifts: bool) -> None:
    """The slope at the step's end, and the end itself."""
    slope = slope_of(load_stage(memory, rows.STAGE, lane), load_rotors(memory, rows.ROTORS_NOW, lane), air, lifts)
    stages = load_stage(memory, rows.STAGES, lane)
    end = ended(load_stage(memory, rows.MOTION + 3, lane), stages, slope, step_s)
    store_stage(memory, rows.MOTION + 3, lane, Stage(end.v_WB_W, normalized(end.q_WB), end.w_WB_B))
    store3(memory, rows.MOTION, lane, moved(load3(memory, rows.MOTION, lane), stages.v_WB_W, step_s / 6.0))


def fly_step(memory: FloatArray, lane: int, air: Airframe, step_s: float, decay: float) -> None:
    """A whole step of one vehicle alone."""
    first_stage(memory, lane, air, step_s, True)
    spin(memory, lane, air, decay)
    second_stage(memory, lane, air, step_s, True)
    third_stage(memory, lane, air, step_s, True)
    last_stage(memory, lane, air, step_s, True)


def added(a: Stage, b: Stage) -> Stage:
    """Number by number."""
    q, r = a.q_WB, b.q_WB
    turn = (q[0] + r[0], q[1] + r[1], q[2] + r[2], q[3] + r[3])
    return Stage(sum3(a.v_WB_W, b.v_WB_W), turn, sum3(a.w_WB_B, b.w_WB_B))


def sum3(a: Vector3, b: Vector3) -> Vector3:
    """The sum of two."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def ended(start: Stage, stages: Stage, slope: Slope, step_s: float) -> Stage:
    """(stages - start) / 3 + step / 6 slope."""
    v, q, w = start
    a, b, c = stages
    rest = Stage(
        ((a[0] - v[0]) / 3.0, (a[1] - v[1]) / 3.0, (a[2] - v[2]) / 3.0),
        ((b[0] - q[0]) / 3.0, (b[1] - q[1]) / 3.0, (b[2] - q[2]) / 3.0, (b[3] - q[3]) / 3.0),
        ((c[0] - w[0]) / 3.0, (c[1] - w[1]) / 3.0, (c[2] - w[2]) / 3.0),
    )
    return ahead(rest, slope, step_s / 6.0)


def draw(memory: FloatArray, lane: int, key: np.uint64, tick: np.uint64) -> None:
    """Four standard normal numbers of the tick."""
    a, b = normal_pair(key, tick + tick)
    c, d = normal_pair(key, tick + tick + np.uint64(1))
    store4(memory, rows.NOISE, lane, (a, b, c, d))


def disturb(memory: FloatArray, lane: int, air: Airframe, noise: float) -> None:
    """Add the motor noise that was drawn, and hold the rotor speeds within their limits. noise: rad/s."""
    speeds, drawn = load4(memory, rows.SPEEDS, lane), load4(memory, rows.NOISE, lane)
    low, high = air.speed_min, air.speed_max
    disturbed = (
        clipped(speeds[0] + noise * drawn[0], low, high),
        clipped(speeds[1] + noise * drawn[1], low, high),
        clipped(speeds[2] + noise * drawn[2], low, high),
        clipped(speeds[3] + noise * drawn[3], low, high),
    )
    turn_rotors(memory, lane, disturbed, air)


def remember(memory: FloatArray, lane: int) -> None:
    """Keep position and velocity of the tick that ends."""
    motion = load_motion(memory, rows.MOTION, lane)
    store3(memory, rows.BEFORE, lane, motion.p_WB)
    store3(memory, rows.BEFORE + 3, lane, motion.v_WB_W)


def look(memory: FloatArray, lane: int, tick: float) -> None:
    """Give the controller the motion; within a gap of the pose its last velocity and attitude go on."""
    motion = load_motion(memory, rows.MOTION, lane)
    p, v, q, _ = load_motion(memory, rows.SEEN, lane)
    gap = (tick >= memory[rows.GAP_START * LANES + lane]) & (tick < memory[rows.GAP_END * LANES + lane])
    store3(memory, rows.SEEN, lane, chosen3(gap, moved(p, v, TICK_S), motion.p_WB))
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
