"""Pictures of an evaluation: crash rates with their intervals, and how the largest errors are distributed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from lcd_flight.drawing.html import Html, tag
from lcd_flight.drawing.scale import Axis
from lcd_flight.drawing.still import Panel, Stroke, document, legend, words
from lcd_flight.learning.evaluation import Evaluation, MethodFigures
from lcd_flight.model.rollout import CRASH_ERROR_M

_WIDTH = 900.0
_ROW = 27.0
_NAMES = 220.0
"""Room for the rows' names."""
_ERRORS = Axis(0.02, 20.0, log=True)
_QUANTILES = 200
_FAMILIES = (("minimum-snap", "b"), ("analytic", "c"), ("learned", "a"), ("search", "d"))
_OTHERS = "reference"
_DASHES = ("", "7 4", "2 4", "9 3 2 3")


def strokes(methods: Sequence[str]) -> dict[str, Stroke]:
    """A colour for each family of methods, a dash for each member."""
    found: dict[str, Stroke] = {}
    members: dict[str, int] = {}
    for name in methods:
        color = next((color for family, color in _FAMILIES if name.startswith(family)), _OTHERS)
        number = members.get(color, 0)
        members[color] = number + 1
        found[name] = Stroke(color, _DASHES[number % len(_DASHES)])
    return found


def crash_rate_figure(title: str, evaluation: Evaluation) -> Html:
    """A bar for each method over all drag configurations, with its 95 % interval, and a dot for each configuration."""
    drags = evaluation.options.drags
    by_drag = [evaluation.at(drag) for drag in drags] if len(drags) > 1 else []
    dots = {name: [figures[name].crash_rate for figures in by_drag] for name in evaluation.runs}
    note = f"bar: all {len(drags)} drag configurations, with 95 % interval; dots: each of them" if by_drag else ""
    return bar_figure(title, evaluation.methods, dots, note)


def bar_figure(
    title: str, table: Mapping[str, MethodFigures], dots: Mapping[str, Sequence[float]] | None = None, note: str = ""
) -> Html:
    """A bar for each row of a table with its 95 % interval.

    dots: crash rates in % that a row is made of.
    """
    height = _ROW * len(table)
    most = max(row.crash_rate_high for row in table.values())
    panel = Panel(_NAMES, 52.0, 500.0, height, Axis(0.0, max(1.05 * most, 1.0)), Axis(0.0, float(len(table))))
    parts = [words(24.0, 26.0, title, "title"), *panel.frame("", "crashes in % of flights", ticks=(8, 0))]
    for number, (name, row) in enumerate(table.items()):
        parts += _bar(panel, len(table) - 0.5 - number, name, row, dots[name] if dots else ())
    parts.append(words(_NAMES, 52.0 + height + 58.0, note, "muted small"))
    return document(_WIDTH, height + 124.0, parts, f"{title}: crash rates of {', '.join(table)}")


def _bar(panel: Panel, up: float, name: str, row: MethodFigures, dots: Sequence[float]) -> list[Html]:
    """One method's row: name, bar, interval, dots and the number."""
    stroke = strokes([name])[name]
    ((left, y), (right, _)) = panel.at(np.array([0.0, row.crash_rate]), np.array([up, up])).tolist()
    fill = f"fill:var(--{stroke.color});fill-opacity:.35"
    parts = [
        words(panel.left - 12.0, y + 4.5, name, "", "end"),
        tag("rect", x=left, y=f"{y - 8:.1f}", width=f"{max(right - left, 0.5):.1f}", height=16, style=fill),
        panel.line(np.array([row.crash_rate_low, row.crash_rate_high]), np.array([up, up]), Stroke("ink", width=1.2)),
        words(panel.left + panel.width + 14.0, y + 4.5, _number(row), "small"),
    ]
    return parts + panel.dots(np.array(dots), np.full(len(dots), up), stroke, 2.6)


def _number(row: MethodFigures) -> str:
    error = "" if row.crash_rate_error is None else f" ({row.crash_rate_error:.1f})"
    return f"{row.crash_rate:.1f}{error} %"


def error_figure(title: str, evaluation: Evaluation) -> Html:
    """For each method, the share of flights whose largest position error is above a bound, over the bound."""
    panel = Panel(64.0, 58.0, 800.0, 330.0, _ERRORS, Axis(0.0, 100.0))
    parts = panel.frame(f"{title}: flights with a larger error, %", "largest position error in m, logarithmic")
    parts.append(panel.line(np.full(2, CRASH_ERROR_M), np.array([0.0, 100.0]), class_="rule"))
    looks = strokes(list(evaluation.runs))
    shares = np.linspace(0.0, 100.0, _QUANTILES + 1)
    for name, run in evaluation.runs.items():
        parts.append(panel.line(np.percentile(run.max_error_m, shares), 100.0 - shares, looks[name]))
    parts += legend(64.0, 448.0, list(looks.items()), 4, 210.0)
    rows = -(-len(looks) // 4)
    return document(_WIDTH, 448.0 + 20.0 * rows, parts, f"{title}: distribution of the largest position errors")
