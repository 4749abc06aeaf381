"""Several flights on one page: laid over each other at the same place of the mission, and told apart."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
import synthetic_flight
from synthetic_flight import TICK_NS, Pair, log_of

from lcd_flight.model import Finding, Severity
from lcd_flight.record import FlightLog
from lcd_flight.review.compare import comparison, write_comparison
from lcd_flight.review.timeline import common_timeline, timeline, zero_s

TRACK_S = 3.2
"""When the trajectory of the synthetic flight begins."""


class Rows(HTMLParser):
    """The cells of every row; bold ones in stars."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[list[str]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")
        elif tag == "b" and self.rows:
            self.handle_data("*")

    def handle_data(self, data: str) -> None:
        if self.rows and self.rows[-1]:
            self.rows[-1][-1] += data


def rows_of(html: str) -> dict[str, list[str]]:
    parser = Rows()
    parser.feed(" ".join(re.findall(r"<table[^>]*>.*?</table>", html, re.DOTALL)))
    return {row[0]: row[1:] for row in parser.rows}


def later(pairs: list[Pair], seconds: int) -> list[Pair]:
    """The same flight after a longer wait on the ground."""
    shift_ns = seconds * 100 * TICK_NS
    return [(i, replace(t, now_ns=t.now_ns + (shift_ns if t.sequence > 5 else 0))) for i, t in pairs]


def flight(distance_m: float, **changes: object) -> FlightLog:
    return log_of(synthetic_flight.flight(synthetic_flight.beside(distance_m)), **changes)


def test_figures_stand_side_by_side_and_the_least_stands_out() -> None:
    rows = rows_of(comparison([flight(0.3), flight(0.1), flight(0.2)]))
    assert rows["largest error of the flight"] == ["0.300 m", "*0.100 m", "0.200 m"]
    assert rows["outcome"] == ["landed"] * 3
    assert rows["largest error in rehearsal"] == ["0.250 m"] * 3  # where all are equal none stands out


def test_flights_are_laid_over_each_other_where_the_trajectory_begins() -> None:
    pairs = synthetic_flight.flight()
    logs = [log_of(pairs), log_of(later(pairs, 40))]
    assert [zero_s(log) for log in logs] == pytest.approx([TRACK_S, TRACK_S + 40])
    line = common_timeline(logs)
    assert line.axis.low == pytest.approx(-3.0 - 2.0)  # two seconds before the take-off of the one that waited
    assert line.axis.high == pytest.approx(9.7 - TRACK_S)
    (trajectory,) = (band for band in line.phases if band.name == "trajectory")
    assert trajectory.begin_s == pytest.approx(0.0)


def test_without_a_trajectory_it_is_the_take_off() -> None:
    assert zero_s(log_of(synthetic_flight.flight()[:100])) == pytest.approx(0.2)
    assert zero_s(log_of(synthetic_flight.flight()[:5])) == 0.0


def test_what_was_configured_differently_is_told_and_nothing_else() -> None:
    rows = rows_of(comparison([flight(0.1), flight(0.1, planner="minimum-snap", seed=8)]))
    assert rows["planner"] == ["learned", "minimum-snap"]
    assert rows["seed"] == ["7", "8"]
    assert "link" not in rows
    assert "vehicle" not in rows


def test_equal_flights_differ_in_nothing() -> None:
    assert "The same in all of them." in comparison([flight(0.1), flight(0.1)])


def test_findings_are_counted() -> None:
    gap = Finding("pose_gap", Severity.WARN, "pose gap")
    pairs = synthetic_flight.flight()
    for first in (500, 700):
        pairs = synthetic_flight.with_finding(pairs, first, first + 10, gap)
    rows = rows_of(comparison([log_of(pairs), flight(0.1)]))
    assert rows["pose_gap"] == ["2 \N{MULTIPLICATION SIGN}, 0.20 s", "\N{EN DASH}"]


def test_each_flight_has_its_colour_in_path_and_charts() -> None:
    html = comparison([flight(0.1), flight(0.2)])
    for style in "ab":
        assert f'class="path {style}"' in html
        assert f'class="now {style}"' in html
        assert f'<g class="trace {style}"' in html
    assert 'data-role="1/x"' in html


def test_a_cut_log_is_named() -> None:
    cut = replace(flight(0.1), complete=False, path=Path("cut.mcap"))
    assert "cut.mcap was cut" in comparison([flight(0.1), cut])


def test_many_flights_stay_below_two_megabytes(tmp_path: Path) -> None:
    path = write_comparison([flight(0.01 * n) for n in range(1, 13)], tmp_path / "many.html")
    assert path.stat().st_size < 2_000_000


def test_nothing_in_a_log_becomes_markup() -> None:
    evil = "<script>alert('x')</script>"
    html = comparison([flight(0.1, name=evil, notes={evil: evil}), replace(flight(0.1), path=Path(f"{evil}.mcap"))])
    assert evil not in html


def test_flights_that_never_flew_have_a_page() -> None:
    short = log_of(synthetic_flight.flight()[:5])
    assert "log ends in flight" in comparison([short, short])


def test_time_without_ticks_is_shaded() -> None:
    pairs = [pair for pair in synthetic_flight.flight() if not 400 <= pair[1].sequence < 450]
    (gap,) = timeline(log_of(pairs)).gaps
    assert (gap.begin_s, gap.end_s) == pytest.approx((3.99, 4.5))
    assert timeline(flight(0.1)).gaps == []


def test_findings_and_phases_of_one_flight_are_on_its_time() -> None:
    gap = Finding("pose_gap", Severity.LAND, "pose gap 400 ms")
    line = timeline(log_of(synthetic_flight.with_finding(synthetic_flight.flight(), 500, 504, gap)))
    (flag,) = line.flags
    assert (flag.name, flag.style) == ("pose_gap: pose gap 400 ms", "severe")
    assert flag.begin_s == pytest.approx(5.0, abs=1e-3)
    styles = {band.name: band.style for band in line.phases}
    assert styles["takeoff"] == "climb"
    assert styles["trajectory"] == "trajectory"
    assert styles["preflight"] == "ground"
