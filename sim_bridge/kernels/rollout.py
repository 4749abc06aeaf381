"""The kernel of batched rollouts: blocks of LANES vehicles, each flown to its plan's end."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lcd_flight.model import FloatArray, IntArray, SeedArray
from sim_bridge.kernels import rows
from sim_bridge.kernels.block import Craft, command_tick, fly_tick, judge_tick
from sim_bridge.kernels.lane import TICK_S, remember, turn_rotors
from sim_bridge.kernels.noise import key_of
from sim_bridge.kernels.onboard import DEGREES
from sim_bridge.kernels.rows import LABELS, LANES, ROWS


class Plans(NamedTuple):
    """What is flown, row by row."""

    order: IntArray
    """(N,) the rows, those of like length side by side."""
    durations_s: FloatArray
    """(N, S)"""
    coefficients: FloatArray
    """(N, 4, S, 8)"""
    knots_s: FloatArray
    """(N, S + 1)"""
    end_ticks: IntArray
    """(N, S) first tick at or after each segment's end."""
    yaws_rad: FloatArray
    """(N,) initial heading."""
    gaps: FloatArray
    """(N, 2) first tick without pose, first tick with pose again."""
    has_gaps: bool
    """Whether any row has one."""
    seeds: SeedArray
    """(N,)"""


class Scratch(NamedTuple):
    """What a thread needs to fly a block; contents do not matter."""

    memory: FloatArray
    """(ROWS * LANES,) beginning on a cache line: a vector across two lines costs twice."""
    lanes: IntArray
    """(LANES,) the rows that are flown."""
    segments: IntArray
    """(LANES,) the segments that they are in."""
    keys: SeedArray
    """(LANES,) of their noise."""


class Results(NamedTuple):
    """What comes out, row by row."""

    labels: FloatArray
    """(N, LABELS) the rows of memory from ALIVE on."""
    segment_largest: FloatArray
    """(N, S) squared; NaN where never reached."""
    waypoint_errors: FloatArray
    """(N, S + 1) m; NaN where never reached."""
    trace: FloatArray
    """(ticks, ROWS * LANES) the whole memory at each tick, before its command; or nothing."""


def fly(first: int, last: int, plans: Plans, craft: Craft, results: Results, scratch: Scratch) -> None:
    """Fly blocks `first` to `last` - 1 of LANES rows each; the last one is filled up with copies of the last row."""
    memory, lanes, segments, keys = scratch
    for block in range(first, last):
        memory[:] = 0.0
        for lane in range(LANES):
            lanes[lane] = plans.order[min(block * LANES + lane, len(plans.order) - 1)]
            segments[lane] = 0
            keys[lane] = key_of(plans.seeds[lanes[lane]])
            start_lane(memory, lane, lanes[lane], plans, craft)
            results.waypoint_errors[lanes[lane], 0] = 0.0
        fly_block(memory, lanes, segments, keys, plans, craft, results)
        for lane in range(LANES):
            finish_lane(memory, lane, lanes[lane], segments[lane], results)


def start_lane(memory: FloatArray, lane: int, row: int, plans: Plans, craft: Craft) -> None:
    """At rest on the plan's start, with every rotor at one speed; the lane's memory is zero."""
    yaw = plans.yaws_rad[row]
    for axis in range(3):
        memory[(rows.MOTION + axis) * LANES + lane] = plans.coefficients[row, axis, 0, 0]
    memory[(rows.MOTION + 8) * LANES + lane] = np.sin(0.5 * yaw)
    memory[(rows.MOTION + 9) * LANES + lane] = np.cos(0.5 * yaw)
    memory[(rows.PID + 8) * LANES + lane] = DEGREES * np.arctan2(np.sin(yaw), np.cos(yaw))
    speed = craft.initial_speed
    turn_rotors(memory, lane, (speed, speed, speed, speed), craft.air)
    for r in range(13):
        memory[(rows.SEEN + r) * LANES + lane] = memory[(rows.MOTION + r) * LANES + lane]
    segments = plans.durations_s.shape[1]
    memory[rows.DURATION * LANES + lane] = plans.knots_s[row, segments]
    memory[rows.LAST_TICK * LANES + lane] = plans.end_ticks[row, segments - 1]
    memory[rows.GAP_START * LANES + lane] = plans.gaps[row, 0]
    memory[rows.GAP_END * LANES + lane] = plans.gaps[row, 1]
    memory[rows.ALIVE * LANES + lane] = 1.0
    load_segment(memory, lane, row, 0, plans)


