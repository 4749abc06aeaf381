"""A still plot as one SVG document, in light and dark: panels with axes, lines, dots, intervals and words.

For pages that show pictures and run no script; sizes are in pixels of the drawing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lcd_flight.drawing import colors
from lcd_flight.drawing.html import Html, tag
from lcd_flight.drawing.scale import Axis, label
from lcd_flight.model.types import FloatArray

_STYLE = """
text { font: 13px system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; fill: var(--ink); }
text.muted { fill: var(--muted); } text.title { font-weight: 650; } text.small { font-size: 11.5px; }
.paper { fill: var(--card); } .edge { stroke: var(--line); fill: none; }
polyline { fill: none; stroke-width: 2; stroke-linejoin: round; stroke-linecap: round; }
polyline.grid { stroke: var(--grid); stroke-width: 1; }
polyline.rule { stroke: var(--bad); stroke-width: 1.5; stroke-dasharray: 5 4; }
"""


@dataclass(frozen=True, slots=True)
class Stroke:
    """How a line, a dot or a bar looks."""

    color: str
    """A variable of the palette, e.g. `a` or `flown`."""
    dash: str = ""
    """As SVG's stroke-dasharray; solid where empty."""
    width: float = 2.0

    def css(self) -> str:
        """For a `style` attribute of a line."""
        dash = f";stroke-dasharray:{self.dash}" if self.dash else ""
        return f"stroke:var(--{self.color});stroke-width:{self.width:g}{dash}"


@dataclass(frozen=True, slots=True)
class Panel:
    """A rectangle of the drawing with an axis along its lower and its left edge."""

    left: float
    top: float
    width: float
    height: float
    across: Axis
    up: Axis

    def at(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """(N, 2) places in the drawing of values (N,)."""
        right = self.left + self.width * self.across.place(np.asarray(x, dtype=float))
        down = self.top + self.height * (1.0 - self.up.place(np.asarray(y, dtype=float)))
        return np.stack([right, down], axis=1)

    def frame(self, title: str, across: str, *, ticks: tuple[int, int] = (6, 5)) -> list[Html]:
        """Grid, numbers, a title above (what is up and its unit) and one below; no numbers below without the latter.

        ticks: about how many across and up; 0 up: none, the rows have names of their own.
        """
        parts = [words(self.left, self.top - 10, title, "title")]
        low, high = np.array([self.across.low, self.across.high]), np.array([self.up.low, self.up.high])
        for value in self.across.ticks(ticks[0]):
            parts.append(self.line(np.full(2, value), high, class_="grid"))
            x = self.left + self.width * float(self.across.place(np.array([value]))[0])
            number = label(value) if across else ""
            parts.append(words(x, self.top + self.height + 17, number, "muted small", "middle"))
        for value in self.up.ticks(ticks[1]) if ticks[1] else []:
            parts.append(self.line(low, np.full(2, value), class_="grid"))
            y = self.top + self.height * (1.0 - float(self.up.place(np.array([value]))[0]))
            parts.append(words(self.left - 7, y + 4, label(value), "muted small", "end"))
        parts.append(words(self.left + self.width / 2.0, self.top + self.height + 36, across, "muted", "middle"))
        return [*parts, tag("rect", x=self.left, y=self.top, width=self.width, height=self.height, class_="edge")]

    def line(self, x: FloatArray, y: FloatArray, stroke: Stroke | None = None, class_: str | None = None) -> Html:
        """A line through values (N,)."""
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in self.at(x, y).tolist())
        return tag("polyline", points=points, class_=class_, style=stroke.css() if stroke else None)

    def dots(self, x: FloatArray, y: FloatArray, stroke: Stroke, radius: float = 3.0) -> list[Html]:
        """A dot at each of N values."""
        fill = f"fill:var(--{stroke.color})"
        return [tag("circle", cx=f"{a:.1f}", cy=f"{b:.1f}", r=radius, style=fill) for a, b in self.at(x, y).tolist()]


def words(x: float, y: float, text: str, class_: str = "", anchor: str = "start") -> Html:
    """A line of text."""
    return tag("text", text, x=f"{x:.1f}", y=f"{y:.1f}", class_=class_ or None, text_anchor=anchor)


def legend(x: float, y: float, entries: Sequence[tuple[str, Stroke]], columns: int, step: float) -> list[Html]:
    """Keys in rows of so many columns, `step` apart."""
    parts = []
    for number, (name, stroke) in enumerate(entries):
        left, height = x + step * (number % columns), y + 20.0 * (number // columns)
        points = f"{left:.1f},{height - 4:.1f} {left + 26:.1f},{height - 4:.1f}"
        parts.append(tag("polyline", points=points, style=stroke.css()))
        parts.append(words(left + 33, height, name, "small"))
    return parts


def document(width: float, height: float, parts: Sequence[Html], about: str) -> Html:
    """The whole picture; `about` says what it shows to those who cannot see it."""
    return tag(
        "svg",
        tag("title", about),
        tag("style", Html(colors() + _STYLE)),
        tag("rect", width=width, height=height, rx=10, class_="paper"),
        *parts,
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {width:g} {height:g}",
        width=width,
        height=height,
        role="img",
    )
