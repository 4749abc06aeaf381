"""Many small minimisations side by side, each keeping its best iterate: Adam with a cosine decay."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from lcd_flight.model import BoolArray, FloatArray, IntArray

Objective: TypeAlias = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""From variables (N, V) to values (N,) and gradients (N, V), each row's from that row alone."""

_DECAY_MEAN, _DECAY_SQUARE, _ROOT_FLOOR = 0.9, 0.999, 1e-8
"""Adam's constants (Kingma and Ba 2015, algorithm 1)."""


@dataclass(frozen=True, slots=True, eq=False)
class Descent:
    """Where N descents got to."""

    best: FloatArray
    """(N, V) the variables of least value among the iterates."""
    best_iteration: IntArray
    """(N,) which iterate that was; 0 is the start."""
    failed: BoolArray
    """(N,) a value or a gradient was not finite; the row stopped there."""


def descend(objective: Objective, start: FloatArray, iterations: int, step: float) -> Descent:
    """Walk `iterations` steps downhill from `start` (N, V); `step` is the size of the first ones, in each variable."""
    x, best = start.copy(), start.copy()
    mean, square = np.zeros_like(x), np.zeros_like(x)
    best_value = np.full(len(x), np.inf)
    best_iteration, failed = np.zeros(len(x), dtype=np.int64), np.zeros(len(x), dtype=bool)
    for k in range(iterations + 1):
        value, grad = objective(x)
        failed |= ~(np.isfinite(value) & np.isfinite(grad).all(axis=1))
        better = ~failed & (value < best_value)
        best[better], best_value[better], best_iteration[better] = x[better], value[better], k
        grad[failed] = 0.0
        mean += (1.0 - _DECAY_MEAN) * (grad - mean)
        square += (1.0 - _DECAY_SQUARE) * (grad * grad - square)
        unbiased_mean, unbiased_square = (
            mean / (1.0 - _DECAY_MEAN ** (k + 1)),
            square / (1.0 - _DECAY_SQUARE ** (k + 1)),
        )
        rate = 0.5 * step * (1.0 + math.cos(math.pi * k / iterations))
        x -= rate * unbiased_mean / (np.sqrt(unbiased_square) + _ROOT_FLOOR)
    return Descent(best, best_iteration, failed)
