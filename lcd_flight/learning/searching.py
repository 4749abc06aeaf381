"""Searches in the simulator as data: the samples of each become rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lcd_flight.learning.collect_config import CollectConfig
from lcd_flight.learning.flying import DragByRow, options_of
from lcd_flight.learning.rebuild import variables
from lcd_flight.learning.rollouts import Plans, Rollouts, Source
from lcd_flight.model import IntArray, Simulator
from lcd_flight.planning.search import Arena, Generation, SearchSettings, search


def searched(
    config: CollectConfig,
    start: Plans,
    settings: SearchSettings,
    simulator: Simulator,
    *,
    kept: int,
    retimed: bool = True,
    threads: int = 0,
) -> Rollouts:
    """Samples of a search from each plan of `start` (N): task by task, generation by generation.

    Args:
        config: world, seed and drag of each task.
        start: where each search begins, one plan of each task.
        settings: how far and how long.
        simulator: where.
        kept: how many samples of each generation become rows, the first of them its mean.
        retimed: whether the searches move time between segments.
        threads: that a rollout may use (0: all cores).
    """
    world, drag = config.world, config.drag(start.task)
    space = variables(world, config.seed, start)
    arena = DragByRow(simulator, world.drag_configurations, np.repeat(drag, settings.population))
    found: list[Rollouts] = []
    search(
        space,
        start.z.astype(np.float64).reshape(space.z_shape),
        start.theta.astype(np.float64),
        Arena(arena, world.base_vehicle, options_of(world, threads)),
        seed=config.seed,
        tasks=start.task,
        settings=settings if retimed else replace(settings, theta_sd=0.0),
        watch=lambda generation: found.append(_rows_of(generation, start, drag, kept)),
    )
    generations, tasks = settings.generations, len(start)
    order = np.arange(generations * tasks * kept).reshape(generations, tasks, kept)
    return Rollouts.concatenate(found).take(order.swapaxes(0, 1).reshape(-1))


def _rows_of(generation: Generation, start: Plans, drag: IntArray, kept: int) -> Rollouts:
    """The first rows of each task in one generation, task by task."""
    tasks, population = generation.costs.shape
    rows = (np.arange(tasks)[:, None] * population + np.arange(kept)).reshape(-1)
    plans = Plans(
        np.repeat(start.task, kept),
        np.repeat(start.short_yaw, kept),
        np.full(len(rows), Source.SEARCH),
        generation.z[:, :kept].reshape(len(rows), -1).astype(np.float32),
        generation.theta[:, :kept].reshape(len(rows), -1).astype(np.float32),
    )
    return Rollouts(plans, np.repeat(drag, kept), np.repeat(generation.noise_seed, kept), generation.labels.take(rows))
