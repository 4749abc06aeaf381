"""A chart over the flight's time as SVG: bands, rules and traces.

The drawing is stretched to whatever room there is and lines keep their width; words stand beside it as HTML, so that
they stay legible on a phone. A script reads values back from the traces' points by the axis that the chart carries.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lcd_flight.drawing.html import Html, tag
from lcd_flight.drawing.scale import Axis, label, runs, visible
from lcd_flight.model.types import FloatArray

WIDTH, HEIGHT = 2000, 1000
"""Of the drawing, in its own units: half a pixel of a large screen."""

MOST_POINTS = 700
"""Of one trace."""

_HANGS_OVER = 0.95
"""Share of the width from which on a number has no room to its right."""

_LEAST_NAMED = 0.04
"""Share of the width below which a phase has no room for its name."""


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """One line of a chart."""

    name: str
    values: FloatArray
    """(T,)"""
    style: str
    """CSS class: flown, reference, baseline, a, b, c, d."""


@dataclass(frozen=True, slots=True)
class Rule:
    """A level to compare with."""

    name: str
    value: float
    style: str
    """CSS class: limit, warning, note."""


@dataclass(frozen=True, slots=True)
class Band:
    """A stretch of time with a background."""

    name: str
    begin_s: float
    end_s: float
    style: str
    """CSS class: phase-0, phase-1, abnormal, saturated."""


@dataclass(frozen=True, slots=True)
class Flag:
    """An instant that something happened at."""

    name: str
    time_s: float
    style: str
    """CSS class: info, warn, severe."""


@dataclass(frozen=True, slots=True, eq=False)
class Timeline:
    """What all charts of a flight share."""

    time_s: FloatArray
    """(T,)"""
    axis: Axis
    phases: Sequence[Band]
    flags: Sequence[Flag]

    def across(self, time_s: float) -> float:
        """Share of the width."""
        return float(self.axis.place(np.array([time_s]))[0])


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """One plot: traces of one unit over time."""

    name: str
    unit: str
    traces: Sequence[Trace]
    axis: Axis
    rules: Sequence[Rule] = ()
    bands: Sequence[Band] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """Charts that belong together, one above the other."""

    title: str
    charts: Sequence[Chart]
    note: str = ""
    wide: bool = False
    """Whether it takes the whole width of the page."""


def panel_html(panel: Panel, timeline: Timeline) -> Html:
    """A panel as a figure; the phases' names stand above its first chart, the times below its last."""
    charts = [_chart(chart, timeline, first=chart is panel.charts[0]) for chart in panel.charts]
    note = tag("p", panel.note, class_="note") if panel.note else None
    style = "panel" + (" wide" if panel.wide else "") + (" single" if len(charts) == 1 else "")
    return tag("figure", tag("figcaption", panel.title), *charts, _times(timeline), note, class_=style)


def _chart(chart: Chart, timeline: Timeline, *, first: bool) -> Html:
    axis = chart.axis
    ticks = axis.ticks(4)
    rules = [rule for rule in chart.rules if axis.low <= rule.value <= axis.high]
    drawing = tag(
        "svg",
        *(_band(band, timeline) for band in (*timeline.phases, *chart.bands)),
        *(_level(axis, value, "grid") for value in ticks),
        *(_flag(flag, timeline) for flag in timeline.flags),
        *(_level(axis, rule.value, f"rule {rule.style}") for rule in rules),
        *(_trace(trace, axis, timeline) for trace in chart.traces),
        viewBox=f"0 0 {WIDTH} {HEIGHT}",
        preserveAspectRatio="none",
        data_low=repr(axis.low),
        data_high=repr(axis.high),
        data_log=axis.log,
        role="img",
        aria_label=f"{chart.name}, {chart.unit}",
    )
    return tag(
        "div",
        _legend(chart),
        _phase_names(timeline) if first else None,
        tag("div", *(_beside(axis, value, label(value)) for value in ticks), class_="scale"),
        tag(
            "div",
            drawing,
            *(_beside(axis, rule.value, rule.name, rule.style) for rule in rules),
            tag("i", class_="cursor"),
            class_="plot",
        ),
        class_="chart",
    )


def _legend(chart: Chart) -> Html:
    keys = [
        tag("span", tag("i", class_=f"key {trace.style}"), trace.name, " ", tag("output"), class_="entry")
        for trace in chart.traces
    ]
    return tag("div", tag("b", chart.name), " ", tag("span", chart.unit, class_="unit"), *keys, class_="legend")


def _trace(trace: Trace, axis: Axis, timeline: Timeline) -> Html:
    """A line for each stretch without gaps."""
    x = np.rint(timeline.axis.place(timeline.time_s) * WIDTH).astype(int)
    y = np.rint((1.0 - axis.place(trace.values)) * HEIGHT)
    share = MOST_POINTS / max(len(x), 1)
    lines = []
    for run in runs(trace.values):
        chosen = run.start + visible(trace.values[run], max(4, round(share * (run.stop - run.start))))
        points = " ".join(f"{a},{b:.0f}" for a, b in zip(x[chosen].tolist(), y[chosen].tolist(), strict=True))
        lines.append(tag("polyline", points=points))
    return tag("g", *lines, class_=f"trace {trace.style}")


def _band(band: Band, timeline: Timeline) -> Html:
    begin, end = timeline.across(band.begin_s) * WIDTH, timeline.across(band.end_s) * WIDTH
    return tag("rect", x=round(begin), y=0, width=max(1, round(end - begin)), height=HEIGHT, class_=band.style)


def _flag(flag: Flag, timeline: Timeline) -> Html:
    x = round(timeline.across(flag.time_s) * WIDTH)
    return tag("line", x1=x, x2=x, y1=0, y2=HEIGHT, class_=f"flag {flag.style}")


def _level(axis: Axis, value: float, style: str) -> Html:
    y = round((1.0 - _share(axis, value)) * HEIGHT)
    return tag("line", x1=0, x2=WIDTH, y1=y, y2=y, class_=style)


def _beside(axis: Axis, value: float, text: str, style: str | None = None) -> Html:
    """Words at the height of a value."""
    return tag("span", text, class_=style, style=f"bottom:{100.0 * _share(axis, value):.1f}%")


def _phase_names(timeline: Timeline) -> Html:
    names = [
        tag("span", band.name, style=f"left:{100.0 * begin:.2f}%;width:{100.0 * (end - begin):.2f}%", title=band.name)
        for band in timeline.phases
        for begin, end in [(timeline.across(band.begin_s), timeline.across(band.end_s))]
        if end - begin > _LEAST_NAMED
    ]
    return tag("div", *names, class_="phases")


def _times(timeline: Timeline) -> Html:
    """The numbers below a panel."""
    return axis_marks(timeline.axis, "s")


def axis_marks(axis: Axis, unit: str) -> Html:
    """The numbers of a horizontal axis; the last one carries the unit, and ends with the axis where it hangs over."""
    ticks = axis.ticks(6)
    texts = [*map(label, ticks[:-1]), f"{label(ticks[-1])} {unit}"]
    shares = [_share(axis, value) for value in ticks]
    marks = [
        tag("span", text, class_="end" if share > _HANGS_OVER else None, style=f"left:{100.0 * share:.2f}%")
        for text, share in zip(texts, shares, strict=True)
    ]
    return tag("div", *marks, class_="times")


def _share(axis: Axis, value: float) -> float:
    return float(axis.place(np.array([value]))[0])
