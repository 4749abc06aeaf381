"""What is said of one vehicle of a batch: its labels, tick by tick; as in `lane`."""

from __future__ import annotations

import math

import numpy as np

from lcd_flight.control.geometric import dot
from lcd_flight.model import FloatArray
from sim_bridge.kernels import rows
from sim_bridge.kernels.elementary import arctan2
from sim_bridge.kernels.guidance import reference
from sim_bridge.kernels.rows import LANES, load4, load_motion

MAX_SPEED = 20.0
"""m/s, each axis: RotorPy's early exit."""
MAX_RATE = 100.0
"""rad/s, each axis: likewise."""


def judge_position(memory: FloatArray, lane: int, tick: float) -> None:
    """Add this tick's errors to the labels, unless the rollout is over or has left the model's validity."""
    p, v, _, w = load_motion(memory, rows.MOTION, lane)
    ref = reference(memory, lane)
    fastest = max(abs(v[0]), abs(v[1]), abs(v[2]))
    quickest = max(abs(w[0]), abs(w[1]), abs(w[2]))
    alive = (memory[rows.ALIVE * LANES + lane] > 0.0) & (fastest <= MAX_SPEED) & (quickest <= MAX_RATE)
    running = tick <= memory[rows.LAST_TICK * LANES + lane]
    memory[rows.ALIVE * LANES + lane] = 1.0 if alive else (0.0 if running else memory[rows.ALIVE * LANES + lane])
    counts = alive & running
    memory[rows.COUNTS * LANES + lane] = 1.0 if counts else 0.0
    e = (p[0] - ref.p_W[0], p[1] - ref.p_W[1], p[2] - ref.p_W[2])
    e_v = (v[0] - ref.v_W[0], v[1] - ref.v_W[1], v[2] - ref.v_W[2])
    square = dot(e, e)
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
    add(memory, rows.PAPER_COST, lane, square, counts)
    add(memory, rows.RELEASED_COST, lane, square + dot(e_v, e_v), counts)


def judge_yaw(memory: FloatArray, lane: int) -> None:
    """Add this tick's error of the yaw, after `judge_position`."""
    x, y, z, w = load4(memory, rows.MOTION + 6, lane)
    ref = reference(memory, lane)
    counts = memory[rows.COUNTS * LANES + lane] > 0.0
    ahead, left = 1.0 - 2.0 * (y * y + z * z), 2.0 * (w * z + x * y)
    cosine, sine = ref.heading[0] * ahead + ref.heading[1] * left, ref.heading[0] * left - ref.heading[1] * ahead
    wrapped = arctan2(sine, cosine)
    yaw = ref.yaw_rad + wrapped
    e_yaw = wrapped - 2.0 * math.pi * np.floor(yaw / (2.0 * math.pi) + 0.5)
    size = math.sqrt(cosine * cosine + sine * sine)
    share = cosine / size if size > 0.0 else 1.0
    add(memory, rows.YAW_COST, lane, 2.0 - 2.0 * share, counts)
    add(memory, rows.PAPER_COST, lane, wrapped * wrapped, counts)
    add(memory, rows.RELEASED_COST, lane, e_yaw * e_yaw, counts)


def count_clips(memory: FloatArray, lane: int) -> None:
    """Add this tick's clipped motor commands to the saturation labels, after `judge_position`."""
    clips = memory[rows.CLIPS * LANES + lane]
    counts = memory[rows.COUNTS * LANES + lane] > 0.0
    add(memory, rows.CLIPPED, lane, clips, counts)
    run = memory[rows.RUN * LANES + lane] + 1.0 if clips > 0.0 else 0.0
    memory[rows.RUN * LANES + lane] = run
    longest = memory[rows.LONGEST_RUN * LANES + lane]
    memory[rows.LONGEST_RUN * LANES + lane] = max(longest, run) if counts else longest


def add(memory: FloatArray, row: int, lane: int, value: float, counts: bool) -> None:
    """Add to a label where the tick counts."""
    memory[row * LANES + lane] += value if counts else 0.0
