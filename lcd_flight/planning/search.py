"""Search in the simulator: the cross-entropy method in the whitened variables, many tasks at once.

Used for data (every sample is handed out) and for polishing a plan. Each generation draws a population around a mean,
flies all of it, and moves the mean and the spread to its best fifth, weighted by the logarithm of the rank.

A task's draws and noise come from streams keyed by (seed, task), so its result does not depend on which tasks are
searched beside it. Within a population the noise is the same for all, so that luck does not choose; the next
generation gets another, so that nothing is fitted to one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lcd_flight.model import (
    FloatArray,
    IntArray,
    RolloutLabels,
    RolloutOptions,
    SeedArray,
    Simulator,
    Trajectories,
    Vehicle,
)
from lcd_flight.model.streams import Stream
from lcd_flight.planning.knots import Whitening

EARLY_EXIT_ERROR_M = 5.0
"""A rollout that left the model's validity counts as an error of at least this."""


@dataclass(frozen=True, slots=True)
class SearchSettings:
    """How far and how long to search."""

    population: int = 16
    """Rollouts of each task in each generation."""
    generations: int = 20
    elite_share: float = 0.2
    z_sd: float = 0.4
    """Initial standard deviation of z for one segment; for S of them it is divided by sqrt(S), since the snap that z
    is relative to is the sum over all."""
    theta_sd: float = 0.1
    """Initial standard deviation of theta; 0 keeps the durations."""


@dataclass(frozen=True, slots=True)
class Arena:
    """Where plans are flown, and what counts there."""

    simulator: Simulator
    vehicle: Vehicle
    options: RolloutOptions
    handicap: Callable[[Trajectories], FloatArray] | None = None
    """(N,) what is added to each plan's cost, e.g. for limits that it breaks; None: nothing."""

    def cost(self, plans: Trajectories, labels: RolloutLabels) -> FloatArray:
        """(N,) of plans that were flown."""
        flown = tracking_cost(labels)
        return flown if self.handicap is None else flown + self.handicap(plans)


@dataclass(frozen=True, slots=True, eq=False)
class Generation:
    """Everything that was flown in one generation: N tasks, P samples of each; the first is the population's mean."""

    number: int
    """From 0."""
    z: FloatArray
    """(N, P, S - 1, 3, 4)"""
    theta: FloatArray
    """(N, P, S)"""
    plans: Trajectories
    """N P plans, task by task."""
    labels: RolloutLabels
    """Of the plans."""
    costs: FloatArray
    """(N, P)"""
    noise_seed: SeedArray
    """(N,) of each task's population."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The best sample of each of N tasks, over all generations."""

    z: FloatArray
    """(N, S - 1, 3, 4)"""
    theta: FloatArray
    """(N, S)"""
    cost: FloatArray
    """(N,) `Arena.cost`, as flown then."""
    mean_z: FloatArray
    """(N, S - 1, 3, 4) what the populations came to be drawn around: under no noise's spell, but never flown."""
    mean_theta: FloatArray
    """(N, S)"""


def search(
    whitening: Whitening,
    z: FloatArray,
    theta: FloatArray,
    arena: Arena,
    *,
    seed: int,
    tasks: IntArray,
    settings: SearchSettings | None = None,
    watch: Callable[[Generation], None] | None = None,
) -> Found:
    """Improve the plans at z (N, S - 1, 3, 4) and theta (N, S) by flying variations of them.

    Args:
        whitening: the variables of the N tasks.
        z: where to start; the start itself is flown first.
        theta: likewise.
        arena: simulator, vehicle and options.
        seed: of draws and noise.
        tasks: (N,) the tasks' global numbers, which name their random streams.
        settings: how far and how long.
        watch: is handed each generation when it has been flown; an exception from it ends the search.

    Returns:
        The best sample of each task. Samples are rounded to single precision before they are flown, so that what a
        data set keeps in half the space is what was flown.
    """
    settings = settings or SearchSettings()
    count, segments = theta.shape
    crowd = whitening.take(np.repeat(np.arange(count), settings.population))
    mean = np.concatenate([z.reshape(count, -1), theta], axis=1)
    spread = np.full_like(mean, settings.z_sd / math.sqrt(segments))
    spread[:, -segments:] = settings.theta_sd
    best, lowest = mean.copy(), np.full(count, np.inf)
    for number in range(settings.generations):
        samples = _population(mean, spread, Stream(seed, f"search/{number}"), tasks, settings.population)
        generation = _fly(number, samples, crowd, arena, Stream(seed, "search/noise").words(tasks, 1, number)[:, 0])
        mean, spread = _elite_moments(samples, generation.costs, spread, settings.elite_share)
        best, lowest = _better(best, lowest, samples, generation.costs)
        if watch is not None:
            watch(generation)
    return Found(
        best[:, :-segments].reshape(z.shape),
        best[:, -segments:],
        lowest,
        mean[:, :-segments].reshape(z.shape),
        mean[:, -segments:],
    )


