"""The report of one flight: a page for a screen, a phone or paper, in light and dark."""

from __future__ import annotations

from pathlib import Path

from lcd_flight.drawing.html import Html, tag
from lcd_flight.files import write_whole
from lcd_flight.record import FlightLog
from lcd_flight.review import sections
from lcd_flight.review.chart import panel_html
from lcd_flight.review.document import document
from lcd_flight.review.figures import figures_of
from lcd_flight.review.histogram import lateness_html
from lcd_flight.review.player import space_buttons
from lcd_flight.review.plots import panels
from lcd_flight.review.space import Space, baselines, space_of
from lcd_flight.review.timeline import timeline
from lcd_flight.review.view import path_drawing


def write_page(log: FlightLog, path: Path) -> Path:
    """Write the report of a flight and return its path.

    Raises:
        InputError: the file cannot be written.
    """
    write_whole(path, page(log))
    return path


def page(log: FlightLog) -> Html:
    """The report as one HTML document."""
    figures, line, shown = figures_of(log), timeline(log), list(panels(log))
    keys = [("flown", "flown"), ("reference", "reference")]
    if baselines(log.header.plan):
        keys.append(("baseline", "minimum snap"))
    space = space_of([log], [0.0])
    if space.fenced:
        keys.append(("fence", "fence"))
    if space.flown[0].saturated:
        keys.append(("hot", "saturated"))
    content = [
        sections.heading(log, figures),
        sections.warnings(log),
        sections.tiles(figures),
        tag(
            "div",
            path_panel(space, keys),
            *(panel_html(panel, line) for panel in shown),
            lateness_html(log.series.lateness_s, figures.missed_ticks),
            sections.phase_table(figures),
            sections.waypoint_table(log, figures),
            sections.segment_table(figures),
            sections.finding_table(log),
            sections.configuration(log),
            class_="panels",
        ),
        tag("footer", f"Made by lcd-flight {log.header.versions.get('lcd-flight', '')} from {log.path.name}."),
    ]
    return document(f"{log.header.name}: flight report", content, shown, line)


def path_panel(space: Space, keys: list[tuple[str, str]]) -> Html:
    """The drawing with its legend, CSS class and name of each line, and its buttons."""
    legend = (tag("span", tag("i", class_=f"key {style}"), name) for style, name in keys)
    return tag(
        "figure",
        tag("figcaption", "Path"),
        tag("div", *legend, class_="keys"),
        path_drawing(space),
        space_buttons(),
        tag(
            "p",
            "Drag to turn, two fingers or Ctrl and wheel to zoom. In the charts: drag to zoom in time, two fingers or "
            "Ctrl and wheel as well, double-click for the whole flight; everything follows.",
            class_="note hint",
        ),
        class_="panel wide scene",
    )
