"""Plan files: a mission's planned trajectories with all that they depend on, read back only where they fit.

What a file may say is checked before it flies: it must be whole, continuous, go through the waypoints of this mission,
be made for this vehicle, and keep the limits of this mission. The format: docs/plans.md.
"""

from __future__ import annotations

import re
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, Literal

import pydantic_core
from pydantic import Field, ValidationError

from lcd_flight.files import write_whole
from lcd_flight.mission.assemble import trajectory_tasks
from lcd_flight.mission.mission import Mission
from lcd_flight.mission.plan_record import PlanRecord, Record, first_error
from lcd_flight.mission.planned import PlannedMission, planned_mission
from lcd_flight.mission.solution import Solution
from lcd_flight.mission.source_file import read_text
from lcd_flight.model import InputError, Loop, Vehicle
from lcd_flight.worlds import fingerprint

FORMAT: Literal["lcd-flight plan"] = "lcd-flight plan"
VERSION = 1
"""Raised when a reader of the version before could misread a file."""
LARGEST_BYTES = 64 * 1024 * 1024
"""A plan through 1,000 waypoints has about 1 MB."""
LOOP: Loop = "flight"
"""Missions fly thrust and attitude."""


class VehicleStamp(Record):
    """For which vehicle a plan was made."""

    name: str
    loop: Loop
    fingerprint: str
    """Of airframe and controllers (`lcd_flight.worlds.fingerprint`)."""


class PlanFile(Record):
    """A whole plan file."""

    format: Literal["lcd-flight plan"] = FORMAT
    version: Annotated[int, Field(ge=VERSION, le=VERSION)] = VERSION
    made_by: str
    """Program and version."""
    mission: str
    """Name of the mission that it was made for; another one with the same waypoints may fly it."""
    vehicle: VehicleStamp
    trajectories: tuple[PlanRecord, ...]
    """One for each trajectory of the mission, in order."""


def write_plan(path: Path, planned: PlannedMission, mission: Mission, vehicle: Vehicle) -> None:
    """Write a plan, whole or not at all; the same plan gives the same bytes.

    Raises:
        InputError: the place cannot be written to.
    """
    file = PlanFile(
        made_by=f"lcd-flight {version('lcd-flight')}",
        mission=mission.name,
        vehicle=VehicleStamp(name=vehicle.name, loop=LOOP, fingerprint=fingerprint(vehicle, LOOP)),
        trajectories=tuple(
            PlanRecord.of(task, solution)
            for task, solution in zip(trajectory_tasks(mission), planned.solutions, strict=True)
        ),
    )
    write_whole(path, _ROW_OF_NUMBERS.sub(_in_one_line, file.model_dump_json(indent=1)) + "\n")


def planned_from_file(path: Path, mission: Mission, vehicle: Vehicle) -> PlannedMission:
    """The plan in a file, for a mission and a vehicle that it fits.

    Raises:
        InputError: it is no plan, damaged, or made for another vehicle or for other waypoints or times.
        RefusedError: the path leaves the mission's geofence, breaks its limits or outlasts the battery.
    """
    file = read_plan(path)
    _require_vehicle(path, file.vehicle, vehicle)
    solutions = _solutions(path, file, mission)
    return planned_mission(mission, vehicle, solutions, notes=_notes(path, file, mission), source=str(path))


def read_plan(path: Path) -> PlanFile:
    """What a file holds, each value in its place; whether the trajectories are sound is not looked at.

    Raises:
        InputError: it cannot be read, is no plan, of another version, or holds something that is not a number.
    """
    text = read_text(path, LARGEST_BYTES)
    try:
        _require_format(path, pydantic_core.from_json(text))
        return PlanFile.model_validate_json(text)
    except ValidationError as error:
        raise InputError(f"{path}: {first_error(error)}; {_AGAIN}") from error
    except ValueError as error:  # not JSON
        raise InputError(f"{path}: no plan file ({error}); {_AGAIN}") from error


_ROW_OF_NUMBERS = re.compile(r"\[[-+.\deE,\s]+\]")


def _in_one_line(row: re.Match[str]) -> str:
    """A polynomial or a waypoint as people read it."""
    return " ".join(row[0].split()).replace("[ ", "[").replace(" ]", "]")


_AGAIN = "make it again with `lcd plan MISSION --out FILE`"


def _require_format(path: Path, data: Any) -> None:
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise InputError(f'{path}: no plan file (it has no "format": "{FORMAT}"); {_AGAIN}')
    if data.get("version") != VERSION:
        raise InputError(f"{path}: plan version {data.get('version')}, this program reads {VERSION}; {_AGAIN}")


def _require_vehicle(path: Path, made_for: VehicleStamp, vehicle: Vehicle) -> None:
    own = fingerprint(vehicle, LOOP)
    if (made_for.loop, made_for.fingerprint) != (LOOP, own):
        raise InputError(
            f"{path}: made for another vehicle or other gains ({made_for.name}, {made_for.loop} loop, fingerprint "
            f"{made_for.fingerprint}; this {vehicle.name} has {own}); {_AGAIN}"
        )


def _solutions(path: Path, file: PlanFile, mission: Mission) -> list[Solution]:
    """One for each trajectory of the mission."""
    tasks = trajectory_tasks(mission)
    if len(file.trajectories) != len(tasks):
        have = f"{len(file.trajectories)} trajectories, the mission has {len(tasks)}"
        raise InputError(f"{path}: made for {have}; {_AGAIN}")
    solutions = []
    for number, (record, task) in enumerate(zip(file.trajectories, tasks, strict=True)):
        try:
            solutions.append(record.solution())
        except ValueError as error:
            raise InputError(f"{path}: trajectories[{number}]: damaged: {error}; {_AGAIN}") from error
        if other := record.mismatch(task):
            place = mission.place("plan", task.item, "trajectory")
            raise InputError(f"{path}: trajectories[{number}]: {other} ({place}); {_AGAIN}")
    return solutions


def _notes(path: Path, file: PlanFile, mission: Mission) -> list[str]:
    if file.mission == mission.name:
        return []
    return [f"{path}: made for the mission {file.mission}; its waypoints are those of {mission.name}"]
