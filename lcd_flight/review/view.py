"""Paths in three dimensions as SVG, seen from one side; the page's script turns and plays the same shapes.

Every shape carries its points in the world (`data-xyz`, mm) and the drawing its view, so that the still picture and the
script have one projection: orthographic, turned about z by the azimuth, then tipped by the elevation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lcd_flight.drawing.html import Html, tag
from lcd_flight.model.types import FloatArray
from lcd_flight.review.space import Flown, Space

WIDTH, HEIGHT = 1000, 640

_AZIMUTH_RAD = math.radians(-32.0)
_ELEVATION_RAD = math.radians(26.0)
_FILLED = 0.86
"""Share of the drawing that the shapes take."""


@dataclass(frozen=True, slots=True)
class View:
    """From where the world is looked at."""

    center_m: tuple[float, float, float]
    scale: float
    """Units of the drawing per m."""

    @staticmethod
    def of(space: Space) -> View:
        """The paths and the floor below them, as large as they fit; the fence may run out of the drawing."""
        seen = np.concatenate([space.paths, space.on_floor(space.paths), space.triad_corner()[None]])
        center = (seen.min(axis=0) + seen.max(axis=0)) / 2.0
        unit = View((float(center[0]), float(center[1]), float(center[2])), 1.0)
        reach = np.abs(unit.project(seen) - (WIDTH / 2, HEIGHT / 2)).max(axis=0)
        half = np.array([WIDTH / 2, HEIGHT / 2])
        return View(unit.center_m, _FILLED * float(np.min(half / np.maximum(reach, 1e-6))))

    def project(self, points_m: FloatArray) -> FloatArray:
        """(N, 2) places in the drawing, y down, of (N, 3) points in the world."""
        x, y, z = (points_m - np.array(self.center_m)).T
        right = x * math.cos(_AZIMUTH_RAD) - y * math.sin(_AZIMUTH_RAD)
        away = x * math.sin(_AZIMUTH_RAD) + y * math.cos(_AZIMUTH_RAD)
        up = z * math.cos(_ELEVATION_RAD) + away * math.sin(_ELEVATION_RAD)
        return np.stack([WIDTH / 2 + self.scale * right, HEIGHT / 2 - self.scale * up], axis=1)


def path_drawing(space: Space, *, still: bool = False) -> Html:
    """The whole drawing; a still one has nothing for a script."""
    view = View.of(space)
    return tag(
        "svg",
        *_shapes(space, view, still=still),
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


def _shapes(space: Space, view: View, *, still: bool) -> Iterator[Html]:
    """From the back to the front."""
    yield from (_line(line, view, "floor") for line in space.floor())
    yield from (_line(edge, view, "fence" if space.fenced else "box") for edge in space.edges())
    yield from (_line(space.on_floor(row.points), view, "shadow") for row in space.flown if len(row.points))
    for waypoint in space.waypoints:
        yield _line(np.stack([waypoint, space.on_floor(waypoint[None])[0]]), view, "drop")
    yield from (_line(baseline, view, "baseline") for baseline in space.baselines)
    yield from (_line(reference, view, "reference") for reference in space.references)
    for number, row in enumerate(space.flown):
        yield from _flown(number, row, view)
    yield from (_mark(point, view, "waypoint", str(number)) for number, point in enumerate(space.waypoints, start=1))
    yield from _triad(space, view)
    if not still:
        yield from (_vehicle(number, row, view) for number, row in enumerate(space.flown) if len(row.points))


def _flown(number: int, row: Flown, view: View) -> Iterator[Html]:
    """The path, with its saturated pieces behind it."""
    yield from (_line(piece, view, "hot") for piece in row.saturated)
    if len(row.points):
        yield _line(row.points, view, f"path {row.style}", flight=number)


def _vehicle(number: int, row: Flown, view: View) -> Html:
    """Where the vehicle is: a dot here; the script adds its arms, its thrust and the way to its reference."""
    lines = [tag("polyline", class_=part) for part in ("gap", "arm", "arm", "nose", "up")]
    dot = tag("circle", r=4.5, **_place(row.points[-1], view))
    target = tag("circle", r=4, class_="target", display="none")
    return tag("g", *lines, target, dot, class_=f"now {row.style}", data_flight=number)


def _line(points_m: FloatArray, view: View, style: str, flight: int | None = None) -> Html:
    places = " ".join(f"{x:.1f},{y:.1f}" for x, y in view.project(points_m).tolist())
    return tag("polyline", points=places, data_xyz=_millimetres(points_m), data_flight=flight, class_=style)


def _mark(point_m: FloatArray, view: View, style: str, text: str) -> Html:
    place = _place(point_m, view)
    dot = tag("circle", r=5) if style == "waypoint" else None
    where = f"translate({place['cx']:.1f},{place['cy']:.1f})"
    return tag(
        "g", dot, tag("text", text, x=9, y=-7), transform=where, data_xyz=_millimetres(point_m[None]), class_=style
    )


def _place(point_m: FloatArray, view: View) -> dict[str, float]:
    ((x, y),) = view.project(point_m[None]).tolist()
    return {"cx": round(x, 1), "cy": round(y, 1)}


def _millimetres(points_m: FloatArray) -> str:
    return " ".join(f"{x:.0f},{y:.0f},{z:.0f}" for x, y, z in (1e3 * points_m).tolist())


def _triad(space: Space, view: View) -> Iterator[Html]:
    """Which way is x, y and z: lines of half a metre."""
    corner = space.triad_corner()
    for axis, name in enumerate("xyz"):
        end = corner + 0.5 * np.eye(3)[axis]
        yield _line(np.stack([corner, end]), view, f"axis {name}")
        yield _mark(end, view, f"axis {name}", name)
