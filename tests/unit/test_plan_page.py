"""The page of a plan: small, self-contained, without a script, and it shows the plan beside minimum snap."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
from plan_bench import VEHICLE, WAYPOINTS, mission, planned, trajectory

from lcd_flight.mission.plan_csv import planned_from_csv, write_csv
from lcd_flight.mission.planned import PlannedMission
from lcd_flight.model import InputError
from lcd_flight.review.plan_page import plan_page, write_plan_page


class Elements(HTMLParser):
    """What a page consists of: every tag is closed in the order it was opened."""

    EMPTY = ("meta", "rect", "circle", "polyline", "line", "input")

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self._open: list[str] = []
        self.feed(page)
        assert self._open == []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attributes)))
        if tag not in self.EMPTY:
            self._open.append(tag)

    def handle_startendtag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attributes)))

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)

    def count(self, tag: str) -> int:
        return sum(name == tag for name, _ in self.tags)


def page_of(made: PlannedMission, **sections: object) -> Elements:
    return Elements(plan_page(mission(**sections), VEHICLE, made))


def test_five_pictures_of_a_learned_plan() -> None:
    page = page_of(planned())
    assert page.count("svg") == 5
    titles = [text for text in page.texts if text.endswith((", m", ", m/s", "thrust"))]
    for title in ("From above: y, m", "From the side: z, m", "Speed, m/s", "Thrust, % of full thrust"):
        assert title in titles
    assert "Expected largest error, m" in titles
    assert page.texts.count("minimum snap") == 6  # the table and five legends
    assert page.texts.count("learned") == 6
    bars = [attributes for tag, attributes in page.tags if attributes.get("class") == "bar"]
    assert len(bars) == 6  # two for each segment


def test_the_numbers_are_those_of_the_summary() -> None:
    made = planned()
    (summary,) = made.summaries
    rows = re.findall(r"<tr><td>(.*?)</td><td>(.*?)</td><td>(.*?)</td></tr>", plan_page(mission(), VEHICLE, made))
    told = {name: (least, found) for name, least, found in rows}
    expected = f"{summary.minimum_snap_predicted_max_error_m:.2f} m", f"{summary.predicted_max_error_m:.2f} m"
    assert told["expected largest error"] == expected
    assert told["peak speed"][1] == f"{summary.peaks.speed.value:.2f} m/s"
    assert told["snap of the position, relative"] == ("1.00", f"{summary.relative_snap:.2f}")


def test_minimum_snap_alone_is_not_shown_beside_itself() -> None:
    page = page_of(planned(mission(planner={"type": "minimum-snap"})))
    assert page.count("svg") == 4
    assert page.texts.count("minimum snap") == 5  # the table and four legends, once each
    assert "minimum-snap" not in page.texts


def test_a_plan_from_a_file_says_so(tmp_path: Path) -> None:
    paths = write_csv(tmp_path / "mine.csv", planned())
    page = plan_page(mission(), VEHICLE, planned_from_csv(paths, mission(), VEHICLE))
    assert f"from {tmp_path / 'mine.csv'}" in page
    assert "plan: csv" in page


def test_why_minimum_snap_is_flown() -> None:
    made = planned(mission(trajectory(WAYPOINTS[:2]), planner={"speed": 0.8}))
    assert "Minimum snap in place of the plan asked for: two waypoints leave nothing to choose" in plan_page(
        mission(), VEHICLE, made
    )


def test_a_refused_plan_says_why() -> None:
    page = plan_page(mission(), VEHICLE, planned(), refusal="too fast\ntoo <high>")
    assert re.findall(r'class="alert">(.*?)</p>', page) == ["Refused: too fast", "Refused: too &lt;high&gt;"]


def test_two_trajectories_and_none() -> None:
    twice = mission(trajectory(), trajectory(WAYPOINTS[::-1]))
    page = plan_page(twice, VEHICLE, planned(twice))
    assert "Trajectory 2 of 2: 4 waypoints" in page
    assert Elements(page).count("svg") == 10
    hovering = mission(plan=[{"takeoff": {"height": 1}}, {"land": {}}])
    assert "No trajectory: take-off, holds and landing only." in plan_page(hovering, VEHICLE, planned(hovering))


def test_nothing_is_loaded_and_nothing_runs() -> None:
    page = plan_page(mission(), VEHICLE, planned())
    elements = Elements(page)
    assert elements.count("script") == elements.count("img") == elements.count("link") == 0
    assert not re.search(r"url\(|@import|\bsrc=|\bhref=", page)
    policies = [attributes["content"] for _, attributes in elements.tags if "http-equiv" in attributes]
    assert policies == ["default-src 'none'; style-src 'unsafe-inline'"]
    assert len(page) < 60_000


def test_names_are_escaped() -> None:
    made = replace(planned(), source="<script>alert(1)</script>")
    assert "<script" not in plan_page(mission(), VEHICLE, made)


def test_a_place_that_cannot_be_written_to(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="cannot be written"):
        write_plan_page(mission(), VEHICLE, planned(), tmp_path / "file" / "plan.html")
    assert write_plan_page(mission(), VEHICLE, planned(), tmp_path / "plan.html").stat().st_size > 10_000
