"""Still pictures of a planned trajectory beside minimum snap: two views, speed, thrust, expected errors."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from lcd_flight.drawing.html import Html
from lcd_flight.drawing.scale import Axis
from lcd_flight.drawing.still import Panel, Stroke, document, legend, words
from lcd_flight.mission.planned import TrajectorySummary
from lcd_flight.model import GRAVITY_M_PER_S2, FloatArray, Leg, Trajectory, Vehicle

WIDTH = 460.0
"""Of every picture, in its own pixels: words stay legible on a phone."""
_LEFT, _TOP, _ROOM, _BELOW = 52.0, 62.0, 392.0, 46.0
_TALLEST = 400.0
_CHART = 200.0
_NUMBER_ROOM = 16.0
_MOST_DOTS = 30
"""Waypoints on a line over time; more would be all dots."""
_POINTS, _MOST_POINTS = 24, 1200
"""Of a line: for each segment, and at most."""

_LEAST, _PLAN, _LIMIT = Stroke("baseline", "6 4"), Stroke("flown"), Stroke("bad", "5 4", 1.5)
_WAYPOINT = Stroke("waypoint")

_Measure = Callable[[Trajectory, FloatArray], FloatArray]


@dataclass(frozen=True, slots=True, eq=False)
class PlanShown:
    """One trajectory as it is drawn."""

    leg: Leg
    """With its waypoints and minimum snap."""
    summary: TrajectorySummary
    vehicle: Vehicle
    max_velocity: float
    """m/s, the mission's limit."""
    max_thrust_ratio: float
    """Of static thrust, the mission's limit."""

    @property
    def lines(self) -> list[tuple[str, Trajectory, Stroke]]:
        """What is drawn, from the back to the front: minimum snap alone where it is the plan."""
        assert self.leg.baseline is not None  # noqa: S101 - trajectories of a mission have one
        least = ("minimum snap", self.leg.baseline, _LEAST)
        if self.summary.method == least[0].replace(" ", "-"):
            return [("minimum snap", self.leg.trajectory, _PLAN)]
        return [least, (self.summary.method, self.leg.trajectory, _PLAN)]


def pictures(shown: PlanShown) -> Iterator[Html]:
    """All pictures of one trajectory."""
    waypoints = shown.leg.waypoints
    assert waypoints is not None  # noqa: S101 - likewise
    spans = waypoints[:, :2].max(axis=0) - waypoints[:, :2].min(axis=0)
    yield _view(shown, waypoints, "From above", 0, 1)
    yield _view(shown, waypoints, "From the side", int(spans[1] > spans[0]), 2)
    yield _chart(shown, "Speed, m/s", _speed, [(shown.max_velocity, "limit")])
    full = [(100.0, "full thrust"), (100.0 * shown.max_thrust_ratio, "limit")]
    yield _chart(shown, "Thrust, % of full thrust", _thrust_percent(shown.vehicle), full)
    if shown.summary.segment_errors_m is not None:
        yield _errors(shown)


def _view(shown: PlanShown, waypoints: FloatArray, title: str, across: int, up: int) -> Html:
    """Along one axis of the world, at one scale for both others."""
    paths = [(_sampled(line, 0), stroke) for _, line, stroke in shown.lines]
    points = np.concatenate([path for path, _ in paths])
    names = "xyz"
    axes = [_roomy(points[:, n]) for n in (across, up)]
    spans = [axis.high - axis.low for axis in axes]
    scale = min(_ROOM / spans[0], _TALLEST / spans[1])
    panel = Panel(_LEFT, _TOP, spans[0] * scale, spans[1] * scale, *axes)
    count = max(3, round(spans[0] * scale / 60.0)), max(3, round(spans[1] * scale / 50.0))
    parts = panel.frame(f"{title}: {names[up]}, m", f"{names[across]}, m", ticks=count)
    parts += [panel.line(path[:, across], path[:, up], stroke) for path, stroke in paths]
    radius = 4.0 if len(waypoints) <= _MOST_DOTS else 2.0
    parts += panel.dots(waypoints[:, across], waypoints[:, up], _WAYPOINT, radius)
    parts += _numbers(panel.at(waypoints[:, across], waypoints[:, up]))
    return _picture(shown, parts, panel, f"{title}: the path through {len(waypoints)} waypoints")


def _roomy(values: FloatArray) -> Axis:
    """With a margin for the numbers of waypoints."""
    low, high = float(values.min()), float(values.max())
    margin = max(0.09 * (high - low), 0.15)
    return Axis(low - margin, high + margin)


