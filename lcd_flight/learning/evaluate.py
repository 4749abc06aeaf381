"""How well plans are flown: several methods plan the same tasks and are judged by the same noise.

Tasks and noise come from streams that neither data nor searches draw from; so two methods can be compared task by
task. A run keeps what it has finished, method by method, and goes on from there.
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from lcd_flight.learning.evaluation import Evaluation, EvaluationOptions, MethodRun
from lcd_flight.learning.evaluation_files import Parts
from lcd_flight.learning.methods import Planned, Problem, find_method, shipped_model
from lcd_flight.learning.progress import Meter, ProgressCallback, ignore
from lcd_flight.learning.sampling import first_tasks
from lcd_flight.model import (
    FloatArray,
    InputError,
    RolloutOptions,
    SeedArray,
    Simulator,
    Tasks,
    Trajectories,
    Vehicle,
    World,
)
from lcd_flight.model.streams import Stream
from lcd_flight.planning.minimum_snap import minimum_snap_batch, snap
from lcd_flight.planning.times import shortest_yaw

_MOST_NOISE_SEEDS = 1 << 20
_CHUNK = 128
"""Tasks that are planned in one call; the calls run side by side."""


def evaluate(
    world: World,
    methods: Sequence[str],
    tasks: Tasks | int,
    simulator: Simulator,
    options: EvaluationOptions | None = None,
    progress: ProgressCallback = ignore,
    parts: Parts | None = None,
) -> Evaluation:
    """Plan and fly tasks with each method, in each drag configuration.

    tasks: given ones, or how many of the sampler's to take.
    parts: where finished methods are kept and found again; None: nowhere.

    Raises:
        InputError: no such method or drag configuration, a model that is missing or does not fit, or parts that
            cannot be read or written.
    """
    options = options or EvaluationOptions()
    tasks = tasks_of(world, tasks, options)
    problems = {drag: problem_of(world, tasks, simulator, options, drag) for drag in options.drags}
    for error in refusals(methods, next(iter(problems.values()))).values():
        raise error
    cells = [(name, drag) for name in methods for drag in problems]
    runs = {cell: run for cell in cells if parts and (run := parts.load(*cell))}
    meter = Meter(progress, len(tasks) * len(cells), "plans", len(tasks) * len(runs))
    noise = _noise(len(tasks), options)
    for name, drag in cells:
        if (name, drag) not in runs:
            runs[name, drag] = _run(name, problems[drag], options, noise, meter)
            if parts:
                parts.save(name, drag, runs[name, drag])
    together = {name: MethodRun.beside([runs[name, drag] for drag in problems]) for name in methods}
    return Evaluation(world.name, options, together, noise)


def tasks_of(world: World, tasks: Tasks | int, options: EvaluationOptions) -> Tasks:
    """The tasks as they are to be flown: given or sampled, yaw as the options say."""
    tasks = first_tasks(world.sampler, options.seed, tasks) if isinstance(tasks, int) else tasks
    return replace(tasks, yaws_rad=shortest_yaw(tasks.yaws_rad)) if options.yaw == "short" else tasks


def problem_of(world: World, tasks: Tasks, simulator: Simulator, options: EvaluationOptions, drag: int) -> Problem:
    """What a method is told about given tasks in one drag configuration.

    Raises:
        InputError: there is no such configuration.
    """
    return Problem(
        world=world,
        vehicle=_vehicle(world, drag),
        tasks=tasks,
        indices=np.arange(len(tasks)),
        timing=options.timing,
        simulator=simulator,
        seed=options.seed,
        model=options.model or shipped_model(world),
    )


def _vehicle(world: World, drag: int) -> Vehicle:
    try:
        return world.vehicle(drag)
    except IndexError as error:
        raise InputError(f"no drag configuration {drag}: {error}") from error


def refusals(methods: Sequence[str], problem: Problem) -> dict[str, InputError]:
    """Methods that cannot plan and fly a problem's first task, and why. Loads kernels and models, before any clock.

    Raises:
        InputError: there is no method of a name.
    """
    found = {}
    for name, method in {name: find_method(name) for name in methods}.items():
        first = problem.take(np.arange(1))
        try:
            planned = method(first)
            options = replace(rollouts_of(first, planned), threads=1)
            first.simulator.rollout(planned.plans, first.vehicle, np.zeros(1, np.uint64), options)
        except InputError as error:
            found[name] = error
    return found


def _run(name: str, problem: Problem, options: EvaluationOptions, noise: SeedArray, meter: Meter) -> MethodRun:
    """Plan all tasks by one method in one drag configuration, then fly each plan once for each noise seed."""
    began_s = time.process_time()
    planned = _planned(name, problem, meter)
    seconds = time.process_time() - began_s
    tasks, repeats = noise.shape
    plans = planned.plans.take(np.repeat(np.arange(tasks), repeats))
    vehicle = flown_vehicle(problem, options)
    labels = problem.simulator.rollout(plans, vehicle, noise.reshape(-1), rollouts_of(problem, planned))
    shape = (tasks, 1, repeats)
    return MethodRun(
        max_error_m=labels.max_error_m.reshape(shape),
        crashed=labels.crashed.reshape(shape),
        waypoint_error_m=np.nanmax(labels.waypoint_error_m, axis=1).reshape(shape),
        saturation_share=labels.saturation_share.reshape(shape),
        relative_snap=_relative_snap(problem, planned)[:, None],
        fell_back=planned.fell_back[:, None],
        plan_seconds=seconds,
    )


def flown_vehicle(problem: Problem, options: EvaluationOptions) -> Vehicle:
    """The vehicle that flies; planner and controller believe in the problem's."""
    return problem.vehicle if options.thrust_share == 1.0 else problem.vehicle.weaker(options.thrust_share)


