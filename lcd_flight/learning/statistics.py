"""What a crash rate is worth: standard errors, intervals and paired tests, all with the task as the unit.

The flights of one plan crash together, so they are not independent: only tasks are. Everything here is exact or a
closed form, without random numbers, so that the same results always give the same statement.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lcd_flight.model import BoolArray, FloatArray, IntArray

NORMAL_95 = 1.959963984540054
"""Two-sided 95 % of the normal distribution."""
_LEAST_P_VALUE = 1e-12


@dataclass(frozen=True, slots=True)
class Rate:
    """A share of flights in per cent, and how well it is known."""

    per_cent: float
    standard_error: float | None
    """Clustered by task; None: one task alone."""
    low: float
    high: float
    """Wilson's 95 % interval at the effective number of independent flights."""


@dataclass(frozen=True, slots=True)
class PairedDifference:
    """Method A minus method B on the same tasks and the same noise, in per cent of flights."""

    difference: float
    """Below 0: A crashes less."""
    standard_error: float | None
    low: float
    high: float
    """95 % by the normal approximation; both equal to `difference` for one task alone."""
    p_value: float
    """Exact, two-sided: how often signs dealt out to the tasks by coin would differ so much."""
    tasks_better: int
    """Tasks on which A crashed less often."""
    tasks_worse: int


def crash_rate(crashed: BoolArray) -> Rate:
    """The rate of crashes (N tasks, flights of each), clustered by task."""
    share, error = _mean_and_error(crashed.mean(axis=1))
    low, high = wilson_interval(share, effective_flights(crashed))
    return Rate(100.0 * share, None if error is None else 100.0 * error, 100.0 * low, 100.0 * high)


def effective_flights(crashed: BoolArray) -> float:
    """How many independent flights the flights (N tasks, R of each) are worth: between N and N R.

    The variance of one flight over the square of the clustered standard error (Kish's design effect); N where no
    flight, or every one, crashed: what shows no spread says nothing about it.
    """
    tasks, flights = crashed.shape
    share, error = _mean_and_error(crashed.mean(axis=1))
    if not error:
        return float(tasks)
    return float(np.clip(share * (1.0 - share) / error**2, tasks, tasks * flights))


def wilson_interval(share: float, count: float) -> tuple[float, float]:
    """95 % for a share seen in `count` independent trials (Wilson 1927): sound at 0 and 1 too."""
    z2 = NORMAL_95**2
    middle = (share + z2 / (2.0 * count)) / (1.0 + z2 / count)
    half = NORMAL_95 / (1.0 + z2 / count) * math.sqrt(share * (1.0 - share) / count + z2 / (4.0 * count**2))
    return max(0.0, min(middle - half, share)), min(1.0, max(middle + half, share))


def paired_difference(crashed_a: BoolArray, crashed_b: BoolArray) -> PairedDifference:
    """Compare two methods flown on the same tasks with the same noise, both (N tasks, flights of each).

    Raises:
        ValueError: the shapes differ, so the flights cannot be paired.
    """
    if crashed_a.shape != crashed_b.shape:
        raise ValueError(f"flights {crashed_a.shape} and {crashed_b.shape} cannot be paired")
    counts = crashed_a.sum(axis=1).astype(np.int64) - crashed_b.sum(axis=1).astype(np.int64)
    difference, error = _mean_and_error(100.0 * counts / crashed_a.shape[1])
    reach = 0.0 if error is None else NORMAL_95 * error
    return PairedDifference(
        difference=difference,
        standard_error=error,
        low=difference - reach,
        high=difference + reach,
        p_value=sign_flip_p_value(counts),
        tasks_better=int((counts < 0).sum()),
        tasks_worse=int((counts > 0).sum()),
    )


def sign_flip_p_value(differences: IntArray) -> float:
    """Exact two-sided p-value of the sum of whole-number differences (N,), their signs dealt out by coin.

    With one flight for each task this is McNemar's exact test. The distribution of the sum comes from its
    characteristic function, the product of cos(t size) over the differences; never below 1e-12, where rounding begins.
    """
    sizes, counts = np.unique(np.abs(differences[differences != 0]), return_counts=True)
    reach = int((sizes * counts).sum())
    turns = np.outer(np.arange(2 * reach + 1) / (2 * reach + 1), sizes)
    characteristic = np.prod(np.cos(2.0 * np.pi * turns) ** counts, axis=1)
    distribution = np.fft.fft(characteristic).real / (2 * reach + 1)
    sums = np.minimum(np.arange(2 * reach + 1), 2 * reach + 1 - np.arange(2 * reach + 1))
    return float(np.clip(distribution[sums >= abs(int(differences.sum()))].sum(), _LEAST_P_VALUE, 1.0))


def _mean_and_error(by_task: FloatArray) -> tuple[float, float | None]:
    """Mean over tasks (N,) and its standard error; None for one task."""
    count = len(by_task)
    return float(by_task.mean()), float(by_task.std(ddof=1) / math.sqrt(count)) if count > 1 else None
