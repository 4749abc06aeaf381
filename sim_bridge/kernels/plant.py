"""One vehicle over a floor, one period of its onboard controller after another; the same steps as in a rollout."""

from __future__ import annotations

import math

import numpy as np

from lcd_flight.control.geometric import clipped
from lcd_flight.model import FloatArray
from sim_bridge.kernels import rows
from sim_bridge.kernels.block import Craft
from sim_bridge.kernels.guidance import stabilise
from sim_bridge.kernels.lane import disturb, draw, fly_step
from sim_bridge.kernels.multirotor import Motion
from sim_bridge.kernels.noise import key_of
from sim_bridge.kernels.rows import LANES, load_motion, store_motion

IMPACT_SPEED = 0
"""m/s, greatest downward speed at touchdown so far."""
IMPACT_UPRIGHT = 1
"""Least cosine of the tilt at touchdown so far."""


def fly_periods(
    memory: FloatArray, contact: FloatArray, seed: np.uint64, first: int, count: int, craft: Craft, floor_m: float
) -> None:
    """Fly periods `first` to `first` + `count` - 1 of lane 0; noise comes at the end of each tick."""
    key = key_of(seed)
    for period in range(first, first + count):
        before = load_motion(memory, rows.MOTION, 0)
        stabilise(memory, 0, craft.air, craft.onboard)
        fly_step(memory, 0, craft.air, craft.step_s, craft.motor_decay)
        spins = memory[rows.SETPOINT * LANES] > 0.0
        if (period + 1) % craft.steps == 0 and craft.motor_noise > 0.0 and spins:
            draw(memory, 0, key, np.uint64((period + 1) // craft.steps))
            disturb(memory, 0, craft.air, craft.motor_noise)
        after = load_motion(memory, rows.MOTION, 0)
        if after.p_WB[2] < floor_m:
            stood = before.p_WB[2] <= floor_m
            meet_floor(memory, contact, before if stood else after, floor_m)


def meet_floor(memory: FloatArray, contact: FloatArray, motion: Motion, floor_m: float) -> None:
    """It stands, level, where it stood or touched; friction holds it. Thrust above weight lifts it off by itself."""
    x, y, z, w = motion.q_WB
    upright = 1.0 - 2.0 * (x * x + y * y)
    contact[IMPACT_SPEED] = max(contact[IMPACT_SPEED], -motion.v_WB_W[2])
    contact[IMPACT_UPRIGHT] = min(contact[IMPACT_UPRIGHT], clipped(upright, -1.0, 1.0))
    rest = (0.0, 0.0, 0.0)
    size = math.sqrt(z * z + w * w)
    level = (0.0, 0.0, z / size, w / size) if size > 0.0 else (0.0, 0.0, 0.0, 1.0)
    store_motion(memory, rows.MOTION, 0, Motion((motion.p_WB[0], motion.p_WB[1], floor_m), rest, level, rest))
