"""The tables of a comparison: figures side by side, what was configured differently, and what was found."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from lcd_flight.drawing.html import Html, tag
from lcd_flight.model.types import FloatArray
from lcd_flight.record import FlightLog
from lcd_flight.review import sections
from lcd_flight.review.chart import Trace
from lcd_flight.review.figures import FlightFigures
from lcd_flight.review.space import COLORS


@dataclass(frozen=True, slots=True, eq=False)
class ComparedFlight:
    """One of several flights."""

    number: int
    log: FlightLog
    figures: FlightFigures
    time_s: FloatArray
    """(T,) zero where the mission's first trajectory begins."""

    @property
    def style(self) -> str:
        """Its colour's CSS class."""
        return COLORS[self.number % len(COLORS)]

    @property
    def name(self) -> str:
        """Short, and of its own."""
        return f"{self.number + 1} {self.log.path.stem}"

    def trace(self, values: FloatArray, role: str = "") -> Trace:
        """Its line in a chart."""
        known_as = f"{self.number}/{role}" if role else ""
        return Trace(str(self.number + 1), self.time_s, values, self.style, known_as)


_Show = Callable[[float | None], str]

_ROWS: tuple[tuple[str, Callable[[FlightFigures], float | None], _Show], ...] = (
    ("RMS error on the trajectories", lambda f: f.position_rmse_m, sections.metres),
    ("largest error on the trajectories", lambda f: f.max_position_error_m, sections.metres),
    ("largest error in rehearsal", lambda f: f.predicted_max_error_m, sections.metres),
    ("largest error of the flight", lambda f: f.overall_max_error_m, sections.metres),
    ("worst waypoint", lambda f: max((e for e in f.waypoint_errors_m if e is not None), default=None), sections.metres),
    ("tracking cost of the worst segment", lambda f: _worst(f, "measured_m"), sections.metres),
    ("the same, as the planner predicted", lambda f: _worst(f, "predicted_m"), sections.metres),
    ("saturated", lambda f: f.saturation_share, sections.share),
    ("attitude late by", lambda f: f.attitude_lag_s, sections.milliseconds),
    ("lateness of ticks, 99 %", lambda f: f.lateness_p99_s, lambda v: sections.number(v and 1e3 * v, "ms")),
    ("greatest age of the pose", lambda f: f.pose_age_max_s, sections.milliseconds),
)
"""Name, figure and how it is said; less is better in all of them."""

_PLAIN: tuple[tuple[str, Callable[[FlightFigures], str]], ...] = (
    ("outcome", lambda f: "log ends in flight" if f.outcome is None else f.outcome.value),
    ("in the air", lambda f: f"{f.duration_s:.1f} s"),
    ("top speed", lambda f: sections.number(f.max_speed, "m/s")),
    ("lowest battery", lambda f: sections.number(f.battery_min_V, "V")),
    ("missed ticks", lambda f: str(f.missed_ticks)),
    ("poses lost, late, rejected", lambda f: f"{f.pose_lost}, {f.pose_late}, {f.pose_rejected}"),
    ("packets lost", lambda f: str(f.link_lost)),
)


def _worst(figures: FlightFigures, attribute: str) -> float | None:
    values = (getattr(row, attribute) for row in figures.segments)
    return max((value for value in values if value is not None), default=None)


def figures_table(flights: Sequence[ComparedFlight]) -> Html:
    """A row for each figure; the least of each row stands out."""
    rows = [_row(name, [text(flight.figures) for flight in flights]) for name, text in _PLAIN[:1]]
    for name, figure, show in _ROWS:
        values = [figure(flight.figures) for flight in flights]
        known = [value for value in values if value is not None]
        best = min(known) if len(set(known)) > 1 else None
        cells = [tag("b", show(value)) if value is not None and value == best else show(value) for value in values]
        rows.append(_row(name, cells))
    rows += [_row(name, [text(flight.figures) for flight in flights]) for name, text in _PLAIN[1:]]
    return sections.card(
        "Figures", _table(flights, rows), tag("p", "Bold: the least of the row.", class_="note"), wide=True
    )


def differences_table(flights: Sequence[ComparedFlight]) -> Html:
    """What was configured differently; what is equal is not shown."""
    facts = [_configuration(flight.log) for flight in flights]
    keys = dict.fromkeys(key for fact in facts for key in fact)
    rows = [
        tag("tr", tag("td", key), *(tag("td", fact.get(key, sections.NOTHING), class_="words") for fact in facts))
        for key in keys
        if len({fact.get(key) for fact in facts}) > 1
    ]
    if not rows:
        return sections.card("Configuration", tag("p", "The same in all of them.", class_="note"), wide=True)
    return sections.card("Configuration: what differs", _table(flights, rows), wide=True)


def _configuration(log: FlightLog) -> dict[str, str]:
    header = log.header
    return {
        "mission": header.name,
        "mission file": _fingerprint(header.mission_text),
        "link": header.link,
        "seed": str(header.seed),
        "planner": header.planner,
        "model": _fingerprint(repr(sorted(header.model_card.items()))) if header.model_card else sections.NOTHING,
        "vehicle": f"{header.vehicle.name}, {_fingerprint(repr(header.vehicle))}",
        "safety limits": _fingerprint(repr(header.limits)),
        **header.notes,
        **header.versions,
    }


def findings_table(flights: Sequence[ComparedFlight]) -> Html:
    """A row for each kind of finding: how often each flight had it."""
    codes = dict.fromkeys(found.finding.code for flight in flights for found in flight.log.findings)
    if not codes:
        return sections.card("Findings", tag("p", "None in any of them.", class_="note"), wide=True)
    rows = [_row(code, [_times(flight.log, code) for flight in flights]) for code in codes]
    return sections.card("Findings", _table(flights, rows), wide=True)


def _times(log: FlightLog, code: str) -> str:
    """How often, and for how long."""
    found = [row for row in log.findings if row.finding.code == code]
    if not found:
        return sections.NOTHING
    return f"{len(found)} \N{MULTIPLICATION SIGN}, {sum(row.end_s - row.begin_s for row in found):.2f} s"


def _table(flights: Sequence[ComparedFlight], rows: Iterable[Html]) -> Html:
    heads = [tag("th", tag("i", class_=f"key {flight.style}"), str(flight.number + 1)) for flight in flights]
    return tag("div", tag("table", tag("tr", tag("th", ""), *heads), *rows, class_="compared"), class_="scroll")


def _row(name: str, cells: Sequence[str]) -> Html:
    return sections.row_of([name, *cells])


def _fingerprint(text: str) -> str:
    """Tells texts apart."""
    return hashlib.sha256(text.encode()).hexdigest()[:8]