def load_segment(memory: FloatArray, lane: int, row: int, segment: int, plans: Plans) -> None:
    """Bring a segment's polynomials into the lane."""
    memory[rows.SEGMENT_START * LANES + lane] = plans.knots_s[row, segment]
    memory[rows.END_TICK * LANES + lane] = plans.end_ticks[row, segment]
    memory[rows.SEGMENT_LARGEST * LANES + lane] = -1.0
    for axis in range(4):
        for k in range(8):
            at = (rows.COEFFICIENTS + 8 * axis + k) * LANES + lane
            memory[at] = plans.coefficients[row, axis, segment, k]


def fly_block(
    memory: FloatArray,
    lanes: IntArray,
    segments: IntArray,
    keys: SeedArray,
    plans: Plans,
    craft: Craft,
    results: Results,
) -> None:
    """Tick after tick: fly under the last command, sample the reference, judge, command."""
    knot = next_knot(memory)
    tick = 0
    while any_runs(memory, tick):
        if tick >= knot:
            for lane in range(LANES):
                remember(memory, lane)
        if tick > 0:
            fly_tick(memory, keys, tick, craft)
        if tick >= knot:
            pass_knots(memory, lanes, segments, tick, plans, results)
            knot = next_knot(memory)
        judge_tick(memory, tick)
        if tick < len(results.trace):
            for number in range(ROWS * LANES):
                results.trace[tick, number] = memory[number]
        command_tick(memory, tick, craft, plans.has_gaps)
        tick += 1


def any_runs(memory: FloatArray, tick: int) -> bool:
    """Whether any lane still has something to fly."""
    runs = False
    for lane in range(LANES):
        runs |= (memory[rows.ALIVE * LANES + lane] > 0.0) & (tick <= memory[rows.LAST_TICK * LANES + lane])
    return runs


def next_knot(memory: FloatArray) -> float:
    """The first tick at which any lane reaches the end of its segment."""
    first = np.inf
    for lane in range(LANES):
        first = min(first, memory[rows.END_TICK * LANES + lane])
    return first


def pass_knots(
    memory: FloatArray, lanes: IntArray, segments: IntArray, tick: int, plans: Plans, results: Results
) -> None:
    """Take the lanes that reached the end of their segment into their next one."""
    for lane in range(LANES):
        while tick >= memory[rows.END_TICK * LANES + lane]:
            if memory[rows.ALIVE * LANES + lane] > 0.0:
                pass_knot(memory, lane, lanes[lane], segments[lane], tick, plans, results)
                segments[lane] += 1
            else:
                memory[rows.END_TICK * LANES + lane] = np.inf


def pass_knot(memory: FloatArray, lane: int, row: int, segment: int, tick: int, plans: Plans, results: Results) -> None:
    """Note the error at the segment's end, between the last tick and this one; load the next segment."""
    share = plans.knots_s[row, segment + 1] / TICK_S - (tick - 1)
    total = 0.0
    for axis in range(3):
        target = 0.0
        for k in range(7, -1, -1):
            target = target * plans.durations_s[row, segment] + plans.coefficients[row, axis, segment, k]
        total += (between(memory, lane, axis, share) - target) ** 2
    results.waypoint_errors[row, segment + 1] = np.sqrt(total)
    memory[rows.END_TICK * LANES + lane] = np.inf
    if segment + 1 < plans.durations_s.shape[1]:
        largest = memory[rows.SEGMENT_LARGEST * LANES + lane]
        results.segment_largest[row, segment] = largest if largest >= 0.0 else np.nan
        load_segment(memory, lane, row, segment + 1, plans)


def between(memory: FloatArray, lane: int, axis: int, share: float) -> float:
    """A coordinate between the last tick (share 0) and this one (share 1): the cubic through both states."""
    p0 = memory[(rows.BEFORE + axis) * LANES + lane]
    v0 = memory[(rows.BEFORE + 3 + axis) * LANES + lane] * TICK_S
    p1 = memory[(rows.MOTION + axis) * LANES + lane]
    v1 = memory[(rows.MOTION + 3 + axis) * LANES + lane] * TICK_S
    rest = 1.0 - share
    begun = p0 * (1.0 + 2.0 * share) + v0 * share
    ended = p1 * (1.0 + 2.0 * rest) - v1 * rest
    return float(rest * rest * begun + share * share * ended)


def finish_lane(memory: FloatArray, lane: int, row: int, segment: int, results: Results) -> None:
    """Hand the labels out; segments and waypoints that were never reached stay NaN."""
    segment = min(segment, results.segment_largest.shape[1] - 1)
    largest = memory[rows.SEGMENT_LARGEST * LANES + lane]
    results.segment_largest[row, segment] = largest if largest >= 0.0 else np.nan
    for k in range(LABELS):
        results.labels[row, k] = memory[(rows.ALIVE + k) * LANES + lane]
