"""Pictures of single flights in the form of the paper's figures: the path in space, and x, y, z, yaw over time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from lcd_flight.drawing.html import Html, tag
from lcd_flight.drawing.scale import Axis, axis_around
from lcd_flight.drawing.still import Panel, Stroke, document, legend, words
from lcd_flight.learning.evaluate import flown_vehicle, problem_of, rollouts_of
from lcd_flight.learning.evaluation import Evaluation
from lcd_flight.learning.methods import find_method
from lcd_flight.model import FloatArray, RolloutOptions, Simulator, Tasks, Trajectory, Vehicle, World
from lcd_flight.model.rollout import FlownPath

_AZIMUTH_RAD = math.radians(-32.0)
_ELEVATION_RAD = math.radians(26.0)
_STEP_S = 0.02
_AXES = ("x in m", "y in m", "z in m", "yaw in rad")


@runtime_checkable
class PathTeller(Protocol):
    """A simulator that tells the path of one rollout as well as its labels."""

    def path(self, plan: Trajectory, vehicle: Vehicle, seed: int, options: RolloutOptions) -> FlownPath:
        """Fly one plan as `Simulator.rollout` would and tell where it went."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Flight:
    """One plan and what became of it."""

    name: str
    plan: Trajectory
    path: FlownPath
    stroke: Stroke

    @property
    def reference(self) -> tuple[FloatArray, FloatArray]:
        """Times (T,) in s and x, y, z, yaw (T, 4) of the plan."""
        times = np.linspace(0.0, self.plan.duration_s, math.ceil(self.plan.duration_s / _STEP_S) + 1)
        return times, self.plan.derivative(times, 0)

    @property
    def flown(self) -> FloatArray:
        """(T, 4) x, y, z, yaw at the path's times."""
        return np.concatenate([self.path.p_WB, self.path.yaw_rad[:, None]], axis=1)


def fly_again(
    world: World, tasks: Tasks, row: int, evaluation: Evaluation, simulator: Simulator, teller: PathTeller, method: str
) -> Flight:
    """One flight of an evaluation once more, with its path: task `row`, the first drag and the first noise seed."""
    options = evaluation.options
    problem = problem_of(world, tasks, simulator, options, options.drags[0]).take(np.array([row]))
    planned = find_method(method)(problem)
    plan = planned.plans[0]
    seed = int(evaluation.noise[row, 0])
    path = teller.path(plan, flown_vehicle(problem, options), seed, rollouts_of(problem, planned))
    return Flight(method, plan, path, Stroke("b" if method.startswith("minimum") else "a"))


def flight_figure(title: str, flights: Sequence[Flight]) -> Html:
    """Left the paths in three dimensions, right x, y, z and yaw over time; dotted as planned, solid as flown."""
    parts = [words(24.0, 28.0, title, "title"), *_space(flights, 24.0, 44.0, 430.0, 430.0)]
    times = Axis(0.0, max(flight.plan.duration_s for flight in flights))
    for axis, name in enumerate(_AXES):
        values = [c for f in flights for c in (f.reference[1][:, axis], f.flown[:, axis])]
        panel = Panel(530.0, 50.0 + 112.0 * axis, 350.0, 76.0, times, axis_around(*values, least=0.5))
        parts += panel.frame(name, "time in s" if axis == 3 else "", ticks=(6, 3))
        for flight in flights:
            moments, reference = flight.reference
            parts.append(panel.line(moments, reference[:, axis], _planned(flight.stroke)))
            parts.append(panel.line(flight.path.times_s, flight.flown[:, axis], flight.stroke))
        knots = flights[0].plan
        at_knots = knots.derivative(knots.knot_times_s, 0)[:, axis]
        parts += panel.dots(knots.knot_times_s, at_knots, Stroke("waypoint"), 3.2)
    parts += _keys(flights, 24.0, 500.0)
    return document(910.0, 530.0, parts, f"{title}: planned and flown paths of {', '.join(f.name for f in flights)}")


def gallery_figure(title: str, flights: Sequence[Flight]) -> Html:
    """Several flights side by side, each in a space of its own."""
    parts = [words(24.0, 28.0, title, "title")]
    for number, flight in enumerate(flights):
        left = 24.0 + 300.0 * number
        parts += _space([flight], left, 66.0, 270.0, 270.0)
        parts.append(words(left, 58.0, flight.name, "small"))
    parts += _keys([Flight("flown", flights[0].plan, flights[0].path, flights[0].stroke)], 24.0, 366.0)
    return document(930.0, 392.0, parts, f"{title}: {', '.join(f.name for f in flights)}")


def _planned(stroke: Stroke) -> Stroke:
    return Stroke(stroke.color, "1 4", 1.6)


def _keys(flights: Sequence[Flight], x: float, y: float) -> list[Html]:
    entries = [(flight.name, flight.stroke) for flight in flights]
    return legend(x, y, [*entries, ("dotted: as planned", _planned(Stroke("reference")))], 4, 210.0)


def _space(flights: Sequence[Flight], left: float, top: float, width: float, height: float) -> list[Html]:
    """The paths seen from one side, as large as they fit; shadows on the floor show what is above what."""
    lines = [line for f in flights for line in (f.reference[1][:, :3], f.path.p_WB)]
    points = np.concatenate(lines)
    floor = float(points[:, 2].min()) - 0.2
    seen = _projected(np.concatenate([points, _dropped(points, floor)]))
    low, size = seen.min(axis=0), np.maximum(np.ptp(seen, axis=0), 1e-6)
    scale = 0.94 * min(width / size[0], height / size[1])
    middle = np.array([left + width / 2.0, top + height / 2.0])

    def placed(points_m: FloatArray) -> str:
        places = middle + scale * (_projected(points_m) - low - size / 2.0) * (1.0, -1.0)
        return " ".join(f"{x:.1f},{y:.1f}" for x, y in places.tolist())

    parts = [tag("rect", x=left, y=top, width=width, height=height, class_="edge")]
    for flight in flights:
        shadow = _dropped(flight.path.p_WB, floor)
        parts.append(tag("polyline", points=placed(shadow), style="stroke:var(--ink);opacity:.12"))
    for flight in flights:
        parts.append(tag("polyline", points=placed(flight.reference[1][:, :3]), style=_planned(flight.stroke).css()))
        parts.append(tag("polyline", points=placed(flight.path.p_WB), style=flight.stroke.css()))
    for point in flights[0].plan.waypoints()[:, :3]:
        x, y = placed(point[None]).split(",")
        parts.append(tag("circle", cx=x, cy=y, r=4.0, style="fill:var(--waypoint)"))
    return parts


def _projected(points_m: FloatArray) -> FloatArray:
    """(N, 2) right and up of points (N, 3): orthographic, turned about z, then tipped."""
    x, y, z = points_m.T
    away = x * math.sin(_AZIMUTH_RAD) + y * math.cos(_AZIMUTH_RAD)
    right = x * math.cos(_AZIMUTH_RAD) - y * math.sin(_AZIMUTH_RAD)
    return np.stack([right, z * math.cos(_ELEVATION_RAD) + away * math.sin(_ELEVATION_RAD)], axis=1)


def _dropped(points_m: FloatArray, floor_m: float) -> FloatArray:
    return np.concatenate([points_m[:, :2], np.full((len(points_m), 1), floor_m)], axis=1)