def rollouts_of(problem: Problem, planned: Planned) -> RolloutOptions:
    """How plans are flown, by the controller that they were made for."""
    return RolloutOptions(
        loop=problem.world.loop,
        controller=planned.controller,
        nominal=problem.vehicle,
        start_aligned=problem.world.start_aligned,
    )


def _planned(name: str, problem: Problem, meter: Meter) -> Planned:
    """All tasks, in calls side by side on all cores; a task's plan does not depend on its call."""
    method, count = find_method(name), len(problem.tasks)
    chunks = [np.arange(first, min(first + _CHUNK, count)) for first in range(0, count, _CHUNK)]
    found = []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        work = [pool.submit(method, problem.take(chunk)) for chunk in chunks]
        try:
            for chunk, done in zip(chunks, work, strict=True):
                found.append(done.result())
                meter.advance(len(chunk), f"{problem.world.name} {name}")
        except BaseException:  # above all KeyboardInterrupt: what has not begun is not planned any more
            pool.shutdown(wait=True, cancel_futures=True)
            raise
    plans = Trajectories(
        np.concatenate([p.plans.durations_s for p in found]), np.concatenate([p.plans.coefficients for p in found])
    )
    return replace(found[0], plans=plans, fell_back=np.concatenate([p.fell_back for p in found]))


def _noise(tasks: int, options: EvaluationOptions) -> SeedArray:
    """(N, noise seeds) the same for every method and drag configuration."""
    rows = np.arange(tasks)[:, None] * _MOST_NOISE_SEEDS + np.arange(options.noise_seeds)
    return Stream(options.seed, "evaluation/noise").seeds(rows.reshape(-1)).reshape(rows.shape)


def _relative_snap(problem: Problem, planned: Planned) -> FloatArray:
    """(N,) snap of the positions over that of minimum snap at the paper's times."""
    least = minimum_snap_batch(problem.tasks.poses, problem.durations_s)
    return np.asarray(snap(planned.plans)[:, :3].sum(axis=1) / snap(least)[:, :3].sum(axis=1))
