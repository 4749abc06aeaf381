"""Planning methods by name, behind one interface: every table holds each of them in the same way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from lcd_flight.model import (
    BoolArray,
    FloatArray,
    InputError,
    IntArray,
    RolloutOptions,
    Simulator,
    Tasks,
    Trajectories,
    Vehicle,
    World,
)
from lcd_flight.planning.cost.model_file import SUFFIX, check_fits, load_model
from lcd_flight.planning.cost.proxy import ANALYTIC_SNAP_WEIGHT, ThrustProxy
from lcd_flight.planning.cost.tracking_cost import CostModel
from lcd_flight.planning.knots import Whitening
from lcd_flight.planning.minimum_snap import minimum_snap_batch
from lcd_flight.planning.planner import PlannerOptions, PlanResult, Timing, TrackingCost, plan_batch
from lcd_flight.planning.polish import candidates_of, polish
from lcd_flight.planning.released import plan_released
from lcd_flight.planning.search import Arena, SearchSettings
from lcd_flight.planning.search import search as search_in_simulator
from lcd_flight.worlds import fingerprint


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """What a method may know."""

    world: World
    vehicle: Vehicle
    """With the drag that is planned for."""
    tasks: Tasks
    indices: IntArray
    """(N,) their numbers among all tasks of the evaluation, so that a plan does not depend on the grouping."""
    timing: Timing
    simulator: Simulator
    """For methods that search in it; `learned` and `analytic` do not."""
    seed: int
    """Of a method's own random choices; nothing in common with the noise that its plans are judged by."""
    model: str
    """Name or path of the learned cost."""

    def take(self, rows: IntArray) -> Problem:
        """The same for some of the tasks (rows of `tasks`)."""
        return replace(self, tasks=self.tasks.take(rows), indices=self.indices[rows])

    @property
    def durations_s(self) -> FloatArray:
        """(N, S) the paper's time allocation."""
        return self.tasks.durations_s(self.world.speed)

    @property
    def arena(self) -> Arena:
        """Where a method that flies does so: the world that is planned for."""
        options = RolloutOptions(loop=self.world.loop, start_aligned=self.world.start_aligned)
        return Arena(self.simulator, self.vehicle, options)


@dataclass(frozen=True, slots=True, eq=False)
class Planned:
    """What a method came up with."""

    plans: Trajectories
    fell_back: BoolArray
    """(N,) where the method failed and gave minimum snap instead."""
    controller: str = "geometric"
    """What the plans are flown by (`RolloutOptions.controller`)."""


Method: TypeAlias = Callable[[Problem], Planned]


def minimum_snap(problem: Problem) -> Planned:
    """The paper's MS-GC: minimum snap at the paper's time allocation, whatever the timing."""
    plans = minimum_snap_batch(problem.tasks.poses, problem.durations_s)
    return Planned(plans, np.zeros(len(plans), bool))


def minimum_snap_drag(problem: Problem) -> Planned:
    """The paper's MS-GCD: the same plans, flown with the drag of the rotors compensated by a model (Svacha 2017)."""
    return replace(minimum_snap(problem), controller="geometric-drag")


def minimum_snap_l1(problem: Problem) -> Planned:
    """The same plans, flown with drag compensated by L1 adaptation: the released code's MS-GCD, corrected."""
    return replace(minimum_snap(problem), controller="geometric-l1")


def paper(problem: Problem) -> Planned:
    """The released objective: snap plus the exponential of a network on raw coefficients, at the paper's times.

    Raises:
        InputError: as `learned`, of the model whose name ends in `-paper-code`.
    """
    model = _fitting(problem, baseline_model(problem.model, "paper-code"))
    return Planned(*plan_released(problem.tasks, problem.durations_s, model))


def mlp_knots(problem: Problem) -> Planned:
    """As `learned`, with the paper's network (100, 100, 20) on the 39 numbers that say which trajectory it is.

    Raises:
        InputError: as `learned`, of the model whose name ends in `-mlp-knots`.
    """
    return _solved(_solve(problem, *_learned_cost(problem, baseline_model(problem.model, "mlp-knots"))))


def analytic(problem: Problem) -> Planned:
    """The projected solve on the analytic cost: no learning, no simulator."""
    return _solved(_solve_analytic(problem))


