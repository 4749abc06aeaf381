"""How well plans are flown: crash rates and their standard errors over tasks and noise, for several methods at once.

Every method plans the same tasks and is judged by the same noise, from streams that neither data nor searches draw
from; so two methods can be compared task by task.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from lcd_flight.learning.methods import Planned, Problem, find_method, shipped_model
from lcd_flight.learning.progress import Meter, ProgressCallback, ignore
from lcd_flight.learning.sampling import first_tasks
from lcd_flight.model import (
    BoolArray,
    FloatArray,
    InputError,
    RolloutOptions,
    SeedArray,
    Simulator,
    Tasks,
    Vehicle,
    World,
)
from lcd_flight.model.streams import Stream
from lcd_flight.planning.minimum_snap import minimum_snap_batch, snap
from lcd_flight.planning.planner import Timing

_MOST_NOISE_SEEDS = 1 << 20
_CHUNK = 100
"""Tasks planned and flown between two reports of progress."""


@dataclass(frozen=True, slots=True)
class MethodFigures:
    """One row of the table."""

    crash_rate: float
    """Per cent of tasks x noise seeds with a largest error above 1.5 m, or that left the model's validity."""
    crash_rate_error: float | None
    """Its standard error in per cent, clustered by task: the rollouts of one plan crash together. None: one task."""
    tasks: int
    noise_seeds: int
    median_max_error_m: float
    p95_max_error_m: float
    largest_max_error_m: float
    """Of a rollout that left the model's validity: what was seen until then."""
    median_waypoint_error_m: float
    """Median over the rollouts of the largest distance from a waypoint at its instant."""
    median_relative_snap: float
    """Snap of the plan over minimum snap at the paper's times."""
    saturation_share: float
    """Mean share of motor commands that were clipped."""
    fell_back: int
    """Tasks for which the method failed and minimum snap was flown."""
    plan_time_ms: float
    """Per task, planned in batches on this machine; informative, it varies between runs."""


@dataclass(frozen=True, slots=True, eq=False)
class MethodRun:
    """What one method did, task by task."""

    max_error_m: FloatArray
    """(N, noise seeds)"""
    crashed: BoolArray
    """(N, noise seeds)"""
    waypoint_error_m: FloatArray
    """(N, noise seeds) largest distance from a waypoint at its instant, of those that were reached."""
    saturation_share: FloatArray
    """(N, noise seeds)"""
    relative_snap: FloatArray
    """(N,)"""
    fell_back: BoolArray
    """(N,)"""
    plan_seconds: float
    """For all tasks together."""


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """The table, and what stands behind it."""

    world: str
    options: EvaluationOptions
    methods: dict[str, MethodFigures]
    runs: dict[str, MethodRun]

    def as_json(self) -> dict[str, Any]:
        """What `lcd evaluate --json` prints."""
        table = {name: asdict(figures) for name, figures in self.methods.items()}
        return {"world": self.world, **asdict(self.options), "methods": table}


@dataclass(frozen=True, slots=True)
class EvaluationOptions:
    """How to evaluate, beside world, tasks and methods."""

    seed: int = 0
    """Of the tasks (where they are sampled) and of the noise."""
    timing: Timing = "retimed"
    """For all methods but minimum snap, which keeps the paper's."""
    drag: int = 3
    """Configuration that is planned for and flown in, counted from 1."""
    noise_seeds: int = 3
    """Rollouts of each plan."""
    model: str | None = None
    """Name or path of the learned cost; None: the one that ships for the world's vehicle and loop."""


def evaluate(
    world: World,
    methods: Sequence[str],
    tasks: Tasks | int,
    simulator: Simulator,
    options: EvaluationOptions | None = None,
    progress: ProgressCallback = ignore,
) -> Evaluation:
    """Plan and fly tasks with each method.

    tasks: given ones, or how many of the sampler's to take.

    Raises:
        InputError: no such method or drag configuration, or a model that is missing or does not fit.
    """
    options = options or EvaluationOptions()
    for name in methods:
        find_method(name)
    tasks = first_tasks(world.sampler, options.seed, tasks) if isinstance(tasks, int) else tasks
    whole = Problem(
        world=world,
        vehicle=_vehicle(world, options.drag),
        tasks=tasks,
        indices=np.arange(len(tasks)),
        timing=options.timing,
        simulator=simulator,
        seed=options.seed,
        model=options.model or shipped_model(world),
    )
    meter = Meter(progress, len(tasks) * len(methods), "tasks")
    runs = {name: _run(name, whole, options, meter) for name in methods}
    return Evaluation(world.name, options, {name: _figures(run) for name, run in runs.items()}, runs)


