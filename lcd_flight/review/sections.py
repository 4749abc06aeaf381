"""The page's words and tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import msgspec

from lcd_flight.drawing.html import Html, joined, tag
from lcd_flight.drawing.scale import MINUS
from lcd_flight.model import Outcome, Severity
from lcd_flight.record import FlightLog, TimedFinding
from lcd_flight.review.figures import FlightFigures

_VERDICTS = {Outcome.LANDED: "good", Outcome.ABORTED: "warn", Outcome.CRASHED: "bad", Outcome.CUT: "bad"}
_SEVERITIES = {Severity.INFO: "info", Severity.WARN: "warn"}
_MOST_FINDINGS = 400
"""Rows of their table."""
NOTHING = "\N{EN DASH}"


def heading(log: FlightLog, figures: FlightFigures) -> Html:
    """Name, verdict, and what flew when."""
    header = log.header
    word = "log ends in flight" if figures.outcome is None and figures.duration_s else "not flown"
    verdict = word if figures.outcome is None else figures.outcome.value
    style = "warn" if figures.outcome is None else _VERDICTS.get(figures.outcome, "")
    facts = f"{header.vehicle.name} on {header.link}, {header.planner} plan, {header.started:%Y-%m-%d %H:%M:%S %Z}"
    return tag(
        "header",
        tag("h1", header.name),
        tag("span", verdict, class_=f"badge {style}"),
        tag("p", facts),
    )


def warnings(log: FlightLog, *, named: bool = False) -> Html:
    """What the reader must know before believing the rest; `named`: of which log."""
    which = log.path.name if named else "This log"
    words = []
    if not log.complete:
        words.append(f"{which} was cut: the last moments before the cut may be missing.")
    if log.missing_ticks:
        words.append(
            f"{which} lacks {log.missing_ticks} ticks within: there was no room to log them, or it is damaged."
        )
    return joined(tag("p", text, class_="alert") for text in words)


def tiles(figures: FlightFigures) -> Html:
    """The numbers that matter most; the script goes to the moment of the largest error where that is clicked."""
    reached = [error for error in figures.waypoint_errors_m if error is not None]
    shown = [
        ("RMS error on the trajectories", metres(figures.position_rmse_m)),
        ("largest error on the trajectories", metres(figures.max_position_error_m)),
        ("largest error in rehearsal", metres(figures.predicted_max_error_m)),
        (f"worst of {len(reached)}/{len(figures.waypoint_errors_m)} waypoints", metres(max(reached, default=None))),
        ("of the flight saturated", share(figures.saturation_share)),
        ("in the air", f"{figures.duration_s:.1f} s"),
        ("top speed", number(figures.max_speed, "m/s")),
        ("attitude late by", milliseconds(figures.attitude_lag_s)),
        (f"of {figures.ticks} ticks missed", str(figures.missed_ticks)),
        ("lowest battery", number(figures.battery_min_V, "V")),
    ]
    worst_s = {shown[1][0]: figures.max_position_error_time_s}
    return tag("section", *(_tile(name, value, worst_s.get(name)) for name, value in shown), class_="tiles")


def phase_table(figures: FlightFigures) -> Html:
    """A row for each phase; the script zooms to the one that is clicked."""
    rows = [
        row_of(
            (
                row.name,
                f"{row.begin_s:.2f} s",
                f"{row.duration_s:.2f} s",
                metres(row.rmse_m),
                metres(row.max_error_m),
                number(row.max_speed, "m/s"),
                share(row.saturation_share),
            ),
            data_begin=f"{row.begin_s:.3f}",
            data_end=f"{row.begin_s + row.duration_s:.3f}",
            data_zoom=True,
        )
        for row in figures.phases
    ]
    head = ("phase", "begins", "lasts", "RMS error", "largest error", "top speed", "saturated")
    return card("Phases", table(head, rows))


def segment_table(figures: FlightFigures) -> Html:
    """A row for each segment: what the planner expected and what came."""
    predictions = {
        "predicted": [row.predicted_m for row in figures.segments],
        "measured": [row.measured_m for row in figures.segments],
        "minimum snap predicted": [row.minimum_snap_predicted_m for row in figures.segments],
    }
    known = {name: values for name, values in predictions.items() if any(value is not None for value in values)}
    if not known:
        return Html("")
    names = [f"{row.segment + 1} of {_segments(figures, row.leg)}" for row in figures.segments]
    rows = [row_of((name, *map(metres, values))) for name, *values in zip(names, *known.values(), strict=True)]
    head = ("segment", *known)
    words = "Largest errors as the tracking cost means them: with a share of the yaw error, from 1 cm to 5 m."
    return card("Tracking cost", table(head, rows), tag("p", words, class_="note"))


def waypoint_table(log: FlightLog, figures: FlightFigures) -> Html:
    """A row for each waypoint."""
    planned = [
        (point, time_s)
        for leg in log.header.plan.legs
        if leg.waypoints is not None
        for point, time_s in zip(leg.waypoints.tolist(), leg.trajectory.knot_times_s.tolist(), strict=False)
    ]
    rows = [
        row_of((str(n), *(f"{value:.2f}".replace("-", MINUS) for value in point[:3]), f"{time_s:.2f} s", metres(error)))
        for n, ((point, time_s), error) in enumerate(zip(planned, figures.waypoint_errors_m, strict=False), start=1)
    ]
    return card("Waypoints", table(("waypoint", "x, m", "y, m", "z, m", "planned at", "distance then"), rows))


def finding_table(log: FlightLog) -> Html:
    """A row for each finding; the script goes to the time of the one that is clicked."""
    if not log.findings:
        return card("Findings", tag("p", "None: nothing was out of the ordinary.", class_="note"), wide=True)
    shown = sorted(sorted(log.findings, key=_by_severity)[:_MOST_FINDINGS], key=lambda found: found.begin_s)
    rows = [
        tag(
            "tr",
            tag("td", f"{found.begin_s:.2f} s"),
            tag("td", found.finding.severity.name.lower(), class_=_SEVERITIES.get(found.finding.severity, "severe")),
            tag("td", f"{found.end_s - found.begin_s:.2f} s" if found.end_s > found.begin_s else "one tick"),
            tag("td", f"{found.finding.code}: {found.finding.message}", class_="text"),
            data_begin=f"{found.begin_s:.3f}",
            data_end=f"{found.end_s:.3f}",
        )
        for found in shown
    ]
    left_out = len(log.findings) - len(shown)
    note = tag("p", f"{left_out} more are in the log; the most severe are shown.", class_="note") if left_out else None
    head = tag("tr", *(tag("th", text) for text in ("at", "severity", "lasted")), tag("th", "what", class_="text"))
    return card("Findings", tag("div", tag("table", head, *rows), class_="scroll"), note, wide=True)


def configuration(log: FlightLog) -> Html:
    """What flew, with what, and on what."""
    header = log.header
    vehicle = header.vehicle
    facts = {
        "link": header.link,
        "seed": str(header.seed),
        "planner": header.planner,
        **header.notes,
        "vehicle": f"{vehicle.name}, {1e3 * vehicle.mass_kg:.4g} g, thrust to weight {vehicle.thrust_to_weight:.2f}",
        "log": str(log.path.name),
    }
    return card(
        "Configuration",
        definitions(facts),
        _folded("Mission", header.mission_text),
        _folded("Model", _json(header.model_card)),
        _folded("Vehicle", _json(vehicle)),
        _folded("Safety limits", _json(header.limits)),
        _folded("Versions and machine", "\n".join(f"{key}: {value}" for key, value in header.versions.items())),
        wide=True,
    )


def card(title: str, *content: Html | None, wide: bool = False) -> Html:
    """A titled box."""
    return tag("section", tag("h2", title), *content, class_="card wide" if wide else "card")


def table(head: Sequence[str], rows: Iterable[Html]) -> Html:
    """A table that scrolls sideways on its own."""
    return tag("div", tag("table", tag("tr", *(tag("th", text) for text in head)), *rows), class_="scroll")


def row_of(cells: Iterable[str], **attributes: str | bool) -> Html:
    """A row of a table."""
    return tag("tr", *(tag("td", cell) for cell in cells), **attributes)


def definitions(facts: Mapping[str, str]) -> Html:
    """Names and values."""
    return tag("dl", *(part for key, value in facts.items() for part in (tag("dt", key), tag("dd", value))))


def metres(value: float | None) -> str:
    """A distance as a person says it."""
    return NOTHING if value is None else f"{value:.3f} m"


def number(value: float | None, unit: str) -> str:
    """A value with its unit."""
    return NOTHING if value is None else f"{value:.2f} {unit}"


def milliseconds(value_s: float | None) -> str:
    """A short time."""
    return NOTHING if value_s is None else f"{1e3 * value_s:.0f} ms"


def share(value: float | None) -> str:
    """A share in per cent."""
    return NOTHING if value is None else f"{100.0 * value:.1f} %"


def _by_severity(found: TimedFinding) -> tuple[int, float]:
    return -found.finding.severity, found.begin_s


def _tile(name: str, value: str, time_s: float | None) -> Html:
    when = None if time_s is None else f"{time_s:.3f}"
    return tag("div", tag("b", value), tag("span", name), class_="tile", data_begin=when, data_end=when)


def _segments(figures: FlightFigures, leg: int) -> int:
    return sum(row.leg == leg for row in figures.segments)


def _folded(title: str, text: str) -> Html:
    return tag("details", tag("summary", title), tag("pre", text))


def _json(value: Any) -> str:
    return msgspec.json.format(msgspec.json.encode(value), indent=2).decode()