def analytic_long(problem: Problem) -> Planned:
    """The same with 400 iterations: no less processor time than `learned` takes (measured: 1.1 times)."""
    return _solved(_solve(problem, ThrustProxy(), PlannerOptions(problem.timing, ANALYTIC_SNAP_WEIGHT, iterations=400)))


def learned(problem: Problem) -> Planned:
    """The projected solve on the learned cost: no simulator.

    Raises:
        InputError: the model is missing, damaged, or trained for another vehicle or loop.
    """
    return _solved(_solve(problem, *_learned_cost(problem, problem.model)))


def search(problem: Problem) -> Planned:
    """CEM in the simulator from minimum snap, 320 rollouts a task: what learning is held against."""
    space = Whitening.of(problem.tasks.poses, problem.durations_s)
    found = search_in_simulator(
        space,
        np.zeros(space.z_shape),
        np.zeros(space.durations_s.shape),
        problem.arena,
        seed=problem.seed,
        tasks=problem.indices,
        settings=SearchSettings() if problem.timing == "retimed" else SearchSettings(theta_sd=0.0),
    )
    return Planned(space.plan(found.z, found.theta), np.zeros(len(space), bool))


def learned_polished(problem: Problem) -> Planned:
    """The best of learned, analytic and minimum snap by two flights each, then searched from.

    Raises:
        InputError: as `learned`.
    """
    return _polished(problem, _solve(problem, *_learned_cost(problem, problem.model)))


def analytic_polished(problem: Problem) -> Planned:
    """The same without learning: what the polish itself is worth."""
    return _polished(problem, _solve_analytic(problem))


def _learned_cost(problem: Problem, name: str) -> tuple[TrackingCost, PlannerOptions]:
    model = _fitting(problem, name)
    assert model.card is not None  # noqa: S101 - a loaded model has one
    return model, PlannerOptions(problem.timing, model.card.snap_weight)


def _fitting(problem: Problem, name: str) -> CostModel:
    """A model, if it is of the problem's vehicle and loop."""
    model = load_model(name)
    check_fits(model, fingerprint(problem.vehicle, problem.world.loop), problem.world.loop)
    return model


def _solve_analytic(problem: Problem) -> PlanResult:
    return _solve(problem, ThrustProxy(), PlannerOptions(problem.timing, ANALYTIC_SNAP_WEIGHT))


def _solve(problem: Problem, cost: TrackingCost, options: PlannerOptions) -> PlanResult:
    return plan_batch(problem.tasks, problem.durations_s, cost, options)


def _solved(result: PlanResult) -> Planned:
    return Planned(result.plans, np.array([reason is not None for reason in result.fallback]))


def _polished(problem: Problem, solved: PlanResult) -> Planned:
    space = Whitening.of(problem.tasks.poses, problem.durations_s)
    candidates = candidates_of(space, solved)
    plans = polish(
        space, candidates, problem.arena, seed=problem.seed, tasks=problem.indices, timing=problem.timing
    ).plans
    same = (plans.coefficients == space.minimum.coefficients).all(axis=(1, 2, 3))
    return Planned(plans, same)


METHODS: dict[str, Method] = {
    "minimum-snap": minimum_snap,
    "minimum-snap-drag": minimum_snap_drag,
    "minimum-snap-l1": minimum_snap_l1,
    "paper": paper,
    "mlp-knots": mlp_knots,
    "analytic": analytic,
    "analytic-long": analytic_long,
    "learned": learned,
    "analytic-polished": analytic_polished,
    "learned-polished": learned_polished,
    "search": search,
}


def find_method(name: str) -> Method:
    """One of the methods.

    Raises:
        InputError: there is none of that name.
    """
    if name not in METHODS:
        raise InputError(f"no method `{name}`; there are {', '.join(METHODS)}")
    return METHODS[name]


def baseline_model(model: str, recipe: str) -> str:
    """The model that a baseline uses beside a learned one: the same name or path, and the recipe's name after it."""
    return f"{model.removesuffix(SUFFIX)}-{recipe}{SUFFIX if model.endswith(SUFFIX) else ''}"


def shipped_model(world: World) -> str:
    """The name of the model that ships for a world's vehicle and loop."""
    return f"{world.base_vehicle.name}-{world.loop}"
