"""Trajectories from a polynomial CSV as the plan of a mission, and the plan's trajectories as such files.

Other programs round to six digits, so that their polynomials meet only nearly. What is flown is rebuilt: through the
mission's waypoints exactly, with the mean of both sides' velocity, acceleration and jerk at each inner waypoint, at
rest at both ends. A polynomial of order 7 is fixed by just those, so that a CSV that is exact comes out as it went in.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from lcd_flight.files import write_whole
from lcd_flight.mission.assemble import TrajectoryTask, trajectory_tasks
from lcd_flight.mission.mission import Mission
from lcd_flight.mission.planned import PlannedMission, planned_mission
from lcd_flight.mission.solution import Solution
from lcd_flight.mission.soundness import discontinuity, knot_derivatives
from lcd_flight.mission.source_file import read_text
from lcd_flight.model import FloatArray, InputError, Trajectory, Vehicle
from lcd_flight.planning.segments import polynomials
from lcd_flight.planning.times import SAME_POINT
from lcd_flight.wire.polynomial_csv import decode, encode

METHOD = "csv"
LARGEST_BYTES = 16 * 1024 * 1024
WAYPOINT_TOLERANCE = 0.01
"""m and rad by which a file may miss the mission's waypoints; six digits come to far less."""
JUMP_TOLERANCE = 0.02
"""By which derivatives may jump, relative to 1 + the largest; six digits and segments of a few seconds come to less."""


def planned_from_csv(paths: Sequence[Path], mission: Mission, vehicle: Vehicle) -> PlannedMission:
    """A mission's plan from polynomial CSV files, one for each of its trajectories, in order.

    Raises:
        InputError: not so many files, or one that is unreadable, jumps, or does not go through the waypoints.
        RefusedError: the path leaves the mission's geofence, breaks its limits or outlasts the battery.
    """
    tasks = trajectory_tasks(mission)
    if len(paths) != len(tasks):
        raise InputError(f"{len(paths)} polynomial CSV file(s) for {len(tasks)} trajectories; give one for each")
    solutions = [_solution(path, task, mission) for path, task in zip(paths, tasks, strict=True)]
    return planned_mission(mission, vehicle, solutions, source=", ".join(map(str, paths)))


def write_csv(path: Path, planned: PlannedMission) -> list[Path]:
    """Write the planned trajectories: to `path`, or where there are several to `path` with -1, -2 ... in its name.

    Raises:
        InputError: there is no trajectory, or the place cannot be written to.
    """
    count = len(planned.solutions)
    if not count:
        raise InputError(f"{path}: the mission has no trajectory to write")
    numbered = [path.with_stem(f"{path.stem}-{n}") for n in range(1, count + 1)]
    paths = [path] if count == 1 else numbered
    for place, solution in zip(paths, planned.solutions, strict=True):
        write_whole(place, encode(solution.trajectory))
    return paths


def read_csv(path: Path) -> Trajectory:
    """The trajectory in a file, as it stands there.

    Raises:
        InputError: the file or one of its lines is wrong.
    """
    try:
        return decode(read_text(path, LARGEST_BYTES))
    except ValueError as error:
        raise InputError(f"{path}: {error}") from error


def _solution(path: Path, task: TrajectoryTask, mission: Mission) -> Solution:
    """A file as the plan of one trajectory."""
    found = read_csv(path)
    place = mission.place("plan", task.item, "trajectory")
    if found.segments != len(task.waypoints) - 1:
        raise InputError(
            f"{path}: has {found.segments} segments, {place} has {len(task.waypoints)} waypoints; they must be the "
            "ends of the segments"
        )
    turned = _on_the_same_turn(found, task.waypoints)
    if missed := _missed(turned, task.waypoints):
        raise InputError(f"{path}: is {missed} of {place}; write the waypoints that it goes through")
    if jump := discontinuity(turned, JUMP_TOLERANCE):
        raise InputError(f"{path}: {jump}; make it smooth to jerk and at rest at both ends")
    if task.times_given and np.abs(found.durations_s - task.durations_s).max() > SAME_POINT:
        raise InputError(f"{path}: brings its own times, but {place} gives times; leave those out of the mission")
    return Solution(_rebuilt(turned, task.waypoints), METHOD, own_times=True, options={"file": path.name})


def _missed(found: Trajectory, waypoints: FloatArray) -> str | None:
    """How far it is from which waypoint; None if it is near all of them."""
    distances = np.nan_to_num(np.abs(found.waypoints() - waypoints), nan=np.inf)
    if distances.max() <= WAYPOINT_TOLERANCE:
        return None
    n, axis = (int(i) for i in np.unravel_index(int(distances.argmax()), distances.shape))
    name, unit = (("x", "m"), ("y", "m"), ("z", "m"), ("yaw", "rad"))[axis]
    return f"{distances[n, axis]:.3g} {unit} in {name} from waypoint {n + 1}"


def _on_the_same_turn(found: Trajectory, waypoints: FloatArray) -> Trajectory:
    """The same trajectory with its yaw moved by whole turns to where the mission's begins."""
    turns = np.round((waypoints[0, 3] - found.coefficients[3, 0, 0]) / (2.0 * np.pi))
    coefficients = found.coefficients.copy()
    coefficients[3, :, 0] += 2.0 * np.pi * turns
    return Trajectory(found.durations_s, coefficients)


def _rebuilt(found: Trajectory, waypoints: FloatArray) -> Trajectory:
    """Through the waypoints to rounding, continuous to jerk, at rest at both ends."""
    starts, ends = knot_derivatives(found)
    knots = np.zeros((len(waypoints), 3, 4))
    knots[1:-1] = 0.5 * (starts[1:, 1:] + ends[:-1, 1:])
    coefficients = np.empty_like(found.coefficients)
    polynomials(waypoints, found.durations_s, knots.reshape(-1, 4), np.empty(8), coefficients)
    return Trajectory(found.durations_s, coefficients)
