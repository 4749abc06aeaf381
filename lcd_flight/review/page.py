"""The report: one HTML file that needs no network, in light and dark, on a screen, a phone or paper."""

from __future__ import annotations

from pathlib import Path

from lcd_flight.drawing import colors
from lcd_flight.drawing.html import Html, joined, tag
from lcd_flight.record import FlightLog
from lcd_flight.review import sections
from lcd_flight.review.assets import asset
from lcd_flight.review.chart import Timeline, panel_html
from lcd_flight.review.figures import FlightFigures, figures_of
from lcd_flight.review.histogram import lateness_html
from lcd_flight.review.plots import panels, timeline
from lcd_flight.review.view import baselines, path_drawing

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
"""Nothing is ever loaded, whatever a log may hold."""


def write_page(log: FlightLog, path: Path) -> Path:
    """Write the report of a flight and return its path.

    Raises:
        OSError: the file cannot be written.
    """
    path.write_text(page(log), encoding="utf-8")
    return path


def page(log: FlightLog) -> Html:
    """The report as one HTML document."""
    figures, line = figures_of(log), timeline(log)
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", name_="viewport", content="width=device-width, initial-scale=1"),
        tag("meta", http_equiv="Content-Security-Policy", content=_POLICY),
        tag("title", f"{log.header.name}: flight report"),
        tag("style", Html(colors() + asset("space.css") + asset("page.css"))),
    )
    body = tag(
        "body",
        tag("main", *_content(log, figures, line)),
        tag("script", Html(asset("page.js"))),
        data_begin=repr(line.axis.low),
        data_end=repr(line.axis.high),
    )
    return joined([Html("<!DOCTYPE html>\n"), tag("html", head, body, lang="en")])


def _content(log: FlightLog, figures: FlightFigures, line: Timeline) -> list[Html]:
    plots = [panel_html(panel, line) for panel in panels(log)]
    plots.append(lateness_html(log.series.lateness_s, figures.missed_ticks))
    return [
        sections.heading(log, figures),
        sections.warnings(log),
        sections.tiles(figures),
        tag(
            "div",
            _path(log, line),
            *plots,
            sections.phase_table(figures),
            sections.waypoint_table(log, figures),
            sections.finding_table(log),
            sections.configuration(log),
            class_="panels",
        ),
        tag("footer", f"Made by lcd-flight {log.header.versions.get('lcd-flight', '')} from {log.path.name}."),
    ]


def _path(log: FlightLog, line: Timeline) -> Html:
    """The path, its legend and the slider that moves through the flight."""
    keys = [("flown", "flown"), ("reference", "reference")]
    if baselines(log.header.plan):
        keys.append(("baseline", "minimum snap"))
    slider = tag(
        "input",
        type="range",
        min=repr(line.axis.low),
        max=repr(line.axis.high),
        step="0.01",
        value=repr(line.axis.low),
        aria_label="time in the flight",
    )
    return tag(
        "figure",
        tag("figcaption", "Path"),
        tag("div", *(tag("span", tag("i", class_=f"key {style}"), name) for style, name in keys), class_="keys"),
        path_drawing(log),
        tag("div", slider, tag("output"), class_="player"),
        tag("p", "Drag to turn, Ctrl and wheel to zoom, double-click to go back.", class_="note"),
        class_="panel wide",
    )
