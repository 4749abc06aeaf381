"""What is said of one vehicle of a batch: its labels, tick by tick; as in `lane`."""

from __future__ import annotations

import math

import numpy as np

from lcd_flight.control.geometric import dot
from lcd_flight.model import FloatArray
from sim_bridge.kernels import rows
from sim_bridge.kernels.elementary import arctan2, cos_sin
from sim_bridge.kernels.guidance import reference
from sim_bridge.kernels.rows import LANES, load_motion

MAX_SPEED = 20.0
"""m/s, each axis: RotorPy's early exit."""
MAX_RATE = 100.0
"""rad/s, each axis: likewise."""


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


def count_clips(memory: FloatArray, lane: int, tick: float) -> None:
    """Add this tick's clipped motor commands to the saturation labels."""
    clips = memory[rows.CLIPS * LANES + lane]
    counts = (memory[rows.ALIVE * LANES + lane] > 0.0) & (tick <= memory[rows.LAST_TICK * LANES + lane])
    add(memory, rows.CLIPPED, lane, clips, counts)
    run = memory[rows.RUN * LANES + lane] + 1.0 if clips > 0.0 else 0.0
    memory[rows.RUN * LANES + lane] = run
    longest = memory[rows.LONGEST_RUN * LANES + lane]
    memory[rows.LONGEST_RUN * LANES + lane] = max(longest, run) if counts else longest


def add(memory: FloatArray, row: int, lane: int, value: float, counts: bool) -> None:
    """Add to a label where the tick counts."""
    memory[row * LANES + lane] += value if counts else 0.0
