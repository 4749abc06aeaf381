"""The report in a real browser: no script error, nothing empty, and it plays, zooms, turns and reads out.

Screenshots are kept in build/review for people to look at.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import browser
import numpy as np
import pytest
import synthetic_flight
from browser import Tab
from synthetic_flight import log_of

from lcd_flight.model import Finding, Severity
from lcd_flight.record import FlightLog
from lcd_flight.review import figures_of, write_comparison, write_page

pytestmark = browser.needs_browser

PICTURES = Path(__file__).resolve().parents[2] / "build" / "review"

FINE = "document.body.classList.contains('fine')"
CLOCK = "document.querySelector('.clock').textContent"
PATH = "document.querySelector('.space .path').getAttribute('points')"
VIEW = "document.querySelector('.plot svg').getAttribute('viewBox').split(' ').map(Number)"
CLEAR = [0.0, 0.0, 2000.0, 1000.0]

FINDING_S = 5.0
GAP = Finding("pose_gap", Severity.WARN, "pose gap 42 ms (limit 300 ms)")


@pytest.fixture(scope="module")
def log() -> FlightLog:
    return log_of(synthetic_flight.with_finding(synthetic_flight.flight(), 500, 504, GAP))


@pytest.fixture(scope="module")
def report(log: FlightLog, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_page(log, tmp_path_factory.mktemp("page") / "report.html")


@pytest.fixture(scope="module")
def window(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    PICTURES.mkdir(parents=True, exist_ok=True)
    with browser.opened(tmp_path_factory.mktemp("browser")) as tab:
        yield tab


@pytest.fixture
def tab(window: Tab, report: Path) -> Iterator[Tab]:
    """The report, just opened on a desk; at the end nothing may have complained."""
    window.screen(1280, 900)
    window.open(report, FINE)
    window.settle()
    yield window
    assert window.errors == []


def numbers(points: str) -> list[float]:
    return [float(number) for number in points.replace(",", " ").split()]


def shown_s(tab: Tab, log: FlightLog) -> tuple[float, float]:
    """The window of time, from the drawing's view box."""
    left, _, width, _ = tab.ask(VIEW)
    whole_s = float(log.series.time_s[-1])
    return left / 2000 * whole_s, (left + width) / 2000 * whole_s


def middle(tab: Tab, selector: str) -> tuple[float, float, float]:
    """Middle of an element, and its width."""
    left, top, width, height = tab.box(selector)
    return left + width / 2, top + height / 2, width


def test_no_trace_is_empty_and_a_picture_is_kept(tab: Tab) -> None:
    boxes = tab.ask(
        "[...document.querySelectorAll('.trace')].map((t) => t.getBoundingClientRect()).map((b) => [b.width, b.height])"
    )
    assert len(boxes) >= 25
    assert all(width > 100 for width, _ in boxes)
    assert sum(height > 5 for _, height in boxes) >= 14
    assert tab.picture(PICTURES / "desk.png").stat().st_size > 20_000
    tab.screen(1280, tab.ask("document.documentElement.scrollHeight"))
    tab.settle()
    tab.picture(PICTURES / "desk_whole.png")
    tab.screen(1280, 900, dark=True)
    tab.settle()
    background = tab.ask("getComputedStyle(document.body).backgroundColor")
    assert max(numbers(background.strip("rgb()").replace(",", " "))) < 64.0
    tab.picture(PICTURES / "dark.png")


def test_script_and_still_draw_the_same_path(tab: Tab) -> None:
    still = tab.ask(PATH)
    tab.click("[data-do=space-top]")
    assert tab.ask(PATH) != still
    tab.click("[data-do=space-home]")
    assert numbers(tab.ask(PATH)) == pytest.approx(numbers(still), abs=0.25)


def test_the_path_turns_and_zooms(tab: Tab) -> None:
    before = tab.ask(PATH)
    x, y, _ = middle(tab, ".space")
    tab.drag(x, y, x + 80, y + 20)
    turned = tab.ask(PATH)
    assert turned != before
    tab.click("[data-do=space-in]")
    spread = [np.ptp(numbers(points)[::2]) for points in (turned, tab.ask(PATH))]
    assert spread[1] == pytest.approx(1.3 * spread[0], rel=0.01)
    tab.mouse("mouseWheel", x, y, deltaX=0, deltaY=-100, modifiers=2)
    tab.settle()
    assert np.ptp(numbers(tab.ask(PATH))[::2]) > 1.2 * spread[1]


