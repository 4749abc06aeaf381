"""A planned mission: its flight from take-off to touchdown, and a summary of each trajectory beside minimum snap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from lcd_flight.mission.assemble import Planned, TrajectoryTask, flight_plan, trajectory_tasks
from lcd_flight.mission.mission import Mission
from lcd_flight.mission.path_checks import require_flyable
from lcd_flight.mission.solution import MINIMUM_SNAP, ModelStamp, Solution
from lcd_flight.model import FlightPlan, RefusedError, Trajectories, Trajectory, Vehicle
from lcd_flight.planning.cost.model_card import ModelCard
from lcd_flight.planning.limits import Peaks, peaks
from lcd_flight.planning.minimum_snap import minimum_snap, snap


@dataclass(frozen=True, slots=True)
class TrajectorySummary:
    """What planning made of one trajectory, beside minimum snap through the same waypoints."""

    item: int
    """Which item of the mission's plan."""
    place: str
    """The same, for messages: `missions/x.yaml:20: plan[2].trajectory`."""
    waypoints: int
    length_m: float
    """Along straight lines between the waypoints."""
    duration_s: float
    method: str
    """What will be flown, e.g. `learned` or `minimum-snap`."""
    peaks: Peaks
    minimum_snap_peaks: Peaks
    relative_snap: float = 1.0
    """Snap of the position over the least possible."""
    cost: float | None = None
    """Tracking cost of the plan; None where no cost was asked."""
    minimum_snap_cost: float | None = None
    predicted_max_error_m: float | None = None
    minimum_snap_predicted_max_error_m: float | None = None
    segment_errors_m: tuple[float, ...] | None = None
    """Predicted for each segment of the plan; None where no learned cost was asked."""
    minimum_snap_segment_errors_m: tuple[float, ...] | None = None
    fallback: str | None = None
    """Why minimum snap is flown though the mission asks for more."""
    model: ModelStamp | None = None
    """The learned cost that was asked."""
    cached: bool = False
    """Whether the plan was taken from the cache."""


@dataclass(frozen=True, slots=True, eq=False)
class PlannedMission:
    """A flight that keeps to the mission's limits; not rehearsed yet."""

    plan: FlightPlan
    summaries: tuple[TrajectorySummary, ...]
    """One for each trajectory of the mission, in order."""
    solutions: tuple[Solution, ...] = ()
    """What the planner gave for each of them: what a plan file holds."""
    card: ModelCard | None = None
    """Of the learned cost, where one was used."""
    notes: tuple[str, ...] = ()
    """What its user should hear, e.g. that the cache was of no use."""
    source: str = ""
    """The file or files that it came from; empty where it was planned."""

    @property
    def methods(self) -> str:
        """What is flown, e.g. `learned`, each method once."""
        return ", ".join(dict.fromkeys(summary.method for summary in self.summaries))


class PathRefusedError(RefusedError):
    """A planned path breaks the mission's limits; `planned` is what was refused, so that it can be looked at."""

    def __init__(self, message: str, planned: PlannedMission) -> None:
        super().__init__(message)
        self.planned = planned


def planned_mission(
    mission: Mission,
    vehicle: Vehicle,
    solutions: Sequence[Solution],
    card: ModelCard | None = None,
    notes: Sequence[str] = (),
    source: str = "",
) -> PlannedMission:
    """The flight of a mission whose trajectories are solved, one solution for each of `trajectory_tasks(mission)`.

    Raises:
        PathRefusedError: the path leaves the geofence, breaks `planner.limits` or outlasts the battery.
    """
    tasks = trajectory_tasks(mission)
    pairs = [
        Planned(solution.trajectory, _baseline(task, solution)) for task, solution in zip(tasks, solutions, strict=True)
    ]
    summaries = tuple(_summary(*row, mission, vehicle) for row in zip(tasks, solutions, pairs, strict=True))
    plan = flight_plan(mission, pairs)
    planned = PlannedMission(plan, summaries, tuple(solutions), card, tuple(notes), source)
    _require_flyable(planned, mission, vehicle)
    return planned


def _baseline(task: TrajectoryTask, solution: Solution) -> Trajectory:
    """Minimum snap in the durations as asked for, or in the solution's own."""
    if solution.method == MINIMUM_SNAP:
        return solution.trajectory
    durations_s = solution.trajectory.durations_s if solution.own_times else task.durations_s
    return minimum_snap(task.waypoints, durations_s)


def _require_flyable(planned: PlannedMission, mission: Mission, vehicle: Vehicle) -> None:
    """As `require_flyable`; says, too, which trajectories are minimum snap though more was asked for."""
    try:
        require_flyable(planned.plan, mission, vehicle)
    except RefusedError as error:
        fallen = [f"{s.place}: the plan asked for was not used: {s.fallback}" for s in planned.summaries if s.fallback]
        raise PathRefusedError("\n".join([str(error), *fallen]), planned) from error


def _summary(
    task: TrajectoryTask, solution: Solution, planned: Planned, mission: Mission, vehicle: Vehicle
) -> TrajectorySummary:
    return TrajectorySummary(
        item=task.item,
        place=mission.place("plan", task.item, "trajectory"),
        waypoints=len(task.waypoints),
        length_m=float(np.linalg.norm(np.diff(task.waypoints[:, :3], axis=0), axis=1).sum()),
        duration_s=planned.trajectory.duration_s,
        method=solution.method,
        peaks=peaks(planned.trajectory, vehicle),
        minimum_snap_peaks=peaks(planned.baseline, vehicle),
        relative_snap=_relative_snap(planned),
        **asdict(solution.predictions),
        fallback=solution.fallback,
        model=solution.model,
        cached=solution.cached,
    )


def _relative_snap(planned: Planned) -> float:
    """Of the position; 1 where nothing moves."""
    least, found = (
        float(snap(Trajectories.stack([trajectory]))[0, :3].sum())
        for trajectory in (planned.baseline, planned.trajectory)
    )
    return found / least if least > 0.0 else 1.0
