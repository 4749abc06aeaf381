"""The flight's path in three dimensions as SVG, seen from one side; the page's script turns the same shapes.

Every shape carries its points in the world (`data-xyz`, mm) and the drawing its view, so that the still picture and the
script have one projection: orthographic, turned about z by the azimuth, then tipped by the elevation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lcd_flight.drawing.html import Html, tag
from lcd_flight.model import FlightPlan, Trajectory
from lcd_flight.model.types import FloatArray
from lcd_flight.record import FlightLog
from lcd_flight.review.spans import airborne

WIDTH, HEIGHT = 1000, 640

_AZIMUTH_RAD = math.radians(-32.0)
_ELEVATION_RAD = math.radians(26.0)
_FILLED = 0.86
"""Share of the drawing that the shapes take."""

_PATH_STEP_S = 0.04
_MOST_FLOWN_POINTS = 1000
_WIDEST_FENCE = 2.5
"""A fence that is so many times as wide as the path is not fitted into the drawing."""


@dataclass(frozen=True, slots=True)
class View:
    """From where the world is looked at."""

    center_m: tuple[float, float, float]
    scale: float
    """Units of the drawing per m."""

    def project(self, points_m: FloatArray) -> FloatArray:
        """(N, 2) places in the drawing, y down, of (N, 3) points in the world."""
        x, y, z = (points_m - np.array(self.center_m)).T
        right = x * math.cos(_AZIMUTH_RAD) - y * math.sin(_AZIMUTH_RAD)
        away = x * math.sin(_AZIMUTH_RAD) + y * math.cos(_AZIMUTH_RAD)
        up = z * math.cos(_ELEVATION_RAD) + away * math.sin(_ELEVATION_RAD)
        return np.stack([WIDTH / 2 + self.scale * right, HEIGHT / 2 - self.scale * up], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class _Space:
    """What there is to draw, in m."""

    flown: FloatArray
    flown_time_s: FloatArray
    reference: FloatArray
    baselines: tuple[FloatArray, ...]
    waypoints: FloatArray
    low: FloatArray
    high: FloatArray
    """The fence where it is near, else a box around the path."""
    floor_m: float


def path_drawing(log: FlightLog) -> Html:
    """The whole drawing."""
    space = _space(log)
    view = _view(space)
    return tag(
        "svg",
        *_shapes(space, view),
        viewBox=f"0 0 {WIDTH} {HEIGHT}",
        width=WIDTH,
        height=HEIGHT,
        class_="space",
        role="img",
        aria_label="The path in three dimensions",
        data_center=",".join(f"{1e3 * value:.0f}" for value in view.center_m),
        data_scale=f"{view.scale / 1e3:.6g}",
        data_azimuth=f"{_AZIMUTH_RAD:.6g}",
        data_elevation=f"{_ELEVATION_RAD:.6g}",
    )


def baselines(plan: FlightPlan) -> list[Trajectory]:
    """The minimum-snap plans that were not flown; none where the plan is minimum snap itself."""
    return [
        leg.baseline
        for leg in plan.legs
        if leg.baseline is not None and not np.array_equal(leg.baseline.coefficients, leg.trajectory.coefficients)
    ]


def _space(log: FlightLog) -> _Space:
    plan, fence, series = log.header.plan, log.header.limits.geofence, log.series
    ticks = np.flatnonzero(airborne(series) & np.isfinite(series.p_WB).all(axis=1))
    ticks = ticks[:: max(1, math.ceil(len(ticks) / _MOST_FLOWN_POINTS))]
    reference = _sampled(plan.joined())
    waypoints = [leg.waypoints[:, :3] for leg in plan.legs if leg.waypoints is not None]
    near = np.concatenate([reference, series.p_WB[ticks], *waypoints])
    low, high = near.min(axis=0), near.max(axis=0)
    fence_low, fence_high = np.array(fence.low_m), np.array(fence.high_m)
    if np.max(fence_high - fence_low) <= _WIDEST_FENCE * np.max(high - low):
        low, high = fence_low, fence_high
    return _Space(
        flown=series.p_WB[ticks],
        flown_time_s=series.time_s[ticks],
        reference=reference,
        baselines=tuple(_sampled(trajectory) for trajectory in baselines(plan)),
        waypoints=np.concatenate(waypoints) if waypoints else np.empty((0, 3)),
        low=low,
        high=high,
        floor_m=float(low[2]),
    )


def _view(space: _Space) -> View:
    """The path and the floor below it, as large as they fit; the fence may run out of the drawing."""
    path = np.concatenate([space.reference, space.flown, *space.baselines, space.waypoints])
    seen = np.concatenate([path, _on_floor(path, space), _triad_corner(space)[None]])
    center = (seen.min(axis=0) + seen.max(axis=0)) / 2.0
    unit = View((float(center[0]), float(center[1]), float(center[2])), 1.0)
    reach = np.abs(unit.project(seen) - (WIDTH / 2, HEIGHT / 2)).max(axis=0)
    return View(unit.center_m, _FILLED * float(np.min(np.array([WIDTH / 2, HEIGHT / 2]) / np.maximum(reach, 1e-6))))


def _shapes(space: _Space, view: View) -> Iterator[Html]:
    """From the back to the front."""
    for line in _floor(space):
        yield _line(line, view, "floor")
    for edge in _edges(space):
        yield _line(edge, view, "fence")
    if len(space.flown):
        yield _line(_on_floor(space.flown, space), view, "shadow")
    for waypoint in space.waypoints:
        yield _line(_on_floor(np.stack([waypoint, waypoint]), space, last_only=True), view, "drop")
    for baseline in space.baselines:
        yield _line(baseline, view, "baseline")
    yield _line(space.reference, view, "reference")
    if len(space.flown):
        times = " ".join(f"{time:.2f}" for time in space.flown_time_s.tolist())
        yield _line(space.flown, view, "flown", times)
    for number, waypoint in enumerate(space.waypoints, start=1):
        yield _mark(waypoint, view, "waypoint", str(number))
    yield from _triad(space, view)
    if len(space.flown):
        yield _mark(space.flown[-1], view, "now", "")


def _line(points_m: FloatArray, view: View, style: str, times: str | None = None) -> Html:
    places = " ".join(f"{x:.1f},{y:.1f}" for x, y in view.project(points_m).tolist())
    return tag("polyline", points=places, data_xyz=_millimetres(points_m), data_t=times, class_=style)


def _mark(point_m: FloatArray, view: View, style: str, text: str) -> Html:
    ((x, y),) = view.project(point_m[None]).tolist()
    dot = tag("circle", r=5) if style in ("waypoint", "now") else None
    words = tag("text", text, x=9, y=-7) if text else None
    where = f"translate({x:.1f},{y:.1f})"
    return tag("g", dot, words, transform=where, data_xyz=_millimetres(point_m[None]), class_=style)


def _millimetres(points_m: FloatArray) -> str:
    return " ".join(f"{x:.0f},{y:.0f},{z:.0f}" for x, y, z in (1e3 * points_m).tolist())


def _sampled(trajectory: Trajectory) -> FloatArray:
    count = math.ceil(trajectory.duration_s / _PATH_STEP_S) + 1
    return trajectory.derivative(np.linspace(0.0, trajectory.duration_s, count), 0)[:, :3]


def _on_floor(points_m: FloatArray, space: _Space, *, last_only: bool = False) -> FloatArray:
    flat = points_m.copy()
    flat[-1 if last_only else slice(None), 2] = space.floor_m
    return flat


def _corners(space: _Space) -> FloatArray:
    """(8, 3) of the box."""
    ends = np.stack([space.low, space.high])
    return np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])


def _edges(space: _Space) -> Iterator[FloatArray]:
    """The twelve edges of the box."""
    corners = _corners(space)
    for a in range(8):
        for axis in (1, 2, 4):
            if not a & axis:
                yield corners[[a, a | axis]]


def _floor(space: _Space) -> Iterator[FloatArray]:
    """A grid of about ten lines each way, at round distances."""
    (x0, y0, _), (x1, y1, _), z = space.low, space.high, space.floor_m
    step = max(0.5, 2.0 ** math.ceil(math.log2(max(x1 - x0, y1 - y0) / 10.0)))
    for x in np.arange(math.ceil(x0 / step) * step, x1 + 1e-9, step):
        yield np.array([[x, y0, z], [x, y1, z]])
    for y in np.arange(math.ceil(y0 / step) * step, y1 + 1e-9, step):
        yield np.array([[x0, y, z], [x1, y, z]])


def _triad(space: _Space, view: View) -> Iterator[Html]:
    """Which way is x, y and z: lines of half a metre on the floor, in front of the path."""
    corner = _triad_corner(space)
    for axis, name in enumerate("xyz"):
        end = corner + 0.5 * np.eye(3)[axis]
        yield _line(np.stack([corner, end]), view, f"axis {name}")
        yield _mark(end, view, f"axis {name}", name)


def _triad_corner(space: _Space) -> FloatArray:
    (x0, y0, _), (x1, _, _) = space.reference.min(axis=0), space.reference.max(axis=0)
    return np.array([(x0 + x1) / 2.0, y0 - 0.3, space.floor_m])
