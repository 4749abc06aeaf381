"""The page of a plan in a real browser: nothing is blocked, nothing empty, and it fits a phone, in light and dark."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from browser import Tab, needs_browser, opened
from plan_bench import VEHICLE, mission, planned

from lcd_flight.review.plan_page import write_plan_page

pytestmark = needs_browser

BOXES = "[...document.querySelectorAll('svg')].map((s) => s.getBoundingClientRect()).map((b) => [b.width, b.height])"
OVERFLOW = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
SMALLEST_WORDS = "Math.min(...[...document.querySelectorAll('svg text')].map((t) => t.getBoundingClientRect().height))"
PAPER = "getComputedStyle(document.querySelector('svg .paper')).fill"


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    folder = tmp_path_factory.mktemp("browser")
    write_plan_page(mission(), VEHICLE, planned(), folder / "plan.html")
    with opened(folder) as tab:
        tab.open(Path(folder / "plan.html"))
        yield tab
        assert tab.errors == []


@pytest.mark.parametrize(("width", "phone"), [(1280, False), (800, False), (375, True)])
def test_it_fits(tab: Tab, width: int, phone: bool) -> None:
    tab.screen(width, 800, phone=phone)
    tab.settle()
    boxes = tab.ask(BOXES)
    assert len(boxes) == 5
    assert all(300 < box[0] <= width and box[1] > 100 for box in boxes)
    assert tab.ask(OVERFLOW) == 0
    assert tab.ask(SMALLEST_WORDS) > 9.0


def test_it_has_a_light_and_a_dark_side(tab: Tab) -> None:
    papers = []
    for dark in (False, True):
        tab.screen(1280, 800, dark=dark)
        tab.settle()
        papers.append(tab.ask(PAPER))
    assert papers == ["rgb(255, 255, 255)", "rgb(21, 28, 38)"]
