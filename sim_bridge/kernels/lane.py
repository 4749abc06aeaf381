"""How one vehicle of a batch flies for one tick; the kernel runs each of these over all lanes.

`memory` is laid out by `rows`. No branches and no calls that remain: each function becomes one vector loop.
"""

from __future__ import annotations

import numpy as np

from lcd_flight.control.geometric import Row4, clipped
from lcd_flight.model import FloatArray, Vector3
from sim_bridge.kernels import rows
from sim_bridge.kernels.multirotor import Airframe, Motion, lagged, normalized, rotor_sums, step
from sim_bridge.kernels.noise import normal_pair
from sim_bridge.kernels.rows import LANES, load4, load_motion, store3, store4, store_motion

TICK_S = 0.01
"""The control step."""


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
