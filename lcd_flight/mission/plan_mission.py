"""The planning step: a mission's trajectories by its planner, put together into a flight that keeps to its limits."""

from __future__ import annotations

from lcd_flight import plugins
from lcd_flight.mission.assemble import TrajectoryTask, trajectory_tasks
from lcd_flight.mission.mission import Mission
from lcd_flight.mission.plan_cache import PlanCache
from lcd_flight.mission.plan_key import plan_key
from lcd_flight.mission.planned import PlannedMission, planned_mission
from lcd_flight.mission.solution import MINIMUM_SNAP, Solution
from lcd_flight.mission.solving import POLISHED, Solver
from lcd_flight.model import InputError, RefusedError, Simulator, Vehicle
from lcd_flight.planning.cost.limit_cost import LimitCost
from lcd_flight.planning.cost.model_card import ModelCard
from lcd_flight.planning.cost.model_file import SUFFIX, check_fits, load_model, model_names
from lcd_flight.planning.cost.proxy import ThrustProxy
from lcd_flight.planning.cost.tracking_cost import CostModel
from lcd_flight.planning.planner import TrackingCost
from lcd_flight.worlds import fingerprint


def plan_mission(
    mission: Mission,
    vehicle: Vehicle,
    cost: TrackingCost | None = None,
    cache: PlanCache | None = None,
    simulator: Simulator | None = None,
) -> PlannedMission:
    """Plan every trajectory of `mission` for `vehicle` (`vehicle_of(mission)`), and the ways between.

    cost: in place of the model that the mission names; without effect for `planner.type: minimum-snap`.
    cache: where plans are looked for and kept; None: nowhere.
    simulator: where plans are polished; None: the one that is installed.

    Raises:
        InputError: the model is missing, damaged, or made for another vehicle or loop.
        RefusedError: the planned path leaves the geofence, breaks `planner.limits` or outlasts the battery.
    """
    tasks = trajectory_tasks(mission)
    solver, notes = _solver(mission, vehicle, cost, simulator, needed=bool(tasks))
    try:
        return _planned(mission, solver, cache, notes)
    except RefusedError as error:
        if not (solver.polishes and tasks):
            raise
        first_line = str(error).splitlines()[0]
        return _planned(mission, solver.unpolished, cache, [*notes, f"flown without the polish: with it, {first_line}"])


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


def _solver(
    mission: Mission, vehicle: Vehicle, cost: TrackingCost | None, simulator: Simulator | None, *, needed: bool
) -> tuple[Solver, list[str]]:
    """The mission's method; a vehicle that no model ships for is planned without one, said aloud."""
    method, notes = mission.planner.type, []
    if cost is None and needed and method.startswith("learned"):
        try:
            cost = load_cost(mission, vehicle)
        except InputError:
            if mission.planner.model is not None or f"{vehicle.name}-flight" in model_names():
                raise
            method = "analytic-polished"
            notes.append(
                f"no learned cost ships for the vehicle {vehicle.name}: planned by {method}; "
                "`lcd train --vehicle` makes one"
            )
    arena = (simulator or plugins.simulator()) if method.endswith(POLISHED) else None
    chosen = ThrustProxy() if cost is None or method.startswith("analytic") else cost
    limits = LimitCost.of(mission.plan_limits(), vehicle, mission.geofence())
    solver = Solver(method, vehicle, chosen, arena, mission.seed, mission.planner.weight, limits=limits)
    return solver, notes


def _planned(mission: Mission, solver: Solver, cache: PlanCache | None, notes: list[str]) -> PlannedMission:
    """Solve every trajectory and put the flight together."""
    solutions = [_solution(task, solver, cache) for task in trajectory_tasks(mission)]
    told = [*notes, *(cache.notes if cache else ())]
    return planned_mission(mission, solver.vehicle, solutions, _card(solver), told)


def _solution(task: TrajectoryTask, solver: Solver, cache: PlanCache | None) -> Solution:
    """One trajectory: from the cache, or solved and kept there."""
    model = solver.stamp
    if cache is None or solver.method == MINIMUM_SNAP or (model is None and not isinstance(solver.cost, ThrustProxy)):
        return solver.solve(task)
    digest = None if model is None else model.hash
    key = plan_key(task, solver.vehicle, solver.method, solver.options(task), digest, solver.simulator)
    found = cache.get(key, task)
    if found is None:
        found = solver.solve(task)
        cache.put(key, task, found)
    return found


def _card(solver: Solver) -> ModelCard | None:
    used = solver.method != MINIMUM_SNAP and isinstance(solver.cost, CostModel)
    return solver.cost.card if used and isinstance(solver.cost, CostModel) else None
