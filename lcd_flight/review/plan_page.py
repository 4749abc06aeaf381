"""A page about a plan before it flies: one HTML file without a script, the plan beside minimum snap in pictures."""

from __future__ import annotations

import math
from importlib.metadata import version
from pathlib import Path

from lcd_flight.drawing import colors
from lcd_flight.drawing.html import Html, joined, tag
from lcd_flight.files import write_whole
from lcd_flight.mission import Mission
from lcd_flight.mission.planned import PlannedMission
from lcd_flight.mission.solution import MINIMUM_SNAP
from lcd_flight.model import LegKind, Vehicle
from lcd_flight.planning.limits import Peaks
from lcd_flight.review.assets import asset
from lcd_flight.review.plan_pictures import PlanShown, pictures

_POLICY = "default-src 'none'; style-src 'unsafe-inline'"
_STYLE = """
.picture { margin: 0 0 14px; padding: 0; overflow: hidden; break-inside: avoid; }
.picture svg { display: block; width: 100%; height: auto; max-width: 640px; margin: 0 auto; }
.pictures { columns: 2 400px; column-gap: 14px; margin: 14px 0; }
td:first-child { white-space: normal; }
polyline.bar { stroke-linecap: butt; }
polyline { vector-effect: none; }
"""


def write_plan_page(mission: Mission, vehicle: Vehicle, planned: PlannedMission, path: Path, refusal: str = "") -> Path:
    """Write the page of a plan and return its path.

    refusal: why the plan may not be flown, a line for each reason.

    Raises:
        InputError: the place cannot be written to.
    """
    write_whole(path, plan_page(mission, vehicle, planned, refusal))
    return path


def plan_page(mission: Mission, vehicle: Vehicle, planned: PlannedMission, refusal: str = "") -> Html:
    """The page as one HTML document."""
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", name_="viewport", content="width=device-width, initial-scale=1"),
        tag("meta", http_equiv="Content-Security-Policy", content=_POLICY),
        tag("title", f"{mission.name}: plan"),
        tag("style", Html(colors() + asset("page.css") + _STYLE)),
    )
    content = [_heading(mission, vehicle, planned)]
    content += [tag("p", f"Refused: {line}", class_="alert") for line in refusal.splitlines()]
    for number, shown in enumerate(_shown(mission, vehicle, planned), start=1):
        content.append(_trajectory(shown, number, len(planned.summaries)))
    if not planned.summaries:
        content.append(tag("p", "No trajectory: take-off, holds and landing only.", class_="note"))
    footer = tag("footer", f"Made by lcd-flight {version('lcd-flight')}. Not flown, not rehearsed.")
    body = tag("body", tag("main", *content, footer))
    return joined([Html("<!DOCTYPE html>\n"), tag("html", head, body, lang="en")])


def _shown(mission: Mission, vehicle: Vehicle, planned: PlannedMission) -> list[PlanShown]:
    legs = [leg for leg in planned.plan.legs if leg.kind is LegKind.TRAJECTORY]
    limits = mission.planner.limits
    return [
        PlanShown(leg, summary, vehicle, limits.max_velocity_m_per_s, limits.max_thrust_ratio)
        for leg, summary in zip(legs, planned.summaries, strict=True)
    ]


def _heading(mission: Mission, vehicle: Vehicle, planned: PlannedMission) -> Html:
    """What is planned, for what, by what."""
    model = next((summary.model for summary in planned.summaries if summary.model), None)
    facts = [
        f"{vehicle.name}, {planned.plan.duration_s:.1f} s from take-off to touchdown",
        f"model {model.name} ({model.hash})" if model else "",
        f"from {planned.source}" if planned.source else "",
    ]
    return tag(
        "header",
        tag("h1", mission.name),
        tag("span", f"plan: {planned.methods or 'no trajectory'}", class_="badge"),
        tag("p", "; ".join(filter(None, facts))),
    )


def _trajectory(shown: PlanShown, number: int, count: int) -> Html:
    """One trajectory: what became better, then the pictures."""
    summary = shown.summary
    title = f"{summary.waypoints} waypoints, {summary.length_m:.1f} m, {summary.duration_s:.2f} s"
    fallback = f"Minimum snap in place of the plan asked for: {summary.fallback}" if summary.fallback else None
    return tag(
        "section",
        tag("h2", title if count == 1 else f"Trajectory {number} of {count}: {title}"),
        tag("p", fallback, class_="alert") if fallback else None,
        tag("div", _comparison(shown), class_="card"),
        tag("div", *(tag("figure", picture, class_="panel picture") for picture in pictures(shown)), class_="pictures"),
    )


def _comparison(shown: PlanShown) -> Html:
    """Minimum snap beside the plan, in numbers."""
    summary = shown.summary
    before, after = _peaks(summary.minimum_snap_peaks), _peaks(summary.peaks)
    rows = [[name, least, found] for (name, least), (_, found) in zip(before, after, strict=True)]
    rows.append(["snap of the position, relative", "1.00", f"{summary.relative_snap:.2f}"])
    if summary.predicted_max_error_m is not None and summary.minimum_snap_predicted_max_error_m is not None:
        expected = f"{summary.minimum_snap_predicted_max_error_m:.2f} m", f"{summary.predicted_max_error_m:.2f} m"
        rows.insert(0, ["expected largest error", *expected])
    if summary.method == MINIMUM_SNAP:
        return _table(["", "minimum snap"], [[name, found] for name, _, found in rows])
    return _table(["", "minimum snap", summary.method], rows)


def _table(head: list[str], rows: list[list[str]]) -> Html:
    lines = [tag("tr", *(tag("td", cell) for cell in row)) for row in rows]
    return tag("table", tag("tr", *(tag("th", text) for text in head)), *lines)


def _peaks(peaks: Peaks) -> list[tuple[str, str]]:
    return [
        ("peak thrust, of full thrust", f"{100.0 * peaks.thrust_ratio.value:.0f} %"),
        ("peak speed", f"{peaks.speed.value:.2f} m/s"),
        ("largest tilt", f"{math.degrees(peaks.tilt.value):.0f}°"),
        ("highest body rate", f"{math.degrees(peaks.body_rate.value):.0f}°/s"),
    ]
