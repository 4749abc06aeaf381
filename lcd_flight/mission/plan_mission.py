"""The planning step: a mission's trajectories by its planner, put together into a flight that keeps to its limits."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lcd_flight.mission.assemble import Planned, TrajectoryTask, flight_plan, trajectory_tasks
from lcd_flight.mission.mission import Mission
from lcd_flight.mission.path_checks import require_flyable
from lcd_flight.model import FlightPlan, FloatArray, InputError, RefusedError, Trajectory, Vehicle
from lcd_flight.planning.cost.model_card import ModelCard
from lcd_flight.planning.cost.model_file import SUFFIX, check_fits, load_model, model_names
from lcd_flight.planning.cost.tracking_cost import CostModel
from lcd_flight.planning.limits import Peaks, peaks
from lcd_flight.planning.minimum_snap import minimum_snap
from lcd_flight.planning.planner import PlannerOptions, PlanResult, Timing, TrackingCost, plan_task
from lcd_flight.worlds import fingerprint


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
    """`learned` or `minimum-snap`: what will be flown."""
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


@dataclass(frozen=True, slots=True, eq=False)
class PlannedMission:
    """A flight that keeps to the mission's limits; not rehearsed yet."""

    plan: FlightPlan
    summaries: tuple[TrajectorySummary, ...]
    """One for each trajectory of the mission, in order."""
    card: ModelCard | None = None
    """Of the learned cost, where one was used."""


def plan_mission(mission: Mission, vehicle: Vehicle, cost: TrackingCost | None = None) -> PlannedMission:
    """Plan every trajectory of `mission` for `vehicle` (`vehicle_of(mission)`), and the ways between.

    cost: in place of the model that the mission names; without effect for `planner.type: minimum-snap`.

    Raises:
        InputError: the model is missing, damaged, or made for another vehicle or loop.
        RefusedError: the planned path leaves the geofence, breaks `planner.limits` or outlasts the battery.
    """
    tasks = trajectory_tasks(mission)
    if mission.planner.type == "minimum-snap":
        cost = None
    elif cost is None and tasks:
        cost = load_cost(mission, vehicle)
    made = [_plan(task, mission, vehicle, cost) for task in tasks]
    plan = flight_plan(mission, [planned for planned, _ in made])
    summaries = tuple(summary for _, summary in made)
    _require_flyable(plan, mission, vehicle, summaries)
    return PlannedMission(plan, summaries, _card(cost))


def _require_flyable(
    plan: FlightPlan, mission: Mission, vehicle: Vehicle, summaries: tuple[TrajectorySummary, ...]
) -> None:
    """As `require_flyable`; says, too, which trajectories are minimum snap though more was asked for."""
    try:
        require_flyable(plan, mission, vehicle)
    except RefusedError as error:
        fallen = [f"{s.place}: the learned plan was not used: {s.fallback}" for s in summaries if s.fallback]
        raise RefusedError("\n".join([str(error), *fallen])) from error


def load_cost(mission: Mission, vehicle: Vehicle) -> CostModel:
    """The learned cost that the mission names, else the one that ships for its vehicle.

    Raises:
        InputError: it is missing, damaged, or made for another vehicle or loop; names the key.
    """
    name = mission.planner.model or f"{vehicle.name}-flight"
    shipped = name in model_names() or not name.endswith(SUFFIX)
    try:
        model = load_model(name if shipped else mission.folder / name)
        check_fits(model, fingerprint(vehicle, "flight"), "flight")
    except InputError as error:
        raise InputError(f"{mission.place('planner', 'model')}: {error}") from error
    return model


def _plan(
    task: TrajectoryTask, mission: Mission, vehicle: Vehicle, cost: TrackingCost | None
) -> tuple[Planned, TrajectorySummary]:
    """One trajectory, planned and summed up."""
    place = mission.place("plan", task.item, "trajectory")
    if cost is None:
        plan = minimum_snap(task.waypoints, task.durations_s)
        return Planned(plan, plan), _summary(task, vehicle, Planned(plan, plan), place)
    result = plan_task(task.waypoints, task.durations_s, cost, _options(task, mission, cost))
    planned = Planned(result.plans[0], result.minimum_snap[0])
    return planned, _summary(task, vehicle, planned, place, cost, result)


def _options(task: TrajectoryTask, mission: Mission, cost: TrackingCost) -> PlannerOptions:
    """Times that the mission gives are kept; a model's card knows the weight of snap that suits it."""
    timing: Timing = "fixed" if task.times_given else "retimed"
    options = PlannerOptions(timing=timing, cost_weight=mission.planner.weight)
    card = _card(cost)
    return options if card is None else replace(options, snap_weight=card.snap_weight)


def _card(cost: TrackingCost | None) -> ModelCard | None:
    return cost.card if isinstance(cost, CostModel) else None


def _summary(
    task: TrajectoryTask,
    vehicle: Vehicle,
    planned: Planned,
    place: str,
    cost: TrackingCost | None = None,
    result: PlanResult | None = None,
) -> TrajectorySummary:
    learned = result is not None and result.fallback[0] is None
    summary = TrajectorySummary(
        item=task.item,
        place=place,
        waypoints=len(task.waypoints),
        length_m=float(np.linalg.norm(np.diff(task.waypoints[:, :3], axis=0), axis=1).sum()),
        duration_s=planned.trajectory.duration_s,
        method="learned" if learned else "minimum-snap",
        peaks=peaks(planned.trajectory, vehicle),
        minimum_snap_peaks=peaks(planned.baseline, vehicle),
    )
    if result is None:
        return summary
    return replace(
        summary,
        relative_snap=float(result.relative_snap[0]),
        cost=_number(result.cost),
        minimum_snap_cost=_number(result.minimum_snap_cost),
        predicted_max_error_m=_number(result.predicted_max_error_m),
        minimum_snap_predicted_max_error_m=_number(result.minimum_snap_predicted_max_error_m),
        segment_errors_m=_segment_errors_m(cost, planned.trajectory),
        minimum_snap_segment_errors_m=_segment_errors_m(cost, planned.baseline),
        fallback=result.fallback[0],
    )


def _segment_errors_m(cost: TrackingCost | None, plan: Trajectory) -> tuple[float, ...] | None:
    """(S,) the largest error that a learned cost expects in each segment; None of another cost."""
    if not isinstance(cost, CostModel):
        return None
    (errors_m,) = cost.predict_segment_errors_m(plan.durations_s[None], plan.coefficients[None])
    return tuple(errors_m.tolist())


def _number(row: FloatArray) -> float | None:
    """The only entry, None where there is none."""
    return float(row[0]) if np.isfinite(row[0]) else None
