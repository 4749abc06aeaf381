"""What there is to draw of one or several flights in three dimensions, in m."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from lcd_flight.model import FlightPlan, Trajectory
from lcd_flight.model.types import BoolArray, FloatArray
from lcd_flight.record import FlightLog
from lcd_flight.review.spans import airborne

COLORS = "abcdef"
"""CSS classes that tell flights apart; more flights begin again."""

_PATH_STEP_S = 0.04
_MOST_FLOWN_POINTS = 4000
_WIDEST_FENCE = 2.5
"""A fence that is so many times as wide as the path is not fitted into the drawing."""


@dataclass(frozen=True, slots=True, eq=False)
class Flown:
    """The path of one flight in the air."""

    points: FloatArray
    """(N, 3)"""
    time_s: FloatArray
    """(N,) as the page counts it."""
    style: str
    """CSS class: flown, or the flight's colour."""
    saturated: tuple[FloatArray, ...] = ()
    """Pieces of it that were flown with a motor or the thrust command at its limit."""


@dataclass(frozen=True, slots=True, eq=False)
class Space:
    """All shapes."""

    flown: tuple[Flown, ...]
    references: tuple[FloatArray, ...]
    baselines: tuple[FloatArray, ...]
    waypoints: FloatArray
    """(K, 3)"""
    low: FloatArray
    high: FloatArray
    """The fence where it is near, else a box around the paths."""
    fenced: bool
    """Whether the box is the fence."""

    @property
    def floor_m(self) -> float:
        """Height of the ground that shadows fall on."""
        return float(self.low[2])

    @property
    def paths(self) -> FloatArray:
        """(N, 3) every point of a path."""
        flown = [row.points for row in self.flown]
        return np.concatenate([*self.references, *flown, *self.baselines, self.waypoints])

    def on_floor(self, points: FloatArray) -> FloatArray:
        """The shadows of points (N, 3)."""
        return np.column_stack([points[:, :2], np.full(len(points), self.floor_m)])

    def edges(self) -> Iterator[FloatArray]:
        """The twelve edges of the box."""
        ends = np.stack([self.low, self.high])
        corners = np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
        for a in range(8):
            for axis in (1, 2, 4):
                if not a & axis:
                    yield corners[[a, a | axis]]

    def floor(self) -> Iterator[FloatArray]:
        """A grid of about ten lines each way, at round distances."""
        (x0, y0, _), (x1, y1, _), z = self.low, self.high, self.floor_m
        step = max(0.5, 2.0 ** math.ceil(math.log2(max(x1 - x0, y1 - y0) / 10.0)))
        for x in np.arange(math.ceil(x0 / step) * step, x1 + 1e-9, step):
            yield np.array([[x, y0, z], [x, y1, z]])
        for y in np.arange(math.ceil(y0 / step) * step, y1 + 1e-9, step):
            yield np.array([[x0, y, z], [x1, y, z]])

    def triad_corner(self) -> FloatArray:
        """Where the axes are shown: on the floor, in front of the path."""
        points = np.concatenate(self.references)
        (x0, y0, _), (x1, _, _) = points.min(axis=0), points.max(axis=0)
        return np.array([(x0 + x1) / 2.0, y0 - 0.3, self.floor_m])


def space_of(logs: Sequence[FlightLog], zeros_s: Sequence[float]) -> Space:
    """The flights with each's `zeros_s` at 0; plan and fence of the first, and other plans where they differ."""
    alone = len(logs) == 1
    flown = tuple(
        _flown(log, zero_s, "flown" if alone else COLORS[number % len(COLORS)])
        for number, (log, zero_s) in enumerate(zip(logs, zeros_s, strict=True))
    )
    plan, fence = logs[0].header.plan, logs[0].header.limits.geofence
    waypoints = [leg.waypoints[:, :3] for leg in plan.legs if leg.waypoints is not None]
    references = tuple(_distinct([_sampled(log.header.plan.joined()) for log in logs]))
    near = np.concatenate([*references, *(row.points for row in flown), *waypoints])
    low, high = near.min(axis=0), near.max(axis=0)
    fence_low, fence_high = np.array(fence.low_m), np.array(fence.high_m)
    fenced = bool(np.max(fence_high - fence_low) <= _WIDEST_FENCE * np.max(high - low))
    if fenced:
        low, high = fence_low, fence_high
    return Space(
        flown=flown,
        references=references,
        baselines=tuple(_sampled(trajectory) for trajectory in baselines(plan)) if alone else (),
        waypoints=np.concatenate(waypoints) if waypoints else np.empty((0, 3)),
        low=low,
        high=high,
        fenced=fenced,
    )


def baselines(plan: FlightPlan) -> list[Trajectory]:
    """The minimum-snap plans that were not flown; none where the plan is minimum snap itself."""
    return [
        leg.baseline
        for leg in plan.legs
        if leg.baseline is not None and not np.array_equal(leg.baseline.coefficients, leg.trajectory.coefficients)
    ]


def _flown(log: FlightLog, zero_s: float, style: str) -> Flown:
    series = log.series
    ticks = np.flatnonzero(airborne(series) & np.isfinite(series.p_WB).all(axis=1))
    drawn = np.arange(0, len(ticks), max(1, math.ceil(len(ticks) / _MOST_FLOWN_POINTS)))
    points = series.p_WB[ticks[drawn]]
    saturated = np.logical_or.reduceat(series.saturated[ticks], drawn) if len(drawn) else np.empty(0, dtype=np.bool_)
    return Flown(
        points=points,
        time_s=series.time_s[ticks[drawn]] - zero_s,
        style=style,
        saturated=tuple(_pieces(points, saturated)) if style == "flown" else (),
    )


def _pieces(points: FloatArray, flags: BoolArray) -> Iterator[FloatArray]:
    """The stretches of points (N, 3) with flags (N,), each to the point after it."""
    edges = np.flatnonzero(np.diff(flags, prepend=False, append=False)).tolist()
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        piece = points[begin : end + 1]
        yield piece if len(piece) > 1 else points[max(begin - 1, 0) : end]


def _sampled(trajectory: Trajectory) -> FloatArray:
    count = math.ceil(trajectory.duration_s / _PATH_STEP_S) + 1
    return trajectory.derivative(np.linspace(0.0, trajectory.duration_s, count), 0)[:, :3]


def _distinct(paths: Sequence[FloatArray]) -> list[FloatArray]:
    found: list[FloatArray] = []
    for path in paths:
        if not any(np.array_equal(path, other) for other in found):
            found.append(path)
    return found
