"""What disturbs a rehearsal: seeds of the motor noise, gaps in the poses."""

from __future__ import annotations

import numpy as np

from lcd_flight.model import FlightPlan, FloatArray, LegKind, SeedArray
from lcd_flight.model.streams import Stream

TICKS_PER_S = 100
"""The control loop's rate, in whose ticks the simulator counts gaps."""
LONGEST_GAP_TICKS = 4
"""Up to here the flight coasts (`SafetyLimits.pose_coast_s`); from five frames on it brakes, which no plan foresees."""


def noise_seeds(seed: int, first: int, count: int) -> SeedArray:
    """(count,) one seed for each run from run `first` on; run n's depends on (seed, n) alone."""
    return Stream(seed, "rehearsal/noise").seeds(np.arange(first, first + count))


def pose_gaps(plan: FlightPlan, seed: int, first: int, count: int) -> FloatArray:
    """(count, 2) first tick and length of one gap in the poses of each run; run n's depends on (seed, n) alone.

    The gap falls uniformly into the time spent on trajectories (on the whole flight where there are none), since
    standing still bears it easily; its length is uniform over 1 to `LONGEST_GAP_TICKS`.
    """
    uniform = Stream(seed, "rehearsal/pose-gap").uniforms(np.arange(first, first + count), 2)
    starts = np.floor(_times_s(plan, uniform[:, 0]) * TICKS_PER_S)
    lengths = 1.0 + np.floor(uniform[:, 1] * LONGEST_GAP_TICKS)
    return np.column_stack([starts, lengths])


def _times_s(plan: FlightPlan, shares: FloatArray) -> FloatArray:
    """Instants of the joined flight at `shares` (0 to 1) of the time spent on trajectories."""
    durations = np.array([leg.duration_s for leg in plan.legs])
    counted = np.array([leg.kind is LegKind.TRAJECTORY for leg in plan.legs])
    if not counted.any():
        counted[:] = True
    spent = np.concatenate(([0.0], np.cumsum(np.where(counted, durations, 0.0))))
    ends = np.concatenate(([0.0], np.cumsum(durations)))
    wanted = shares * spent[-1]
    leg = np.searchsorted(spent, wanted, side="right") - 1
    return np.asarray(ends[leg] + wanted - spent[leg])
