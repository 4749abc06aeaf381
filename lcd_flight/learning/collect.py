"""Make a data set: shard after shard of plans flown in the simulator, going on where an earlier run stopped.

Shard k is a pure function of the configuration and k, so the bytes on disk do not depend on interruptions, on the
number of cores or on the count asked for.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lcd_flight.learning.dataset import Dataset
from lcd_flight.learning.fingerprint import described
from lcd_flight.learning.progress import Meter, ProgressCallback, ignore
from lcd_flight.learning.rebuild import trajectories
from lcd_flight.learning.rollouts import Plans, Rollouts, Source
from lcd_flight.learning.sources import optima, random_plans, training_tasks, whitening
from lcd_flight.model import IntArray, RolloutLabels, RolloutOptions, Simulator, World
from lcd_flight.model.streams import Stream
from lcd_flight.planning.search import Arena, Generation, SearchSettings, search


@dataclass(frozen=True, slots=True)
class Mix:
    """What a shard is made of."""

    search_tasks: int = 180
    """Tasks that are searched in the simulator; every sample of a search is a row."""
    search_population: int = 16
    search_generations: int = 20
    random_tasks: int = 1984
    """Tasks with their minimum snap and random perturbations of it."""
    random_draws: int = 3
    """Perturbations of each."""

    @property
    def tasks(self) -> int:
        """In a shard."""
        return self.search_tasks + self.random_tasks

    @property
    def rows(self) -> int:
        """In a whole shard."""
        searched = self.search_tasks * self.search_population * self.search_generations
        return searched + self.random_tasks * (1 + self.random_draws)


@dataclass(frozen=True, slots=True)
class CollectConfig:
    """What a data set is a function of, besides its length."""

    world: World
    seed: int
    drags: tuple[int, ...] = (1, 2, 3, 4, 5)
    """Drag configurations, dealt out to the tasks in turn."""
    mix: Mix = field(default_factory=Mix)

    def drag(self, task: IntArray) -> IntArray:
        """(N,) the drag configuration of each task."""
        return np.asarray(self.drags)[task % len(self.drags)]


def collect(
    config: CollectConfig, count: int, folder: Path, simulator: Simulator, progress: ProgressCallback = ignore
) -> Dataset:
    """Bring the data set in `folder` to at least `count` rollouts; what is there already stays as it is.

    Raises:
        InputError: a shard there is damaged or of another configuration, or the folder cannot be written to.
    """
    dataset = Dataset(folder, described(config))
    wanted = shard_rows(count, config.mix.rows)
    there = [dataset.rows(number) for number in range(len(wanted))]
    done = sum(min(have, want) for have, want in zip(there, wanted, strict=True))
    meter = Meter(progress, count, "rollouts", done)
    for number, (have, want) in enumerate(zip(there, wanted, strict=True)):
        if have < want:
            dataset.write(number, shard(config, number, simulator).take(slice(0, want)))
            meter.advance(want - have, f"shard {number + 1} of {len(wanted)}")
    return dataset


def shard_rows(count: int, whole: int) -> list[int]:
    """How many rows each shard has: whole ones, and the last as short as it must be."""
    return [min(whole, count - first) for first in range(0, count, whole)]


def shard(config: CollectConfig, number: int, simulator: Simulator) -> Rollouts:
    """All rows of one shard: those of the searches, then optima and random perturbations."""
    mix, segments = config.mix, config.world.sampler.waypoints - 1
    task = number * mix.tasks + np.arange(mix.tasks)
    searched, chosen = task[: mix.search_tasks], task[mix.search_tasks :]
    draws = np.tile(np.arange(mix.random_draws), len(chosen))
    perturbed = random_plans(config.seed, np.repeat(chosen, mix.random_draws), draws, segments)
    plans = Plans.concatenate([optima(chosen, segments), perturbed])
    rows = number * mix.rows + np.arange(len(plans))
    return Rollouts.concatenate([*searches(config, searched, simulator), fly(config, plans, rows, simulator)])


def searches(config: CollectConfig, task: IntArray, simulator: Simulator) -> list[Rollouts]:
    """Every sample of a search from minimum snap for each task (N,), generation by generation."""
    found: list[Rollouts] = []
    settings = SearchSettings(config.mix.search_population, config.mix.search_generations)
    for drag, members in _by_drag(config.drag(task)):
        chosen = task[members]
        space = whitening(training_tasks(config.world.sampler, config.seed, chosen), config.world.speed)
        search(
            space,
            np.zeros(space.z_shape),
            np.zeros(space.durations_s.shape),
            Arena(simulator, config.world.vehicle(drag), options_of(config.world)),
            seed=config.seed,
            tasks=chosen,
            settings=settings,
            watch=lambda g, chosen=chosen, drag=drag: found.append(_rollouts(g, chosen, drag)),  # type: ignore[misc]
        )
    return found


def _rollouts(generation: Generation, task: IntArray, drag: int) -> Rollouts:
    """The rows of one generation."""
    tasks, population = generation.costs.shape
    count = tasks * population
    plans = Plans(
        np.repeat(task, population),
        np.full(count, Source.SEARCH),
        generation.z.reshape(count, -1).astype(np.float32),
        generation.theta.reshape(count, -1).astype(np.float32),
    )
    return Rollouts(plans, np.full(count, drag), np.repeat(generation.noise_seed, population), generation.labels)


def fly(config: CollectConfig, plans: Plans, rows: IntArray, simulator: Simulator) -> Rollouts:
    """Fly each plan once, with the drag of its task and noise of its own.

    rows: (N,) global numbers of the rows, which their noise is keyed by.
    """
    drag = config.drag(plans.task)
    seeds = Stream(config.seed, "training/noise").seeds(rows)
    flown = trajectories(config.world, config.seed, plans)
    options = options_of(config.world)
    groups = _by_drag(drag)
    parts = [simulator.rollout(flown.take(m), config.world.vehicle(d), seeds[m], options) for d, m in groups]
    labels = RolloutLabels.concatenate(parts)
    back = np.argsort(np.concatenate([members for _, members in groups]))
    return Rollouts(plans, drag, seeds, labels.take(back))


def options_of(world: World) -> RolloutOptions:
    """How a world's rollouts are flown."""
    return RolloutOptions(loop=world.loop, start_aligned=world.start_aligned)


def _by_drag(drag: IntArray) -> list[tuple[int, IntArray]]:
    """Each configuration that occurs, and the rows it occurs in."""
    return [(d, np.flatnonzero(drag == d)) for d in sorted(set(drag.tolist()))]
