"""The multirotor over a floor under constant rotor commands: the same steps as in a rollout, compiled on first use."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from lcd_flight.jit import Compiler
from lcd_flight.model import FloatArray
from sim_bridge.compiled import SOURCES
from sim_bridge.kernels import rows
from sim_bridge.kernels.block import Craft
from sim_bridge.kernels.lane import disturb, draw, fly_step
from sim_bridge.kernels.noise import key_of
from sim_bridge.kernels.plant import meet_floor
from sim_bridge.kernels.rows import LANES, load_motion


def fly_rotors(
    memory: FloatArray, contact: FloatArray, seed: np.uint64, first: int, count: int, craft: Craft, floor_m: float
) -> None:
    """Fly steps `first` to `first` + `count` - 1 of lane 0; noise comes at the end of each tick."""
    key = key_of(seed)
    for step in range(first, first + count):
        before = load_motion(memory, rows.MOTION, 0)
        fly_step(memory, 0, craft.air, craft.step_s, craft.motor_decay)
        spins = memory[rows.GOAL * LANES] > 0.0
        if (step + 1) % craft.steps == 0 and craft.motor_noise > 0.0 and spins:
            draw(memory, 0, key, np.uint64((step + 1) // craft.steps))
            disturb(memory, 0, craft.air, craft.motor_noise)
        after = load_motion(memory, rows.MOTION, 0)
        if after.p_WB[2] < floor_m:
            stood = before.p_WB[2] <= floor_m
            meet_floor(memory, contact, before if stood else after, floor_m)


@cache
def rotor_kernel() -> Any:
    """`fly_rotors`, compiled."""
    options = {"error_model": "numpy", "nogil": True, "_nrt": False, "fastmath": {"contract", "nsz", "arcp"}}
    return Compiler(*SOURCES, Path(__file__), **options).kernel(fly_rotors)
