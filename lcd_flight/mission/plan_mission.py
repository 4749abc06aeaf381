"""The planning step: a mission's trajectories by its planner, put together into a flight that keeps to its limits."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np

from lcd_flight.mission.assemble import TrajectoryTask, trajectory_tasks
from lcd_flight.mission.mission import Mission
from lcd_flight.mission.plan_cache import PlanCache
from lcd_flight.mission.plan_key import model_hash, plan_key
from lcd_flight.mission.planned import PlannedMission, planned_mission
from lcd_flight.mission.solution import MINIMUM_SNAP, ModelStamp, Predictions, Solution
from lcd_flight.model import FloatArray, InputError, Trajectory, Vehicle
from lcd_flight.planning.cost.model_card import ModelCard
from lcd_flight.planning.cost.model_file import SUFFIX, check_fits, load_model, model_names
from lcd_flight.planning.cost.tracking_cost import CostModel
from lcd_flight.planning.minimum_snap import minimum_snap
from lcd_flight.planning.planner import PlannerOptions, PlanResult, Timing, TrackingCost, plan_task
from lcd_flight.worlds import fingerprint


def plan_mission(
    mission: Mission, vehicle: Vehicle, cost: TrackingCost | None = None, cache: PlanCache | None = None
) -> PlannedMission:
    """Plan every trajectory of `mission` for `vehicle` (`vehicle_of(mission)`), and the ways between.

    cost: in place of the model that the mission names; without effect for `planner.type: minimum-snap`.
    cache: where plans made with a learned cost are looked for and kept; None: nowhere.

    Raises:
        InputError: the model is missing, damaged, or made for another vehicle or loop.
        RefusedError: the planned path leaves the geofence, breaks `planner.limits` or outlasts the battery.
    """
    tasks = trajectory_tasks(mission)
    if mission.planner.type == MINIMUM_SNAP:
        cost = None
    elif cost is None and tasks:
        cost = load_cost(mission, vehicle)
    solutions = [_solution(task, mission, vehicle, cost, cache) for task in tasks]
    return planned_mission(mission, vehicle, solutions, _card(cost), cache.notes if cache else ())


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


def _solution(
    task: TrajectoryTask, mission: Mission, vehicle: Vehicle, cost: TrackingCost | None, cache: PlanCache | None
) -> Solution:
    """One trajectory: minimum snap, from the cache, or solved and kept there."""
    if cost is None:
        return Solution(minimum_snap(task.waypoints, task.durations_s), MINIMUM_SNAP)
    method, options, model = mission.planner.type, _options(task, mission, cost), _stamp(cost)
    if cache is None or model is None:
        return _solved(task, method, cost, options)
    key = plan_key(task, vehicle, method, asdict(options), model.hash)
    found = cache.get(key, task)
    if found is None:
        found = _solved(task, method, cost, options)
        cache.put(key, task, found)
    return found


def _options(task: TrajectoryTask, mission: Mission, cost: TrackingCost) -> PlannerOptions:
    """Times that the mission gives are kept; a model's card knows the weight of snap that suits it."""
    timing: Timing = "fixed" if task.times_given else "retimed"
    options = PlannerOptions(timing=timing, cost_weight=mission.planner.weight)
    card = _card(cost)
    return options if card is None else replace(options, snap_weight=card.snap_weight)


def _card(cost: TrackingCost | None) -> ModelCard | None:
    return cost.card if isinstance(cost, CostModel) else None


def _stamp(cost: TrackingCost) -> ModelStamp | None:
    """Which model it is; None of a cost that is no model."""
    if not isinstance(cost, CostModel):
        return None
    return ModelStamp(cost.card.name if cost.card else "unnamed", model_hash(cost))


def _solved(task: TrajectoryTask, method: str, cost: TrackingCost, options: PlannerOptions) -> Solution:
    result = plan_task(task.waypoints, task.durations_s, cost, options)
    fallback = result.fallback[0]
    return Solution(
        trajectory=result.plans[0],
        method=method if fallback is None else MINIMUM_SNAP,
        fallback=fallback,
        options=asdict(options),
        model=_stamp(cost),
        predictions=_predictions(cost, result),
    )


def _predictions(cost: TrackingCost, result: PlanResult) -> Predictions:
    return Predictions(
        cost=_number(result.cost),
        minimum_snap_cost=_number(result.minimum_snap_cost),
        predicted_max_error_m=_number(result.predicted_max_error_m),
        minimum_snap_predicted_max_error_m=_number(result.minimum_snap_predicted_max_error_m),
        segment_errors_m=_segment_errors_m(cost, result.plans[0]),
        minimum_snap_segment_errors_m=_segment_errors_m(cost, result.minimum_snap[0]),
    )


def _segment_errors_m(cost: TrackingCost, plan: Trajectory) -> tuple[float, ...] | None:
    """(S,) the largest error that a learned cost expects in each segment; None of another cost."""
    if not isinstance(cost, CostModel):
        return None
    (errors_m,) = cost.predict_segment_errors_m(plan.durations_s[None], plan.coefficients[None])
    return tuple(errors_m.tolist())


def _number(row: FloatArray) -> float | None:
    """The only entry, None where there is none."""
    return float(row[0]) if np.isfinite(row[0]) else None
