"""Polish: candidates checked in the simulator, the best one improved by a search there, the finalists checked again.

    candidates (learned, analytic, minimum snap ...) -> each flown a few times -> cross-entropy search from the best
    -> best sample, last mean and start flown under noise that none of them has seen -> the best of these

Every step compares under common noise, so that luck does not choose. Noise and draws come from streams of their own,
which neither data nor evaluation use, keyed by (seed, task): a task's plan does not depend on those beside it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from lcd_flight.model import FloatArray, IntArray, RolloutLabels, SeedArray, Trajectories
from lcd_flight.model.streams import Stream
from lcd_flight.planning.knots import Whitening
from lcd_flight.planning.planner import PlanResult, Timing
from lcd_flight.planning.search import Arena, SearchSettings, search


@dataclass(frozen=True, slots=True)
class PolishSettings:
    """How many rollouts a polish may spend on a task."""

    candidate_flights: int = 2
    """Of each candidate."""
    search: SearchSettings = field(default_factory=SearchSettings)
    finalist_flights: int = 8
    """Of each finalist, with noise of their own."""

    def rollouts(self, candidates: int) -> int:
        """Flown for one task."""
        checks = candidates * self.candidate_flights + _FINALISTS * self.finalist_flights
        return checks + self.search.population * self.search.generations


_FINALISTS = 3
"""The best sample of the search, the mean that it ended with, and where it began."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """One proposal for each of N tasks, in the variables of a `Whitening`."""

    z: FloatArray
    """(N, S - 1, 3, 4)"""
    theta: FloatArray
    """(N, S)"""

    @staticmethod
    def minimum_snap(space: Whitening) -> Candidate:
        """Zeros."""
        return Candidate(np.zeros(space.z_shape), np.zeros(space.durations_s.shape))


def candidates_of(space: Whitening, solved: PlanResult) -> list[Candidate]:
    """What a solve offers: its plan, where it began (the analytic plan) if that was not minimum snap, minimum snap."""
    found = [Candidate(solved.z, solved.theta)]
    if solved.start_z.any() or solved.start_theta.any():
        found.append(Candidate(solved.start_z, solved.start_theta))
    return [*found, Candidate.minimum_snap(space)]


@dataclass(frozen=True, slots=True, eq=False)
class Polished:
    """What a polish came to, for each of N tasks."""

    plans: Trajectories
    chosen: IntArray
    """(N,) which candidate it began with."""
    cost: FloatArray
    """(N,) log of the p = 8 mean of the error in m, mean over the final flights; and the arena's handicap."""
    minimum_cost: FloatArray
    """(N,) the same of the start, under the same noise; never below `cost`."""
    largest_error_m: FloatArray
    """(N,) over the final flights."""


def polish(
    space: Whitening,
    candidates: list[Candidate],
    arena: Arena,
    *,
    seed: int,
    tasks: IntArray,
    timing: Timing = "retimed",
    settings: PolishSettings | None = None,
) -> Polished:
    """Improve the best candidate of each task by flying variations of it.

    Args:
        space: the variables of the N tasks.
        candidates: where a search may begin.
        arena: simulator, vehicle and options.
        seed: of draws and noise.
        tasks: (N,) global numbers of the tasks, which name their random streams.
        timing: whether the search may move time between segments.
        settings: how many rollouts.
    """
    settings = settings or PolishSettings()
    flights = _Flights(space, arena, seed, tasks)
    checked = np.stack([flights.cost(c, "candidates", settings.candidate_flights)[0] for c in candidates])
    chosen = checked.argmin(axis=0)
    start = _chosen(candidates, chosen)
    searching = settings.search if timing == "retimed" else replace(settings.search, theta_sd=0.0)
    found = search(space, start.z, start.theta, arena, seed=seed, tasks=tasks, settings=searching)
    finalists = [Candidate(found.z, found.theta), Candidate(found.mean_z, found.mean_theta), start]
    final = [flights.cost(c, "finalists", settings.finalist_flights) for c in finalists]
    costs = np.stack([cost for cost, _ in final])
    winner = costs.argmin(axis=0)
    best = _chosen(finalists, winner)
    return Polished(
        plans=space.plan(best.z, best.theta),
        chosen=chosen,
        cost=costs.min(axis=0),
        minimum_cost=costs[-1],
        largest_error_m=np.take_along_axis(np.stack([error for _, error in final]), winner[None], axis=0)[0],
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Flights:
    """Flies candidates under noise that is common to all candidates of a task."""

    space: Whitening
    arena: Arena
    seed: int
    tasks: IntArray

    def cost(self, candidate: Candidate, purpose: str, times: int) -> tuple[FloatArray, FloatArray]:
        """Mean cost (N,) and largest error (N,) over so many flights."""
        plans = self.space.plan(candidate.z, candidate.theta)
        flown = plans.take(np.repeat(np.arange(len(plans)), times))
        noise: SeedArray = Stream(self.seed, f"polish/{purpose}").words(self.tasks, times).reshape(-1)
        labels = self.arena.simulator.rollout(flown, self.arena.vehicle, noise, self.arena.options)
        shape = (len(plans), times)
        return self.arena.cost(flown, labels).reshape(shape).mean(axis=1), _error(labels).reshape(shape).max(axis=1)


def _error(labels: RolloutLabels) -> FloatArray:
    return np.where(labels.valid, labels.max_error_m, np.inf)


def _chosen(candidates: list[Candidate], which: IntArray) -> Candidate:
    """Row by row the candidate that `which` (N,) names."""
    rows = np.arange(len(which))
    z, theta = (np.stack([getattr(c, name) for c in candidates]) for name in ("z", "theta"))
    return Candidate(z[which, rows], theta[which, rows])