def test_playing_moves_the_vehicle_and_the_cursors(tab: Tab) -> None:
    place = "document.querySelector('.now circle:not(.target)').getAttribute('cx')"
    cursor = "document.querySelector('.cursor').style.left"
    tab.ask("(() => { document.querySelector('.speed').value = '10'; })()")
    before = tab.ask(f"[{CLOCK}, {place}, {cursor}]")
    tab.click("[data-do=play]")
    tab.until(f"parseFloat({CLOCK}) > 4.5")
    during = tab.ask(f"[{CLOCK}, {place}, {cursor}]")
    assert all(a != b for a, b in zip(before, during, strict=True))
    tab.until(f"document.querySelector('[data-do=play]').textContent === '▶' && {CLOCK} === '9.70 s'")


def test_dragging_over_a_chart_zooms_all_of_them_and_the_path(tab: Tab, log: FlightLog) -> None:
    path = numbers(tab.ask(PATH))
    left, top, width, height = tab.box(".plot")
    tab.drag(left + 0.5 * width, top + height / 2, left + 0.6 * width, top + height / 2)
    assert shown_s(tab, log) == pytest.approx((0.5 * 9.7, 0.6 * 9.7), abs=0.03)
    boxes = tab.ask("[...document.querySelectorAll('.plot svg[data-low]')].map((s) => s.getAttribute('viewBox'))")
    assert len({box.split(" ")[0] for box in boxes}) == 1
    assert len(numbers(tab.ask(PATH))) == pytest.approx(2 * 97, abs=6)  # a point for each tick in the window
    assert np.ptp(numbers(tab.ask(PATH))[::2]) < np.ptp(path[::2])
    times = tab.ask("[...document.querySelectorAll('.times span')].slice(0, 3).map((s) => parseFloat(s.textContent))")
    assert all(4.8 < value < 5.9 for value in times)
    tab.click("[data-do=whole]")
    assert tab.ask(VIEW) == CLEAR


def test_wheel_buttons_and_keys_zoom_too(tab: Tab) -> None:
    x, y, _ = middle(tab, ".plot")
    tab.mouse("mouseMoved", x, y)
    tab.mouse("mouseWheel", x, y, deltaX=0, deltaY=-200, modifiers=2)
    tab.settle()
    by_wheel = tab.ask(VIEW)[2]
    assert by_wheel < 1000
    tab.click("[data-do=in]")
    assert tab.ask(VIEW)[2] == pytest.approx(0.6 * by_wheel, rel=1e-3)
    at = tab.ask(VIEW)[0]
    tab.click("[data-do=later]")
    assert tab.ask(VIEW)[0] > at
    tab.ask("document.activeElement.blur()")
    tab.key("0")
    assert tab.ask(VIEW) == CLEAR


def test_values_fill_the_height_where_asked_for(tab: Tab) -> None:
    height = "Number(document.querySelectorAll('.plot svg[data-low]')[2].getAttribute('viewBox').split(' ')[3])"
    tab.click("tr[data-zoom]:nth-child(4)")  # the row of the take-off: x hardly moves
    assert tab.ask(height) == 1000
    tab.click("[data-do=fit]")
    assert 0 < tab.ask(height) < 500
    labels = tab.ask(
        "[...document.querySelectorAll('.scale')[2].children].map((s) => Number(s.textContent.replace('\\u2212', '-')))"
    )
    assert len(labels) >= 3
    assert max(np.abs(labels)) <= 0.12  # 10 cm beside the reference


def test_one_instant_is_read_out_everywhere(tab: Tab, log: FlightLog) -> None:
    left, top, width, height = tab.box(".plot")
    time_s = FINDING_S + 0.1  # what was found stays to be read for a while
    tab.mouse("mouseMoved", left + width * time_s / 9.7, top + height / 2)
    tab.settle()
    assert float(tab.ask(CLOCK).removesuffix(" s")) == pytest.approx(time_s, abs=0.02)
    told = "[...document.querySelectorAll('.chart output')].map((o) => Number(o.textContent.replace('\\u2212', '-')))"
    values = tab.ask(told)
    assert values[0] == pytest.approx(0.1, rel=0.02)
    roles = tab.ask("[...document.querySelectorAll('.trace')].map((t) => t.dataset.role)")
    read = [values[roles.index(f"0/{axis}")] for axis in "xyz"]
    tick = int(np.argmin(np.abs(log.series.time_s - float(tab.ask(CLOCK).removesuffix(" s")))))
    assert read == pytest.approx(log.series.p_WB[tick].tolist(), abs=0.01)
    assert "pose gap 42 ms" in tab.ask("document.querySelector('.story').textContent")
    assert "trajectory" in tab.ask("document.querySelector('.story').textContent")


