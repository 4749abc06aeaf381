"""Piecewise polynomials of x, y, z and yaw: one trajectory, and many side by side."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from lcd_flight.model.state import Reference
from lcd_flight.model.types import FloatArray, IntArray

COEFFICIENTS = 8
"""Order 7: eight coefficients a segment and axis (paper, problem 3)."""

_FACTORIAL_RATIOS = np.array(
    [[math.factorial(k) / math.factorial(k - d) if k >= d else 0.0 for k in range(COEFFICIENTS)] for d in range(5)]
)


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """A polynomial of order 7 for each segment and axis.

    durations_s: (S,), s, all > 0.
    coefficients: (4, S, 8), ascending powers of the segment's own time in s, which starts at 0; axes x, y, z in m
    and yaw in rad.
    """

    durations_s: FloatArray
    coefficients: FloatArray

    @property
    def segments(self) -> int:
        """How many segments there are."""
        return len(self.durations_s)

    @property
    def duration_s(self) -> float:
        """The whole duration in s."""
        return float(self.durations_s.sum())

    @property
    def knot_times_s(self) -> FloatArray:
        """(S + 1,) the instants at which segments begin and end."""
        return np.concatenate(([0.0], np.cumsum(self.durations_s)))

    def derivative(self, times_s: FloatArray, order: int) -> FloatArray:
        """The `order`-th derivative (0 to 4) of x, y, z, yaw at `times_s` (T,), clamped to the duration: (T, 4)."""
        knots = self.knot_times_s
        clamped = np.clip(times_s, 0.0, knots[-1])
        segment = np.clip(np.searchsorted(knots, clamped, side="right") - 1, 0, self.segments - 1)
        local = clamped - knots[segment]
        powers = np.arange(COEFFICIENTS) - order
        basis = _FACTORIAL_RATIOS[order] * local[:, None] ** np.maximum(powers, 0)
        return np.asarray(np.einsum("tk,atk->ta", basis, self.coefficients[:, segment, :]))

    def waypoints(self) -> FloatArray:
        """(S + 1, 4) x, y, z, yaw at the knots."""
        return self.derivative(self.knot_times_s, 0)

    def reference(self, time_s: float) -> Reference:
        """The reference at `time_s`; before the start and after the end, at rest at that end."""
        duration = self.duration_s
        inside = 0.0 <= time_s <= duration
        knots = self.knot_times_s
        clamped = min(max(time_s, 0.0), duration)
        segment = min(int(np.searchsorted(knots, clamped, side="right")) - 1, self.segments - 1)
        local = clamped - float(knots[segment])
        values = [_derivatives(self.coefficients[axis, segment], local) for axis in range(4)]
        x, y, z, yaw = values if inside else [(v[0], 0.0, 0.0, 0.0, 0.0) for v in values]
        return Reference(
            p_W=(x[0], y[0], z[0]),
            v_W=(x[1], y[1], z[1]),
            a_W=(x[2], y[2], z[2]),
            j_W=(x[3], y[3], z[3]),
            s_W=(x[4], y[4], z[4]),
            yaw_rad=yaw[0],
            yaw_rate=yaw[1],
            yaw_acceleration=yaw[2],
        )

    def then(self, *others: Trajectory) -> Trajectory:
        """This trajectory followed by `others`, each from its own local time zero."""
        parts = (self, *others)
        return Trajectory(
            np.concatenate([p.durations_s for p in parts]),
            np.concatenate([p.coefficients for p in parts], axis=1),
        )

    @staticmethod
    def hover(position_m: Sequence[float], yaw_rad: float, duration_s: float) -> Trajectory:
        """Stand still at a point for a while."""
        coefficients = np.zeros((4, 1, COEFFICIENTS))
        coefficients[:, 0, 0] = (*position_m, yaw_rad)
        return Trajectory(np.array([float(duration_s)]), coefficients)


def _derivatives(coefficients: FloatArray, time_s: float) -> tuple[float, float, float, float, float]:
    """Value and the first four derivatives of one polynomial: repeated Horner division, exact to rounding."""
    d0 = d1 = d2 = d3 = d4 = 0.0
    for c in reversed(coefficients.tolist()):
        d4 = d4 * time_s + d3
        d3 = d3 * time_s + d2
        d2 = d2 * time_s + d1
        d1 = d1 * time_s + d0
        d0 = d0 * time_s + c
    return d0, d1, 2.0 * d2, 6.0 * d3, 24.0 * d4


@dataclass(frozen=True, slots=True, eq=False)
class Trajectories:
    """N trajectories of the same number of segments, as whole arrays.

    durations_s: (N, S); coefficients: (N, 4, S, 8), laid out as in `Trajectory`.
    """

    durations_s: FloatArray
    coefficients: FloatArray

    @property
    def segments(self) -> int:
        """How many segments each of them has."""
        return int(self.durations_s.shape[1])

    def __len__(self) -> int:
        """How many trajectories there are."""
        return int(self.durations_s.shape[0])

    def __getitem__(self, index: int) -> Trajectory:
        """One of them (a view)."""
        return Trajectory(self.durations_s[index], self.coefficients[index])

    def __iter__(self) -> Iterator[Trajectory]:
        """Each of them in turn (views)."""
        return (self[i] for i in range(len(self)))

    def take(self, indices: IntArray | Sequence[int]) -> Trajectories:
        """The chosen ones, repeated where an index is (a copy)."""
        chosen = np.asarray(indices)
        return Trajectories(self.durations_s[chosen], self.coefficients[chosen])

    @staticmethod
    def stack(trajectories: Sequence[Trajectory]) -> Trajectories:
        """Put trajectories of one segment count side by side."""
        return Trajectories(
            np.stack([t.durations_s for t in trajectories]),
            np.stack([t.coefficients for t in trajectories]),
        )
