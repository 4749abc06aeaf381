"""Batched closed-loop rollouts: the simulator port, as `lcd_flight.simulators` names it."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from lcd_flight.model import (
    FloatArray,
    InputError,
    RolloutLabels,
    RolloutOptions,
    SeedArray,
    Trajectories,
    Trajectory,
    Vehicle,
)
from lcd_flight.model.rollout import FlownPath
from sim_bridge.compiled import rollout_kernel
from sim_bridge.craft import craft_of
from sim_bridge.kernels import rows
from sim_bridge.kernels.lane import TICK_S
from sim_bridge.kernels.rollout import Plans, Results, Scratch
from sim_bridge.kernels.rows import LABELS, LANES

_MOST_BLOCKS_AT_A_TIME = 4
"""Handed to a thread in one call: few, to share them evenly and to be interrupted soon."""


class MultirotorSimulator:
    """RotorPy's multirotor model under the geometric law, compiled, many vehicles side by side."""

    def rollout(
        self, plans: Trajectories, vehicle: Vehicle, seeds: SeedArray, options: RolloutOptions
    ) -> RolloutLabels:
        """Fly every plan once; a row's labels depend on that row alone.

        plans: N. seeds: (N,) of the motor noise.

        Raises:
            InputError: a plan that is not finite, a controller or loop that this simulator does not know.
        """
        return labels_of(fly(plans, vehicle, seeds, options))

    def path(self, plan: Trajectory, vehicle: Vehicle, seed: int, options: RolloutOptions) -> FlownPath:
        """Fly one plan as `rollout` would and tell where it went.

        Raises:
            InputError: as `rollout`.
        """
        from sim_bridge.trace import trace

        flown = trace(plan, vehicle, seed, options)
        x, y, z, w = flown.q_WB.T
        yaw = np.unwrap(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))
        turns = np.round((plan.coefficients[3, 0, 0] - yaw[0]) / (2.0 * np.pi))
        return FlownPath(flown.times_s, flown.p_WB, yaw + 2.0 * np.pi * turns)


def fly(plans: Trajectories, vehicle: Vehicle, seeds: SeedArray, options: RolloutOptions, ticks: int = 0) -> Results:
    """Run the kernel over all rows; record its memory of the first `ticks` ticks (of one block: at most LANES rows)."""
    prepared = _prepare(plans, seeds, options)
    craft = craft_of(vehicle, options.nominal or vehicle, options.loop, options.controller)
    count, segments = plans.durations_s.shape
    results = Results(
        labels=np.empty((count, LABELS)),
        segment_largest=np.full((count, segments), np.nan),
        waypoint_errors=np.full((count, segments + 1), np.nan),
        trace=np.empty((ticks, rows.ROWS * LANES)),
    )
    _over_blocks(-(-count // LANES), options.threads or os.cpu_count() or 1, (prepared, craft, results))
    return results


def _over_blocks(blocks: int, threads: int, arguments: tuple[Any, ...]) -> None:
    """Share the blocks among threads; the kernel holds no lock."""
    kernel = rollout_kernel()
    size = max(1, min(_MOST_BLOCKS_AT_A_TIME, blocks // threads))
    parts = [(start, min(start + size, blocks)) for start in range(0, blocks, size)]
    if threads == 1 or len(parts) <= 1:
        for part in parts:
            kernel(*part, *arguments, _scratch())
        return
    with ThreadPoolExecutor(threads) as pool:
        work = [pool.submit(kernel, *(*part, *arguments, _scratch())) for part in parts]
        try:
            for done in work:
                done.result()
        except BaseException:  # above all KeyboardInterrupt: what has not begun is not flown any more
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def _scratch() -> Scratch:
    """Memory for one call of the kernel."""
    size = rows.ROWS * LANES
    memory = np.empty(size + 8)
    first = -memory.ctypes.data // memory.itemsize % 8
    return Scratch(
        memory[first : first + size],
        np.empty(LANES, dtype=np.int64),
        np.empty(LANES, dtype=np.int64),
        np.empty(LANES, dtype=np.uint64),
    )


def _prepare(plans: Trajectories, seeds: SeedArray, options: RolloutOptions) -> Plans:
    """The kernel's view of a batch."""
    durations = np.ascontiguousarray(plans.durations_s, dtype=np.float64)
    coefficients = np.ascontiguousarray(plans.coefficients, dtype=np.float64)
    _check(durations, coefficients, seeds)
    knots = np.concatenate([np.zeros((len(durations), 1)), np.cumsum(durations, axis=1)], axis=1)
    end_ticks = np.ceil(knots[:, 1:] / TICK_S - 1e-9).astype(np.int64)
    yaws = coefficients[:, 3, 0, 0] if options.start_aligned else np.zeros(len(durations))
    gaps = np.zeros((len(durations), 2))
    if options.pose_gap_ticks is not None:
        gaps[:] = options.pose_gap_ticks
        gaps[:, 1] += gaps[:, 0]
    return Plans(
        order=np.argsort(end_ticks[:, -1], kind="stable"),
        durations_s=durations,
        coefficients=coefficients,
        knots_s=knots,
        end_ticks=end_ticks,
        yaws_rad=np.ascontiguousarray(yaws),
        gaps=gaps,
        has_gaps=bool((gaps[:, 1] > gaps[:, 0]).any()),
        seeds=np.ascontiguousarray(seeds, dtype=np.uint64),
    )


def _check(durations: FloatArray, coefficients: FloatArray, seeds: SeedArray) -> None:
    """Refuse what cannot be flown."""
    if len(seeds) != len(durations):
        raise InputError(f"{len(durations)} plans need as many seeds, got {len(seeds)}")
    if not (np.isfinite(coefficients).all() and np.isfinite(durations).all() and (durations > 0.0).all()):
        raise InputError("a plan has durations that are not positive or coefficients that are not finite")


def labels_of(results: Results) -> RolloutLabels:
    """The port's labels from the kernel's sums."""
    sums = dict(zip(_LABEL_ROWS, results.labels.T, strict=True))
    samples = np.maximum(sums[rows.SAMPLES], 1.0)
    commands = 4.0 * np.maximum(samples - 1.0, 1.0)
    return RolloutLabels(
        max_error_m=np.sqrt(sums[rows.LARGEST]),
        max_error_time_s=sums[rows.LARGEST_TICK] * TICK_S,
        mean_error_m=sums[rows.SUM] / samples,
        rms_error_m=np.sqrt(sums[rows.SUM_2] / samples),
        p8_error_m=(sums[rows.SUM_8] / samples) ** 0.125,
        segment_max_error_m=np.sqrt(results.segment_largest),
        waypoint_error_m=results.waypoint_errors,
        yaw_cost=sums[rows.YAW_COST] / samples,
        paper_cost=sums[rows.PAPER_COST],
        released_cost=sums[rows.RELEASED_COST],
        saturation_share=sums[rows.CLIPPED] / commands,
        longest_saturation_s=sums[rows.LONGEST_RUN] * TICK_S,
        valid=sums[rows.ALIVE] > 0.0,
    )


_LABEL_ROWS = range(rows.ALIVE, rows.ALIVE + LABELS)
