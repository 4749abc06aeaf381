"""The Python API: plan a mission, rehearse it, fly it.

For example:

    from lcd_flight import FlightOptions, fly, plan, rehearse

    flight = plan("missions/four_waypoints.yaml")
    rehearsal = rehearse(flight)
    print(rehearsal.text)
    if rehearsal.passed:
        flown = fly(flight, rehearsal, FlightOptions(fast=True))
        print(flown.result.outcome, flown.figures.max_position_error_m, flown.log)
"""

from __future__ import annotations

import datetime
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from lcd_flight import plugins
from lcd_flight.flight.progress import Progress
from lcd_flight.flight.recording import Recording
from lcd_flight.flight.result import FlightResult
from lcd_flight.flight.session import FlightOptions, run_flight
from lcd_flight.mission import Mission, load_mission
from lcd_flight.mission.airframe import vehicle_of
from lcd_flight.mission.plan_cache import PlanCache
from lcd_flight.mission.plan_csv import planned_from_csv
from lcd_flight.mission.plan_file import planned_from_file, write_plan
from lcd_flight.mission.plan_mission import plan_mission
from lcd_flight.mission.planned import PlannedMission
from lcd_flight.model import InputError, LegKind, Observer, Vehicle
from lcd_flight.observers.live import ENDPOINT as LIVE_ENDPOINT
from lcd_flight.observers.log_thread import LogStatistics
from lcd_flight.record import FlightHeader, FlightLog, Prediction, log_path, read_log
from lcd_flight.record.machine import this_machine
from lcd_flight.rehearsal.rehearse import rehearse as fly_in_simulation
from lcd_flight.rehearsal.verdict import Rehearsal
from lcd_flight.review.figures import FlightFigures, figures_of
from lcd_flight.review.page import write_page

__all__ = ["FlightOptions", "FlownMission", "PreparedFlight", "fly", "plan", "rehearse", "save_plan"]


@dataclass(frozen=True, slots=True, eq=False)
class PreparedFlight:
    """A mission with its vehicle and its plan."""

    mission: Mission
    vehicle: Vehicle
    planned: PlannedMission


@dataclass(frozen=True, slots=True, eq=False)
class FlownMission:
    """What a flight left behind."""

    result: FlightResult
    figures: FlightFigures
    log: Path
    log_statistics: LogStatistics
    report: Path | None
    """The review page; None where it could not be written, which the result's notes tell."""


def plan(
    mission: Mission | str | Path,
    *,
    plan_file: Path | None = None,
    csv_files: Sequence[Path] = (),
    cache: bool = True,
) -> PreparedFlight:
    """Plan a mission, given as it is, by file, or by the name of one that ships.

    plan_file: fly the plan in this file (`save_plan`) in place of planning.
    csv_files: fly the polynomials in these files, one for each trajectory, in place of planning.
    cache: whether plans are kept, and taken where they were made before.

    Raises:
        InputError: the mission, its model or the plan's file is wrong; every problem of the mission's file, a line
            each.
        RefusedError: the planned path leaves the fence, breaks the planner's limits or outlasts the battery.
    """
    loaded = mission if isinstance(mission, Mission) else load_mission(mission)
    vehicle = vehicle_of(loaded)
    if plan_file is not None:
        planned = planned_from_file(plan_file, loaded, vehicle)
    elif csv_files:
        planned = planned_from_csv(csv_files, loaded, vehicle)
    else:
        planned = plan_mission(loaded, vehicle, cache=PlanCache() if cache else None)
    return PreparedFlight(loaded, vehicle, planned)


def save_plan(flight: PreparedFlight, path: Path) -> None:
    """Write the plan to a file that `plan(mission, plan_file=path)` and `lcd-fly MISSION --plan PATH` take.

    Raises:
        InputError: the place cannot be written to.
    """
    write_plan(path, flight.planned, flight.mission, flight.vehicle)


