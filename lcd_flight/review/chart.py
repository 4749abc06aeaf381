"""A chart over the flight's time as SVG: bands, rules and traces.

The drawing is stretched to whatever room there is and lines keep their width; words stand beside it as HTML, so that
they stay legible on a phone. The script zooms by the drawing's view box alone: bands, flags and traces follow.
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
"""Of one trace as it is drawn at first; the script has more of them (`detail.py`)."""

_HANGS_OVER = 0.95
"""Share of the width from which on a number has no room to its right."""


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """One line of a chart."""

    name: str
    time_s: FloatArray
    """(T,) ascending; traces of one flight share it."""
    values: FloatArray
    """(T,); NaN where there is nothing."""
    style: str
    """CSS class: flown, reference, baseline, a, b, c, d."""
    role: str = ""
    """What the script knows it by, e.g. `0/x`: the x of the first flight's position."""


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
    """CSS class: ground, climb, hover, trajectory, transfer, descent, abnormal, saturated."""


@dataclass(frozen=True, slots=True)
class Flag:
    """An instant that something happened at."""

    name: str
    begin_s: float
    end_s: float
    style: str
    """CSS class: info, warn, severe."""


@dataclass(frozen=True, slots=True, eq=False)
class Timeline:
    """What all charts of a page share."""

    axis: Axis
    phases: Sequence[Band]
    flags: Sequence[Flag]
    gaps: Sequence[Band] = ()
    """Where the log lacks ticks."""

    def across(self, time_s: float) -> float:
        """Share of the width."""
        return share_of(self.axis, time_s)


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
    return tag("figure", tag("figcaption", panel.title), *charts, axis_marks(timeline.axis, "s"), note, class_=style)


def axis_marks(axis: Axis, unit: str) -> Html:
    """The numbers of a horizontal axis; the last one carries the unit, and ends with the axis where it hangs over."""
    ticks = axis.ticks(6)
    texts = [*map(label, ticks[:-1]), f"{label(ticks[-1])} {unit}"]
    shares = [share_of(axis, value) for value in ticks]
    marks = [
        tag("span", text, class_="end" if share > _HANGS_OVER else None, style=f"left:{100.0 * share:.2f}%")
        for text, share in zip(texts, shares, strict=True)
    ]
    return tag("div", *marks, class_="times", data_unit=unit)


def share_of(axis: Axis, value: float) -> float:
    """Where on the axis a value lies, from 0 to 1."""
    return float(axis.place(np.array([value]))[0])


def _chart(chart: Chart, timeline: Timeline, *, first: bool) -> Html:
    axis = chart.axis
    ticks = axis.ticks(4)
    rules = [rule for rule in chart.rules if axis.low <= rule.value <= axis.high]
    drawing = tag(
        "svg",
        *(_band(band, timeline) for band in (*timeline.phases, *timeline.gaps, *chart.bands)),
        tag("g", *(_level(axis, value, None) for value in ticks), class_="grid"),
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
    """A line for each stretch without gaps; what is not shown of the time is not drawn."""
    shown = slice(*np.searchsorted(trace.time_s, (timeline.axis.low, timeline.axis.high + 1e-9)).tolist())
    values = trace.values[shown]
    x = np.rint(timeline.axis.place(trace.time_s[shown]) * WIDTH).astype(int)
    y = np.rint((1.0 - axis.place(values)) * HEIGHT)
    share = MOST_POINTS / max(len(x), 1)
    lines = []
    for run in runs(values):
        chosen = run.start + visible(values[run], max(4, round(share * (run.stop - run.start))))
        points = " ".join(f"{a},{b:.0f}" for a, b in zip(x[chosen].tolist(), y[chosen].tolist(), strict=True))
        lines.append(tag("polyline", points=points))
    return tag("g", *lines, class_=f"trace {trace.style}", data_role=trace.role or None)


def _band(band: Band, timeline: Timeline) -> Html:
    begin, end = timeline.across(band.begin_s) * WIDTH, timeline.across(band.end_s) * WIDTH
    width = max(1.0, round(end - begin, 1))
    return tag("rect", x=round(begin, 1), y=0, width=width, height=HEIGHT, class_=f"band {band.style}")


def _flag(flag: Flag, timeline: Timeline) -> Html:
    x = round(timeline.across(flag.begin_s) * WIDTH, 1)
    return tag("line", x1=x, x2=x, y1=0, y2=HEIGHT, class_=f"flag {flag.style}")


def _level(axis: Axis, value: float, style: str | None) -> Html:
    y = round((1.0 - share_of(axis, value)) * HEIGHT)
    return tag("line", x1=0, x2=WIDTH, y1=y, y2=y, class_=style)


def _beside(axis: Axis, value: float, text: str, style: str | None = None) -> Html:
    """Words at the height of a value."""
    return tag("span", text, class_=style, data_value=repr(value), style=f"bottom:{100.0 * share_of(axis, value):.1f}%")


def _phase_names(timeline: Timeline) -> Html:
    return tag("div", *(phase_name(band, timeline) for band in timeline.phases), class_="phases")


def phase_name(band: Band, timeline: Timeline) -> Html:
    """A phase's name over its stretch; the script moves it, and hides it where it has no room."""
    begin, end = timeline.across(band.begin_s), timeline.across(band.end_s)
    return tag(
        "span",
        tag("em", band.name),
        title=band.name,
        class_=band.style,
        style=f"left:{100.0 * begin:.2f}%;width:{100.0 * (end - begin):.2f}%",
        data_begin=f"{band.begin_s:.3f}",
        data_end=f"{band.end_s:.3f}",
    )