def _numbers(places: FloatArray) -> Iterator[Html]:
    """Of the waypoints at `places` (K, 2), where they do not hide each other."""
    numbered = np.empty((0, 2))
    for number, place in enumerate(places, start=1):
        if not (np.linalg.norm(numbered - place, axis=1) < _NUMBER_ROOM).any():
            numbered = np.vstack([numbered, place])
            yield words(float(place[0]) + 7, float(place[1]) - 7, str(number), "small")


def _chart(shown: PlanShown, title: str, measure: _Measure, levels: list[tuple[float, str]]) -> Html:
    """Over the time of the trajectory, with the instants of the waypoints as dots."""
    lines = [(line, _times(line), stroke) for _, line, stroke in shown.lines]
    values = [measure(line, times) for line, times, _ in lines]
    reached = max(float(value.max()) for value in values)
    rules = [(level, name) for level, name in levels if level <= 1.6 * reached]
    top = 1.08 * max([reached, *(level for level, _ in rules)])
    longest = max(line.duration_s for line, _, _ in lines)
    panel = Panel(_LEFT, _TOP, _ROOM, _CHART, Axis(0.0, longest), Axis(0.0, top))
    parts = panel.frame(title, "time from the first waypoint, s", ticks=(6, 4))
    for level, name in rules:
        parts.append(panel.line(np.array([0.0, longest]), np.full(2, level), _LIMIT))
        height = float(panel.at(np.zeros(1), np.array([level]))[0, 1])
        parts.append(words(_LEFT + _ROOM - 4, height - 5, name, "small", "end"))
    for (line, times, stroke), value in zip(lines, values, strict=True):
        parts.append(panel.line(times, value, stroke))
        knots = line.knot_times_s
        if len(knots) <= _MOST_DOTS:
            parts += panel.dots(knots, measure(line, knots), Stroke(stroke.color), 2.6)
    return _picture(shown, parts, panel, title)


def _errors(shown: PlanShown) -> Html:
    """The largest error that the learned cost expects, segment by segment."""
    columns = [
        (np.array(errors), stroke)
        for errors, stroke in (
            (shown.summary.minimum_snap_segment_errors_m, Stroke("baseline")),
            (shown.summary.segment_errors_m, Stroke("flown")),
        )
        if errors is not None
    ][-len(shown.lines) :]
    segments = len(columns[0][0])
    top = 1.1 * max(float(errors.max()) for errors, _ in columns)
    panel = Panel(_LEFT, _TOP, _ROOM, _CHART, Axis(0.5, segments + 0.5), Axis(0.0, max(top, 1e-3)))
    parts = panel.frame("Expected largest error, m", "segment", ticks=(min(segments, 6), 4))
    width = max(1.0, 0.3 * _ROOM / segments)
    for n, (errors, stroke) in enumerate(columns):
        shift = 0.34 * (n - 0.5 * (len(columns) - 1))
        bar = Stroke(stroke.color, width=min(width, 40.0))
        for segment, error in enumerate(errors.tolist(), start=1):
            parts.append(panel.line(np.full(2, segment + shift), np.array([0.0, error]), bar, class_="bar"))
    return _picture(shown, parts, panel, "Largest error expected in each segment")


def _picture(shown: PlanShown, parts: list[Html], panel: Panel, about: str) -> Html:
    """With its legend on top."""
    entries = [(name, stroke) for name, _, stroke in shown.lines]
    return document(WIDTH, panel.top + panel.height + _BELOW, [*parts, *legend(_LEFT, 28.0, entries, 2, 190.0)], about)


def _times(trajectory: Trajectory) -> FloatArray:
    """(T,) every segment alike, its ends among them."""
    count = max(2, min(_POINTS, _MOST_POINTS // trajectory.segments))
    shares = np.linspace(0.0, 1.0, count + 1)[:-1]
    inside = trajectory.knot_times_s[:-1, None] + trajectory.durations_s[:, None] * shares
    return np.append(inside.ravel(), trajectory.duration_s)


def _sampled(trajectory: Trajectory, order: int) -> FloatArray:
    """Position, or a derivative of it, (T, 3)."""
    return trajectory.derivative(_times(trajectory), order)[:, :3]


def _speed(trajectory: Trajectory, times_s: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(trajectory.derivative(times_s, 1)[:, :3], axis=1))


def _thrust_percent(vehicle: Vehicle) -> _Measure:
    """m |a + g e3| over static thrust; drag is left out."""

    def measure(trajectory: Trajectory, times_s: FloatArray) -> FloatArray:
        force = trajectory.derivative(times_s, 2)[:, :3] + np.array([0.0, 0.0, GRAVITY_M_PER_S2])
        return np.asarray(100.0 * vehicle.mass_kg * np.linalg.norm(force, axis=1) / vehicle.max_thrust_N)

    return measure