def test_a_legend_switches_its_line_off(tab: Tab) -> None:
    shown = "getComputedStyle(document.querySelector('.trace.flown')).display"
    assert tab.ask(shown) == "inline"
    tab.click(".entry:has(.flown)")
    assert tab.ask(shown) == "none"
    tab.click(".entry:has(.flown)")
    assert tab.ask(shown) == "inline"


def test_a_tile_leads_to_the_worst_moment(tab: Tab, log: FlightLog) -> None:
    tab.click(".tile[data-begin]")
    worst_s = figures_of(log).max_position_error_time_s
    assert float(tab.ask(CLOCK).removesuffix(" s")) == pytest.approx(worst_s, abs=0.006)


def test_a_finding_leads_to_its_time(tab: Tab) -> None:
    tab.click("tr[data-begin]:not([data-zoom])")
    assert float(tab.ask(CLOCK).removesuffix(" s")) == pytest.approx(FINDING_S, abs=0.02)


def test_a_phone_shows_all_and_takes_two_fingers(tab: Tab, report: Path) -> None:
    tab.screen(390, 844, phone=True)
    tab.open(report, FINE)
    tab.settle()
    assert tab.ask("document.documentElement.scrollWidth") == 390
    cut = """[...document.querySelectorAll('.phases span:not([hidden]) em:not([hidden])')].filter(
        (name) => name.offsetWidth > name.parentElement.clientWidth).map((name) => name.textContent)"""
    assert tab.ask(cut) == []
    tab.picture(PICTURES / "phone.png")
    left, top, width, height = tab.box(".plot")
    y = top + height / 2
    tab.pinch([((left + 0.4 * width, y), (left + 0.2 * width, y)), ((left + 0.6 * width, y), (left + 0.8 * width, y))])
    begin, _, length, _ = tab.ask(VIEW)
    assert length == pytest.approx(2000 / 3, rel=0.05)
    assert begin == pytest.approx(2000 / 3, rel=0.05)
    before = np.ptp(numbers(tab.ask(PATH))[::2])
    x, y, _ = middle(tab, ".space")
    tab.pinch([((x - 30, y), (x - 60, y)), ((x + 30, y), (x + 60, y))])
    assert np.ptp(numbers(tab.ask(PATH))[::2]) == pytest.approx(2.0 * before, rel=0.1)


def test_flights_are_laid_over_each_other(window: Tab, log: FlightLog, tmp_path: Path) -> None:
    other = log_of(synthetic_flight.flight(synthetic_flight.beside(0.3)), name="the other")
    page = write_comparison([log, other], tmp_path / "two.html")
    window.screen(1280, 900)
    window.open(page, FINE)
    window.settle()
    assert window.ask("document.querySelectorAll('.space .path').length") == 2
    assert window.ask("document.querySelectorAll('.space .now').length") == 2
    left, top, width, height = window.box(".plot")
    window.mouse("mouseMoved", left + width / 2, top + height / 2)
    window.settle()
    outputs = window.ask(
        "[...document.querySelectorAll('.chart output')].slice(0, 2).map((o) => Number(o.textContent))"
    )
    assert outputs == pytest.approx([0.1, 0.3], rel=0.02)
    window.picture(PICTURES / "comparison.png")
    assert window.errors == []


def test_a_browser_that_cannot_unpack_still_zooms(tab: Tab, report: Path, tmp_path: Path) -> None:
    html = report.read_text(encoding="utf-8").replace("DecompressionStream", "NoSuchStream")
    old = tmp_path / "old.html"
    old.write_text(html, encoding="utf-8")
    tab.open(old, "document.body.classList.contains('live')")
    tab.settle()
    tab.click("[data-do=in]")
    assert tab.ask(VIEW)[2] == pytest.approx(1200, rel=1e-3)
    assert len(numbers(tab.ask(PATH))) > 20
