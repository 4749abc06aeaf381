"""Several flights on one page: laid over each other, and their numbers side by side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from lcd_flight.drawing.html import Html, tag
from lcd_flight.drawing.scale import Axis, axis_around
from lcd_flight.files import write_whole
from lcd_flight.model.types import FloatArray
from lcd_flight.record import FlightLog
from lcd_flight.review import sections
from lcd_flight.review.chart import Chart, Panel, panel_html
from lcd_flight.review.compare_tables import ComparedFlight, differences_table, figures_table, findings_table
from lcd_flight.review.document import document
from lcd_flight.review.figures import figures_of
from lcd_flight.review.kinematics import euler_deg, thrust_direction_error_rad
from lcd_flight.review.page import path_panel
from lcd_flight.review.plots import ANGLES, AXES, LEAST_ERROR_M, error_axis, error_rules
from lcd_flight.review.space import Space, space_of
from lcd_flight.review.timeline import common_timeline, zero_s


def write_comparison(logs: Sequence[FlightLog], path: Path) -> Path:
    """Write one page of several flights and return its path.

    Raises:
        InputError: the file cannot be written.
    """
    write_whole(path, comparison(logs))
    return path


def comparison(logs: Sequence[FlightLog]) -> Html:
    """The page of at least two flights as one HTML document; 0 s is where each one's first trajectory begins."""
    zeros_s = [zero_s(log) for log in logs]
    flights = [
        ComparedFlight(number, log, figures_of(log), log.series.time_s - zero)
        for number, (log, zero) in enumerate(zip(logs, zeros_s, strict=True))
    ]
    line, shown = common_timeline(logs), list(_panels(flights))
    content = [
        tag("header", tag("h1", f"{len(logs)} flights"), _names(flights)),
        *(sections.warnings(log, named=True) for log in logs),
        tag(
            "div",
            figures_table(flights),
            _path(flights, space_of(logs, zeros_s)),
            *(panel_html(panel, line) for panel in shown),
            differences_table(flights),
            findings_table(flights),
            class_="panels",
        ),
        tag("footer", "0 s: the begin of the first trajectory. The phases shown are those of flight 1."),
    ]
    missions = ", ".join(sorted({log.header.name for log in logs}))
    return document(f"{len(logs)} flights: {missions}", content, shown, line)


def _names(flights: Sequence[ComparedFlight]) -> Html:
    """Which number and colour is which flight."""
    rows = (tag("span", tag("i", class_=f"key {flight.style}"), flight.name) for flight in flights)
    return tag("p", *rows, class_="keys")


def _path(flights: Sequence[ComparedFlight], space: Space) -> Html:
    keys = [(flight.style, str(flight.number + 1)) for flight in flights] + [("reference", "reference")]
    if space.fenced:
        keys.append(("fence", "fence of flight 1"))
    return path_panel(space, keys)


def _panels(flights: Sequence[ComparedFlight]) -> Iterator[Panel]:
    series = [flight.log.series for flight in flights]
    errors_m = [np.maximum(row.error_m, LEAST_ERROR_M) for row in series]
    traces = [flight.trace(values) for flight, values in zip(flights, errors_m, strict=True)]
    rules = error_rules(flights[0].log)
    distance = Chart("Distance from the reference", "m, by powers of ten", traces, error_axis(*errors_m), rules)
    yield Panel("Position error", [distance], wide=True)
    positions = [_around(flights, [row.p_WB[:, n] for row in series], name, "m", name) for n, name in enumerate(AXES)]
    yield Panel("Position", positions)
    attitudes = [euler_deg(row.q_WB) for row in series]
    angles = [_around(flights, [row[:, n] for row in attitudes], name, "°", name) for n, name in enumerate(ANGLES)]
    yield Panel("Attitude", angles)
    speeds = [np.linalg.norm(row.v_WB_W, axis=1) for row in series]
    yield Panel("Speed", [_upwards(flights, speeds, "Speed", "m/s")])
    behind = [np.degrees(thrust_direction_error_rad(row)) for row in series]
    yield Panel("Attitude lag", [_upwards(flights, behind, "Thrust direction to its setpoint", "°")])
    yield Panel("Thrust", [_upwards(flights, [row.setpoint_thrust_N for row in series], "Collective thrust", "N")])
    yield Panel("Battery", [_around(flights, [row.battery_V for row in series], "Battery", "V")])
    ages_ms = [1e3 * row.pose_age_s for row in series]
    yield Panel("Motion capture", [_upwards(flights, ages_ms, "Age of the pose", "ms")])
    late_ms = [1e3 * row.lateness_s for row in series]
    yield Panel("Loop", [_upwards(flights, late_ms, "Lateness of ticks", "ms")])


def _around(
    flights: Sequence[ComparedFlight], columns: Sequence[FloatArray], name: str, unit: str, role: str = ""
) -> Chart:
    traces = [flight.trace(values, role) for flight, values in zip(flights, columns, strict=True)]
    return Chart(name, unit, traces, axis_around(*columns, least=0.2))


def _upwards(flights: Sequence[ComparedFlight], columns: Sequence[FloatArray], name: str, unit: str) -> Chart:
    traces = [flight.trace(values) for flight, values in zip(flights, columns, strict=True)]
    greatest = max(float(np.nanmax(values, initial=0.0)) for values in columns)
    return Chart(name, unit, traces, Axis(0.0, 1.1 * greatest or 1.0))