def tracking_cost(labels: RolloutLabels) -> FloatArray:
    """(N,) log of the p = 8 mean of the position error in m, a smooth stand-in for the largest."""
    floor = np.where(labels.valid, 1e-6, EARLY_EXIT_ERROR_M)
    return np.asarray(np.log(np.maximum(labels.p8_error_m, floor)))


def _population(mean: FloatArray, spread: FloatArray, stream: Stream, tasks: IntArray, size: int) -> FloatArray:
    """(N, P, D) samples around mean (N, D), the mean itself first."""
    count, dimensions = mean.shape
    normals = stream.normals(tasks, (size - 1) * dimensions).reshape(count, size - 1, dimensions)
    samples = np.concatenate([mean[:, None], mean[:, None] + spread[:, None] * normals], axis=1)
    return samples.astype(np.float32).astype(np.float64)


def _fly(number: int, samples: FloatArray, crowd: Whitening, arena: Arena, noise: SeedArray) -> Generation:
    """Fly samples (N, P, D), with the noise seed of each task (N,)."""
    count, size, _ = samples.shape
    _, inner, rows, axes = crowd.z_shape
    z = samples[..., : inner * rows * axes].reshape(count, size, inner, rows, axes)
    theta = samples[..., inner * rows * axes :]
    plans = crowd.plan(z.reshape(crowd.z_shape), theta.reshape(count * size, -1))
    labels = arena.simulator.rollout(plans, arena.vehicle, np.repeat(noise, size), arena.options)
    return Generation(number, z, theta, plans, labels, arena.cost(plans, labels).reshape(count, size), noise)


def _elite_moments(
    samples: FloatArray, costs: FloatArray, spread: FloatArray, share: float
) -> tuple[FloatArray, FloatArray]:
    """The next mean and standard deviation (N, D): those of each task's elite, best ranks weighing most.

    The spread is about the mean that the population was drawn around, so that it grows along a step that paid, and
    half of the old variance stays, so that few elites do not end the search.
    """
    elites = max(2, math.ceil(share * samples.shape[1]))
    order = np.argsort(costs, axis=1, kind="stable")[:, :elites]
    chosen = np.take_along_axis(samples, order[..., None], axis=1)
    weights = math.log(elites + 0.5) - np.log(np.arange(1, elites + 1))
    weights = (weights / weights.sum())[None, :, None]
    mean = (weights * chosen).sum(axis=1)
    variance = (weights * (chosen - samples[:, :1]) ** 2).sum(axis=1)
    return mean, np.sqrt(0.5 * (variance + spread**2))


def _better(
    best: FloatArray, lowest: FloatArray, samples: FloatArray, costs: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The best so far of each task, with this population looked through."""
    winner = np.argmin(costs, axis=1)
    cost = np.take_along_axis(costs, winner[:, None], axis=1)[:, 0]
    sample = np.take_along_axis(samples, winner[:, None, None], axis=1)[:, 0]
    improved = cost < lowest
    return np.where(improved[:, None], sample, best), np.where(improved, cost, lowest)
