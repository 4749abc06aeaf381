"""A still picture of a flight's path for a README or a paper: one SVG file, in light and dark."""

from __future__ import annotations

from pathlib import Path

from lcd_flight.drawing import colors
from lcd_flight.drawing.html import Html, tag
from lcd_flight.files import write_whole
from lcd_flight.record import FlightLog
from lcd_flight.review.assets import asset
from lcd_flight.review.figures import figures_of
from lcd_flight.review.space import baselines, space_of
from lcd_flight.review.view import HEIGHT, WIDTH, path_drawing

_FOOT = 44
"""Height of the legend."""


def write_path_figure(log: FlightLog, path: Path) -> Path:
    """Write the picture and return its path.

    Raises:
        InputError: the file cannot be written.
    """
    write_whole(path, path_figure(log))
    return path


def path_figure(log: FlightLog) -> Html:
    """The picture as one SVG document."""
    size = {"width": WIDTH, "height": HEIGHT + _FOOT}
    return tag(
        "svg",
        tag("style", Html(colors() + asset("space.css") + ".paper { fill: var(--card); }")),
        tag("rect", **size, rx=12, class_="paper"),
        path_drawing(space_of([log], [0.0]), still=True),
        tag("g", *_legend(log), class_="space", transform=f"translate(28,{HEIGHT + _FOOT // 2 - 4})"),
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {WIDTH} {HEIGHT + _FOOT}",
        **size,
    )


def _legend(log: FlightLog) -> list[Html]:
    """Keys from the left, and what the flight came to on the right."""
    keys = [("flown", "flown"), ("reference", "planned")]
    if baselines(log.header.plan):
        keys.append(("baseline", "minimum snap"))
    parts = []
    for number, (style, name) in enumerate(keys):
        x = 130 * number
        parts.append(tag("polyline", points=f"{x},-5 {x + 30},-5", class_=style))
        parts.append(tag("text", name, x=x + 40, y=0, class_="words"))
    largest = figures_of(log).max_position_error_m
    words = log.header.name if largest is None else f"{log.header.name}: largest error {largest:.2f} m"
    parts.append(tag("text", words, x=WIDTH - 56, y=0, text_anchor="end", class_="words"))
    return parts
