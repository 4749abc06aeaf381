"""Many small minimisations side by side, each keeping its best iterate: Adam with a cosine decay."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from lcd_flight.model import BoolArray, FloatArray, IntArray

Objective: TypeAlias = Callable[[FloatArray], tuple[FloatArray, FloatArray, BoolArray]]
"""From variables (N, V) to values (N,), gradients (N, V) and where the value can be trusted (N,); row by row."""

_DECAY_MEAN, _DECAY_SQUARE, _ROOT_FLOOR = 0.9, 0.999, 1e-8
"""Adam's constants (Kingma and Ba 2015, algorithm 1)."""


@dataclass(frozen=True, slots=True, eq=False)
class Descent:
    """Where N descents got to."""

    best: FloatArray
    """(N, V) the iterate of least value among those whose value can be trusted; the start where there is none."""
    trusted: BoolArray
    """(N,) whether that one can be."""
    best_iteration: IntArray
    """(N,) which iterate that was; 0 is the start."""
    failed: BoolArray
    """(N,) a value or a gradient was not finite; the row stopped there."""
    mistrusted: BoolArray
    """(N,) an iterate of a lower value was passed over, since it could not be trusted."""
    last: FloatArray
    """(N, V) the last iterate."""


def descend(
    objective: Objective, start: FloatArray, iterations: int, step: float, *, safe_start: bool = True
) -> Descent:
    """Walk `iterations` steps downhill from `start` (N, V); `step` is the size of the first ones, in each variable.

    safe_start: whether the start can be trusted whatever the objective says of it.
    """
    x, best = start.copy(), start.copy()
    mean, square = np.zeros_like(x), np.zeros_like(x)
    best_value = np.full(len(x), np.inf)
    best_iteration = np.zeros(len(x), dtype=np.int64)
    sure = np.full(len(x), safe_start)
    failed, mistrusted = np.zeros(len(x), dtype=bool), np.zeros(len(x), dtype=bool)
    for k in range(iterations + 1):
        value, grad, trusted = objective(x)
        failed |= ~(np.isfinite(value) & np.isfinite(grad).all(axis=1))
        lower = ~failed & (value < best_value)
        better = lower & (trusted | (safe_start and k == 0))
        sure |= better
        mistrusted |= lower & ~better
        best[better], best_value[better], best_iteration[better] = x[better], value[better], k
        grad[failed] = 0.0
        mean += (1.0 - _DECAY_MEAN) * (grad - mean)
        square += (1.0 - _DECAY_SQUARE) * (grad * grad - square)
        direction = mean / (1.0 - _DECAY_MEAN ** (k + 1))
        size = np.sqrt(square / (1.0 - _DECAY_SQUARE ** (k + 1))) + _ROOT_FLOOR
        x -= 0.5 * step * (1.0 + math.cos(math.pi * k / iterations)) * direction / size  # the last one is 0
    return Descent(best, sure, best_iteration, failed, mistrusted, last=x)