def rehearse(
    flight: PreparedFlight, runs: int | None = None, progress: Callable[[int, int], None] | None = None
) -> Rehearsal:
    """Fly the plan in batched simulation with noise and faults; `.require()` refuses what did not pass.

    runs: in place of the mission's `rehearse.runs`.
    """
    return fly_in_simulation(
        flight.planned.plan, flight.mission, flight.vehicle, plugins.simulator(), runs=runs, progress=progress
    )


def fly(
    flight: PreparedFlight,
    rehearsal: Rehearsal | None = None,
    options: FlightOptions | None = None,
    *,
    log_folder: Path | None = None,
    live: str | None = LIVE_ENDPOINT,
    observers: Sequence[Observer] = (),
    progress: Progress | None = None,
) -> FlownMission:
    """Fly a plan that was rehearsed, log it and write its review page.

    rehearsal: of this plan; made here where it is None.
    log_folder: in place of the mission's `log.dir`.
    live: where the flight is published for `lcd monitor`; None for nowhere. In virtual time nobody can watch.
    observers: told of every tick beside the log; they must not wait.

    Raises:
        InputError: the link or the endpoint is wrong.
        RefusedError: the rehearsal did not pass, or log folder, link or pose source are not to be had. What is refused
            after connecting is in the result.
    """
    rehearsal = rehearse(flight) if rehearsal is None else rehearsal
    rehearsal.require()
    options = options or FlightOptions()
    started = datetime.datetime.now(datetime.UTC).astimezone()
    path = log_path(log_folder or flight.mission.log.dir, flight.mission.name, started)
    header = _header(flight, rehearsal, options, started)
    with Recording(path, header, live=None if options.fast else live, lossless=options.fast) as recording:
        listeners = (*recording.observers, *observers)
        result = run_flight(
            flight.mission, flight.planned.plan, flight.vehicle, options, observers=listeners, progress=progress
        )
    log = read_log(path)
    report, notes = _report(log, path.with_suffix(".html"))
    result = replace(result, notes=(*result.notes, *recording.notes, *notes))
    return FlownMission(result, figures_of(log), path, recording.statistics, report)


def _report(log: FlightLog, path: Path) -> tuple[Path | None, tuple[str, ...]]:
    """The review page; what hinders it is a note, since the flight is over and is judged by how it went."""
    try:
        return write_page(log, path), ()
    except InputError as error:
        return None, (f"no report: {error}",)


def _header(
    flight: PreparedFlight, rehearsal: Rehearsal, options: FlightOptions, started: datetime.datetime
) -> FlightHeader:
    """What the log says of the flight before it begins."""
    mission, card = flight.mission, flight.planned.card
    return FlightHeader(
        name=mission.name,
        mission_text=mission.source.text,
        plan=flight.planned.plan,
        vehicle=flight.vehicle,
        limits=mission.safety_limits(),
        link=options.uri or mission.vehicle.uri,
        seed=mission.seed,
        started=started,
        planner=flight.planned.methods if flight.planned.source else mission.planner.type,
        model_card={} if card is None else card.model_dump(mode="json"),
        predicted_max_error_m=rehearsal.max_error_m,
        predictions=_predictions(flight.planned),
        notes={"rehearsal": rehearsal.text, **_plan_note(flight.planned)},
        versions=this_machine(),
    )


def _plan_note(planned: PlannedMission) -> dict[str, str]:
    """That a plan was not made for this flight."""
    return {"plan": f"from {planned.source}"} if planned.source else {}


def _predictions(planned: PlannedMission) -> tuple[Prediction, ...]:
    """What the planner expected of each trajectory, so that a review has it without planning."""
    legs = [number for number, leg in enumerate(planned.plan.legs) if leg.kind is LegKind.TRAJECTORY]
    return tuple(
        Prediction(
            leg=leg,
            method=summary.method,
            relative_snap=summary.relative_snap,
            cost=summary.cost,
            minimum_snap_cost=summary.minimum_snap_cost,
            segment_errors_m=summary.segment_errors_m,
            minimum_snap_segment_errors_m=summary.minimum_snap_segment_errors_m,
            fallback=summary.fallback,
        )
        for leg, summary in zip(legs, planned.summaries, strict=True)
    )
