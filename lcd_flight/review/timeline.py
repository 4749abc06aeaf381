"""The time that a page shows: where it begins and ends, its phases and its findings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lcd_flight.drawing.scale import Axis
from lcd_flight.model import Phase, Severity
from lcd_flight.record import FlightLog, TimedFinding
from lcd_flight.review.chart import Band, Flag, Timeline
from lcd_flight.review.spans import Span, airborne, span_name, spans, tracking

_BEFORE_TAKEOFF_S = 2.0
"""How much of the time on the ground is shown: a pilot may have waited for minutes."""

_LONGEST_TICK_S = 0.1
"""From here on the time between two ticks is shown as a gap: twice what the flight loop counts with at most."""

_MOST_FLAGS = 150
"""Marks of findings on a time axis: a monitor that flickers for minutes must not fill the page."""

_FLAGS = {Severity.INFO: "info", Severity.WARN: "warn"}
_BANDS = {
    Phase.TAKEOFF: "climb",
    Phase.HOLD: "hover",
    Phase.LAND: "descent",
    Phase.BRAKE_HOLD: "abnormal",
    Phase.LAND_NOW: "abnormal",
    Phase.DESCEND_BLIND: "abnormal",
    Phase.HANDED_OVER: "abnormal",
    Phase.KILL: "abnormal",
    Phase.CRASHED: "abnormal",
}


def timeline(log: FlightLog) -> Timeline:
    """One flight: from just before take-off, or all of it where there was none; s since its first tick."""
    axis = Axis(*_shown(log))
    return Timeline(axis, _bands(log, axis.low, 0.0), _flags(log.findings, axis), gaps(log))


def common_timeline(logs: Sequence[FlightLog]) -> Timeline:
    """Several flights, each with its `zero_s` at 0; the phases are those of the first."""
    shown = [
        (begin_s - zero, end_s - zero) for log in logs for zero in [zero_s(log)] for begin_s, end_s in [_shown(log)]
    ]
    axis = Axis(min(begin for begin, _ in shown), max(end for _, end in shown))
    first = zero_s(logs[0])
    return Timeline(axis, _bands(logs[0], axis.low + first, first), ())


def gaps(log: FlightLog) -> list[Band]:
    """Where ticks are missing: missed, not logged for want of room, or lost to damage."""
    time_s = log.series.time_s
    before = np.flatnonzero(np.diff(time_s) > _LONGEST_TICK_S)
    return [Band("no ticks", float(time_s[n]), float(time_s[n + 1]), "missing") for n in before.tolist()]


def zero_s(log: FlightLog) -> float:
    """What flights are laid over each other by: the start of the mission's first trajectory, else of the flight."""
    for ticks in (tracking(log), airborne(log.series)):
        if ticks.any():
            return float(log.series.time_s[int(np.argmax(ticks))])
    return 0.0


def _shown(log: FlightLog) -> tuple[float, float]:
    time_s, flying = log.series.time_s, airborne(log.series)
    begin_s = max(0.0, float(time_s[int(np.argmax(flying))]) - _BEFORE_TAKEOFF_S) if flying.any() else 0.0
    return begin_s, max(float(time_s[-1]), begin_s + 0.1)


def _bands(log: FlightLog, begin_s: float, zero: float) -> list[Band]:
    return [
        Band(span_name(span, log.header.plan), max(span.begin_s, begin_s) - zero, span.end_s - zero, _style(span, log))
        for span in spans(log.series)
        if span.end_s > begin_s
    ]


def _style(span: Span, log: FlightLog) -> str:
    if span.phase is Phase.TRACK:
        return span_name(span, log.header.plan)
    return _BANDS.get(span.phase, "ground")


def _flags(findings: Sequence[TimedFinding], axis: Axis) -> list[Flag]:
    """Of findings that begin too near to each other to be told apart: the most severe, and how many more there are."""
    together: dict[int, list[TimedFinding]] = {}
    for row in findings:
        if row.begin_s >= axis.low:
            together.setdefault(int(_MOST_FLAGS * (row.begin_s - axis.low) / (axis.high - axis.low)), []).append(row)
    return [_flag(rows) for rows in together.values()]


def _flag(rows: Sequence[TimedFinding]) -> Flag:
    worst = max(rows, key=lambda row: row.finding.severity)
    more = f" (and {len(rows) - 1} more)" if len(rows) > 1 else ""
    text = f"{worst.finding.code}: {worst.finding.message}{more}"
    return Flag(text, worst.begin_s, max(row.end_s for row in rows), _FLAGS.get(worst.finding.severity, "severe"))
