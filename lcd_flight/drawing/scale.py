"""From values to places on a plot: axes, their ticks, and traces with no more points than can be seen."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from lcd_flight.model.types import FloatArray, IntArray

MINUS = "\N{MINUS SIGN}"
_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)


@dataclass(frozen=True, slots=True)
class Axis:
    """A range of values, linear or by powers of ten."""

    low: float
    high: float
    log: bool = False

    def place(self, values: FloatArray) -> FloatArray:
        """Shares of the axis: 0 at `low`, 1 at `high`; outside of it, its ends."""
        if self.log:
            with np.errstate(divide="ignore"):
                values = np.log10(values)
            low, high = math.log10(self.low), math.log10(self.high)
        else:
            low, high = self.low, self.high
        return np.asarray(np.clip((values - low) / (high - low), 0.0, 1.0))

    def ticks(self, count: int) -> list[float]:
        """About `count` round values within the range; on a logarithmic axis the powers of ten."""
        if self.log:
            first, last = math.ceil(math.log10(self.low) - 1e-9), math.floor(math.log10(self.high) + 1e-9)
            return [10.0**power for power in range(first, last + 1)]
        step = _round_step((self.high - self.low) / count)
        first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
        return [number * step for number in range(first, last + 1)]


def axis_around(*columns: FloatArray, least: float) -> Axis:
    """An axis that holds all finite values with a margin, and spans at least `least`."""
    values = np.concatenate([np.ravel(column) for column in columns])
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)
    middle, half = (low + high) / 2.0, max(high - low, least) * 0.54
    return Axis(middle - half, middle + half)


def label(value: float) -> str:
    """A tick's value as short as it can be said."""
    return f"{value:.6g}".replace("-", MINUS) if abs(value) > 1e-12 else "0"


def runs(values: FloatArray) -> list[slice]:
    """The stretches of finite values."""
    known = np.concatenate(([False], np.isfinite(values), [False]))
    edges = np.flatnonzero(known[1:] != known[:-1])
    return [slice(int(begin), int(end)) for begin, end in zip(edges[::2], edges[1::2], strict=True)]


def visible(values: FloatArray, most: int) -> IntArray:
    """Indices of the points that a plot needs: the least and the greatest of each of `most` / 2 equal stretches.

    The ends are always among them, so that no peak and no end is lost.
    """
    count = len(values)
    if count <= most:
        return np.arange(count)
    edges = np.linspace(0, count, most // 2 + 1).astype(int)
    low = [begin + int(np.argmin(values[begin:end])) for begin, end in pairwise(edges.tolist())]
    high = [begin + int(np.argmax(values[begin:end])) for begin, end in pairwise(edges.tolist())]
    return np.unique([0, count - 1, *low, *high])


def _round_step(rough: float) -> float:
    """The nearest larger of 1, 2, 2.5 and 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(rough))
    return next(step * power for step in _STEPS if step * power >= rough * (1.0 - 1e-9))
