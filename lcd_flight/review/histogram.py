"""How late ticks began, as a histogram."""

from __future__ import annotations

import numpy as np

from lcd_flight.drawing.html import Html, tag
from lcd_flight.drawing.scale import Axis, label
from lcd_flight.model.types import FloatArray
from lcd_flight.review.chart import HEIGHT, WIDTH, axis_marks

_BINS = 40
_LEAST_MS = 0.2
_ONE_TICK = 0.3
"""Height of a bar of one tick, in decades: a single late tick must be seen."""


def lateness_html(lateness_s: FloatArray, missed: int) -> Html:
    """A panel: bars by powers of ten, because the few late ticks are what matters."""
    late_ms = np.maximum(1e3 * lateness_s, 0.0)
    axis = Axis(0.0, max(1.02 * float(late_ms.max()), _LEAST_MS))
    counts, _ = np.histogram(late_ms, bins=_BINS, range=(axis.low, axis.high))
    decades = np.where(counts > 0, np.log10(np.maximum(counts, 1)) + _ONE_TICK, 0.0)
    heights = decades / (1.05 * decades.max())
    levels = np.arange(np.floor(decades.max() - _ONE_TICK) + 1.0)
    median, p99, largest = np.percentile(late_ms, (50.0, 99.0, 100.0)).tolist()
    note = (
        f"{len(late_ms)} ticks, {missed} missed; late by {median:.2f} ms in the median, "
        f"{p99:.2f} ms at 99 %, {largest:.2f} ms at most."
        if largest > 0.0
        else f"{len(late_ms)} ticks in virtual time, where none can be late."
    )
    drawing = tag(
        "svg",
        *(_bar(number, height) for number, height in enumerate(heights.tolist()) if height > 0.0),
        viewBox=f"0 0 {WIDTH} {HEIGHT}",
        preserveAspectRatio="none",
        role="img",
        aria_label=note,
    )
    marks = [
        tag("span", label(10.0**level), style=f"bottom:{100.0 * (level + _ONE_TICK) / (1.05 * decades.max()):.1f}%")
        for level in levels.tolist()
    ]
    return tag(
        "figure",
        tag("figcaption", "Loop timing"),
        tag(
            "div",
            tag("div", tag("b", "Lateness"), tag("span", "ticks, by powers of ten", class_="unit"), class_="legend"),
            tag("div", *marks, class_="scale"),
            tag("div", drawing, class_="plot"),
            class_="chart",
        ),
        axis_marks(axis, "ms"),
        tag("p", note, class_="note"),
        class_="panel single",
    )


def _bar(number: int, height: float) -> Html:
    width = WIDTH / _BINS
    top = round(HEIGHT * (1.0 - height))
    return tag("rect", x=round(number * width) + 3, y=top, width=round(width) - 6, height=HEIGHT - top, class_="bar")