def _vehicle(world: World, drag: int) -> Vehicle:
    try:
        return world.vehicle(drag)
    except IndexError as error:
        raise InputError(f"no drag configuration {drag}: {error}") from error


def _run(name: str, whole: Problem, options: EvaluationOptions, meter: Meter) -> MethodRun:
    """Plan and fly all tasks by one method, chunk by chunk."""
    parts = []
    for first in range(0, len(whole.tasks), _CHUNK):
        problem = whole.take(np.arange(first, min(first + _CHUNK, len(whole.tasks))))
        began_s = time.perf_counter()
        planned = find_method(name)(problem)
        seconds = time.perf_counter() - began_s
        parts.append(_flown(problem, planned, options, seconds))
        meter.advance(len(problem.tasks), name)
    arrays = {f.name: [getattr(p, f.name) for p in parts] for f in fields(MethodRun)}
    seconds = sum(arrays.pop("plan_seconds"))
    return MethodRun(**{k: np.concatenate(v) for k, v in arrays.items()}, plan_seconds=seconds)


def _flown(problem: Problem, planned: Planned, options: EvaluationOptions, seconds: float) -> MethodRun:
    """Fly each plan once for each noise seed."""
    seeds = _noise(problem, options)
    rollouts = RolloutOptions(loop=problem.world.loop, start_aligned=problem.world.start_aligned)
    tasks, repeats = seeds.shape
    plans = planned.plans.take(np.repeat(np.arange(tasks), repeats))
    labels = problem.simulator.rollout(plans, problem.vehicle, seeds.reshape(-1), rollouts)
    shape = (tasks, repeats)
    return MethodRun(
        max_error_m=labels.max_error_m.reshape(shape),
        crashed=labels.crashed.reshape(shape),
        waypoint_error_m=np.nanmax(labels.waypoint_error_m, axis=1).reshape(shape),
        saturation_share=labels.saturation_share.reshape(shape),
        relative_snap=_relative_snap(problem, planned),
        fell_back=planned.fell_back,
        plan_seconds=seconds,
    )


def _noise(problem: Problem, options: EvaluationOptions) -> SeedArray:
    """(N, noise seeds) the same for every method."""
    repeats = np.arange(options.noise_seeds)
    rows = problem.indices[:, None] * _MOST_NOISE_SEEDS + repeats
    return Stream(options.seed, "evaluation/noise").seeds(rows.reshape(-1)).reshape(rows.shape)


def _relative_snap(problem: Problem, planned: Planned) -> FloatArray:
    """(N,) snap of the positions over that of minimum snap at the paper's times."""
    least = minimum_snap_batch(problem.tasks.poses, problem.durations_s)
    return np.asarray(snap(planned.plans)[:, :3].sum(axis=1) / snap(least)[:, :3].sum(axis=1))


def _figures(run: MethodRun) -> MethodFigures:
    tasks, repeats = run.crashed.shape
    by_task = 100.0 * run.crashed.mean(axis=1)
    return MethodFigures(
        crash_rate=float(by_task.mean()),
        crash_rate_error=float(by_task.std(ddof=1) / np.sqrt(tasks)) if tasks > 1 else None,
        tasks=tasks,
        noise_seeds=repeats,
        median_max_error_m=float(np.median(run.max_error_m)),
        p95_max_error_m=float(np.percentile(run.max_error_m, 95.0)),
        largest_max_error_m=float(run.max_error_m.max()),
        median_waypoint_error_m=float(np.median(run.waypoint_error_m)),
        median_relative_snap=float(np.median(run.relative_snap)),
        saturation_share=float(run.saturation_share.mean()),
        fell_back=int(run.fell_back.sum()),
        plan_time_ms=1e3 * run.plan_seconds / tasks,
    )
