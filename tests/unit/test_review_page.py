"""The report: whole, self-contained, and harmless whatever a log says."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import synthetic_flight
from synthetic_flight import log_of

from lcd_flight.model import Finding, FlightPlan, Geofence, PoseReport, Severity
from lcd_flight.record import FlightLog, Series, TimedFinding
from lcd_flight.review import write_page, write_path_figure
from lcd_flight.review.page import page
from lcd_flight.review.plots import panels
from lcd_flight.review.space import space_of
from lcd_flight.review.timeline import timeline
from lcd_flight.review.view import HEIGHT, WIDTH, View, path_drawing

EVIL = "<script>alert('x')</script>"


class Outline(HTMLParser):
    """Which tags there are, and whether each is closed."""

    EMPTY = frozenset({"meta", "input"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, dict(attrs)))
        if tag not in self.EMPTY:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)

    def count(self, tag: str, style: str = "") -> int:
        return sum(name == tag and style in ["", *(attrs.get("class") or "").split()] for name, attrs in self.seen)


def outline(html: str) -> Outline:
    parser = Outline()
    parser.feed(html)
    assert parser.open == []
    return parser


@pytest.fixture(scope="module")
def log() -> FlightLog:
    gap = Finding("pose_gap", Severity.WARN, "pose gap 42 ms (limit 300 ms)")
    return log_of(synthetic_flight.with_finding(synthetic_flight.flight(), 500, 504, gap))


def test_all_that_belongs_on_the_page_is_there(log: FlightLog) -> None:
    html = page(log)
    found = outline(html)
    words = " ".join(found.text)
    for title in ("Position error", "Position", "Velocity", "Attitude", "Body rates", "Thrust and saturation"):
        assert title in found.text
    for title in ("Battery", "Motion capture", "Loop timing", "Phases", "Waypoints", "Findings", "Configuration"):
        assert title in found.text
    assert "four-waypoint test" in found.text
    assert "landed" in found.text
    assert "1.5 m: crash bound, land at once" in found.text
    assert "pose_gap: pose gap 42 ms (limit 300 ms)" in found.text
    assert "0.250 m" in found.text  # the rehearsal's
    assert "0123abcd" in words  # the model's hash
    assert found.count("g", "trace") >= 20
    assert found.count("polyline", "baseline") == 1
    assert found.count("g", "waypoint") == 4


def test_it_is_one_small_file_that_loads_nothing(log: FlightLog, tmp_path: Path) -> None:
    path = write_page(log, tmp_path / "report.html")
    html = unescape(path.read_text(encoding="utf-8"))
    assert path.stat().st_size < 450_000
    assert not [attrs for _, attrs in outline(path.read_text(encoding="utf-8")).seen if {"src", "href"} & set(attrs)]
    assert "url(" not in html
    assert "@import" not in html
    assert "default-src 'none'" in html


def ten_minutes(log: FlightLog) -> FlightLog:
    """60,000 ticks of the flight over and over, with noise on all that is measured, which packs worst."""
    rng = np.random.default_rng(11)
    order = np.resize(np.arange(320, 770), 60_000)
    order[:320], order[-200:] = np.arange(320), np.arange(770, 970)
    columns = {name: getattr(log.series, name)[order] for name in type(log.series).__slots__}
    for name, values in columns.items():
        if values.dtype.kind == "f":
            spread = np.ptp(values[np.isfinite(values)]) or 1.0
            columns[name] = values + spread * rng.uniform(size=values.shape)
    time_s = np.arange(60_000) * 0.01
    columns |= {"time_s": time_s, "now_ns": (1e9 * time_s).astype(np.int64), "leg_time_s": log.series.leg_time_s[order]}
    columns["saturated"] = rng.uniform(size=60_000) < 0.05
    return replace(log, series=Series(**columns))


def test_ten_minutes_of_noise_are_below_two_megabytes(log: FlightLog, tmp_path: Path) -> None:
    path = write_page(ten_minutes(log), tmp_path / "long.html")
    assert path.stat().st_size < 2_000_000


def test_nothing_in_a_log_becomes_markup() -> None:
    finding = Finding(EVIL, Severity.KILL, EVIL)
    pairs = synthetic_flight.with_finding(synthetic_flight.flight(), 300, 310, finding)
    vehicle = replace(synthetic_flight.header().vehicle, name=EVIL)
    html = page(
        log_of(
            pairs,
            name=EVIL,
            mission_text=EVIL,
            link=EVIL,
            planner=EVIL,
            vehicle=vehicle,
            model_card={EVIL: EVIL},
            notes={EVIL: EVIL},
            versions={EVIL: EVIL},
        )
    )
    assert EVIL not in html
    assert outline(html).count("script") == 2  # ours, and the samples


def test_a_monitor_that_flickers_does_not_fill_the_page(log: FlightLog) -> None:
    flicker = [
        TimedFinding(t, t + 0.004, Finding("link_loss", Severity.WARN, f"loses {n} %"))
        for n, t in enumerate(np.linspace(1.0, 9.0, 3000).tolist())
    ]
    worst = TimedFinding(8.9, 8.9, Finding("fence", Severity.LAND, "0.1 m outside"))
    html = page(replace(log, findings=(*flicker, worst)))
    assert len(html) < len(page(log)) + 400_000
    assert "fence: 0.1 m outside" in html
    assert "2601 more are in the log" in html
    assert "fence: 0.1 m outside (and " in html  # the mark of the worst one stands for those around it
    assert outline(html).count("i", "flag") <= 151


def test_a_cut_log_says_so(log: FlightLog) -> None:
    cut = replace(log, complete=False)
    assert "This log was cut" in page(cut)
    assert "lacks 42 ticks within" in page(replace(log, missing_ticks=42))
    assert "lacks" not in page(cut)
    assert "This log was cut" not in page(log)


@pytest.mark.parametrize("ticks", [1, 2, 15, 25])
def test_the_shortest_logs_have_a_page(ticks: int) -> None:
    html = page(log_of(synthetic_flight.flight()[:ticks]))
    assert "not flown" in html or "log ends in flight" in html
    outline(html)


def test_a_flight_without_pose_telemetry_and_model_has_a_page() -> None:
    blind = []
    for inputs, tick in synthetic_flight.flight():
        link = replace(inputs.link, telemetry=None)
        without = replace(inputs, pose=PoseReport(None, None), link=link)
        blind.append((without, replace(tick, position_error_W=None)))
    html = page(log_of(blind, model_card={}, predicted_max_error_m=None))
    assert "Battery" not in outline(html).text
    shown, _, _ = html.partition("<script")
    assert not re.search(r"\bnan\b", shown, re.IGNORECASE)


def test_a_wait_on_the_ground_is_not_shown() -> None:
    pairs = synthetic_flight.flight()
    waiting_ns = 60_000_000_000
    flown = [(i, replace(t, now_ns=t.now_ns + (waiting_ns if t.sequence > 5 else 0))) for i, t in pairs]
    log = log_of(flown)
    assert timeline(log).axis.low == pytest.approx(60.2 - 2.0)


def test_every_time_axis_has_phases_findings_and_gaps() -> None:
    gap = Finding("pose_gap", Severity.WARN, "pose gap 42 ms (limit 300 ms)")
    pairs = synthetic_flight.with_finding(synthetic_flight.flight(), 500, 504, gap)
    html = page(log_of([pair for pair in pairs if not 600 <= pair[1].sequence < 650]))
    charts = re.findall(r"<svg [^>]*data-low.*?</svg>", html, re.DOTALL)
    assert len(charts) >= 20
    for chart in charts:
        assert chart.count('class="band trajectory"') == 1
        assert chart.count('class="flag warn"') == 1
        assert chart.count('class="band missing"') == 1


def test_saturation_shades_thrust_and_motors() -> None:
    pairs = [(i, replace(t, saturated=400 <= t.sequence < 450)) for i, t in synthetic_flight.flight()]
    html = page(log_of(pairs))
    (rect, again) = re.findall(r"<rect [^>]*saturated[^>]*>", html)
    assert rect == again
    width = float(re.search(r' width="([\d.]+)"', rect)[1])  # type: ignore[index]
    assert width / 2000 * 9.7 == pytest.approx(0.5, abs=0.02)


def test_every_chart_shares_the_flights_time(log: FlightLog) -> None:
    for panel in panels(log):
        for chart in panel.charts:
            for trace in chart.traces:
                assert len(trace.values) == len(log.series)


# The path


def test_up_is_up_and_the_middle_is_the_middle() -> None:
    view = View((1.0, 2.0, 3.0), 100.0)
    ((x, y), (x_above, y_above)) = view.project(np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 4.0]])).tolist()
    assert (x, y) == (WIDTH / 2, HEIGHT / 2)
    assert x_above == x
    assert y_above < y


def test_lengths_are_true_where_they_lie_across() -> None:
    """The drawing is orthographic: it turns, scales and drops one direction, so no length grows."""
    view = View((0.0, 0.0, 0.0), 50.0)
    axes = view.project(np.eye(3)) - (WIDTH / 2, HEIGHT / 2)
    assert np.sum(axes**2) == pytest.approx(2.0 * 50.0**2)


def drawn(log: FlightLog) -> list[ET.Element]:
    return list(ET.fromstring(path_drawing(space_of([log], [0.0]))))  # noqa: S314 - made here


def test_the_whole_path_is_in_the_drawing(log: FlightLog) -> None:
    for name in ("path flown", "reference", "baseline"):
        (line,) = (element for element in drawn(log) if element.get("class") == name)
        places = np.array([point.split(",") for point in line.get("points", "").split()], dtype=float)
        assert len(places) > 50
        assert (places.min(axis=0) > 0.0).all()
        assert (places.max(axis=0) < (WIDTH, HEIGHT)).all()


def test_shapes_carry_their_points_for_the_script(log: FlightLog) -> None:
    (waypoint, *_others) = (element for element in drawn(log) if element.get("class") == "waypoint")
    assert waypoint.get("data-xyz") == "0,0,1000"
    for element in drawn(log):
        points = element.get("points")
        if points is not None:
            assert len(points.split()) == len(element.get("data-xyz", "").split())


def test_saturated_stretches_are_marked_on_the_path() -> None:
    pairs = [(i, replace(t, saturated=400 <= t.sequence < 450)) for i, t in synthetic_flight.flight()]
    (row,) = space_of([log_of(pairs)], [0.0]).flown
    (piece,) = row.saturated
    assert len(piece) == pytest.approx(50, abs=1)
    assert drawn(log_of(pairs))[-1].get("class") == "now flown"
    assert sum(element.get("class") == "hot" for element in drawn(log_of(pairs))) == 1


def test_the_fence_is_drawn_where_it_is_near(log: FlightLog) -> None:
    fence = log.header.limits.geofence
    space = space_of([log], [0.0])
    assert space.fenced
    assert (tuple(space.low), tuple(space.high)) == (fence.low_m, fence.high_m)
    far = replace(log.header.limits, geofence=Geofence((-90.0, -90.0, 0.0), (90.0, 90.0, 90.0)))
    assert not space_of([log_of(synthetic_flight.flight(), limits=far)], [0.0]).fenced


def test_the_still_is_a_picture_of_its_own(log: FlightLog, tmp_path: Path) -> None:
    path = write_path_figure(log, tmp_path / "path.svg")
    text = path.read_text(encoding="utf-8")
    picture = ET.fromstring(text)  # noqa: S314 - made here
    assert picture.tag == "{http://www.w3.org/2000/svg}svg"
    assert "prefers-color-scheme: dark" in text
    assert "largest error 0.10 m" in text
    assert path.stat().st_size < 150_000


def test_a_minimum_snap_plan_is_not_compared_with_itself() -> None:
    legs = [replace(leg, baseline=leg.trajectory) for leg in synthetic_flight.plan().legs]
    log = log_of(synthetic_flight.flight(), plan=FlightPlan(tuple(legs)), predictions=())
    assert outline(page(log)).count("polyline", "baseline") == 0
    assert "minimum snap" not in page(log)


def test_virtual_time_is_not_praised_for_being_punctual() -> None:
    pairs = [(replace(i, deadline_ns=i.now_ns), t) for i, t in synthetic_flight.flight()]
    assert "971 ticks in virtual time, where none can be late." in page(log_of(pairs))
