"""One shard of a data set: a pure function of the configuration and its number.

So the bytes on disk do not depend on interruptions, cores, machines or the count asked for; a shorter shard is the
beginning of the whole one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcd_flight.learning.collect_config import CollectConfig
from lcd_flight.learning.flying import fly
from lcd_flight.learning.given import GivenPlans, jittered
from lcd_flight.learning.mix import SOURCES, Order
from lcd_flight.learning.rollouts import Plans, Rollouts, Source
from lcd_flight.learning.searching import searched
from lcd_flight.learning.sources import optima, random_plans, retimed_plans
from lcd_flight.model import InputError, IntArray, Simulator
from lcd_flight.planning.search import SearchSettings


@dataclass(frozen=True, slots=True)
class ShardJob:
    """A shard to be made."""

    number: int
    rows: int
    """Its first rows; a whole shard has `Mix.rows`."""


@dataclass(frozen=True, slots=True, eq=False)
class ShardMaker:
    """All that is needed to make the shards of a data set, here or on another machine."""

    config: CollectConfig
    simulator: Simulator
    given: GivenPlans | None = None
    threads: int = 1
    """That a rollout may use (0: all cores)."""

    def __post_init__(self) -> None:
        """Check that the given plans are those of the configuration.

        Raises:
            InputError: they are others, or the mix asks for plans and none are given, or the other way round.
        """
        if (self.config.mix.plans > 0.0) != (self.given is not None):
            raise InputError("sources: plans=SHARE and a file of plans go together; give both or none")
        if self.given is not None and self.given.sha256 != self.config.plans_sha256:
            raise InputError("the given plans are not those of the configuration")

    def __call__(self, job: ShardJob) -> Rollouts:
        """The first rows of a shard, task by task in the order of the mix."""
        order = Order.of(self.config.mix).until(job.rows)
        parts, places = [], []
        for source in SOURCES.values():
            members = order.tasks_of(source)
            if len(members):
                place = (order.first[members, None] + np.arange(self.config.mix.rows_of_a_task(source))).reshape(-1)
                task = job.number * self.config.mix.tasks + members
                parts.append(self._searched(task) if source == Source.SEARCH else self._flown(job, source, task, place))
                places.append(place)
        return Rollouts.concatenate(parts).take(np.argsort(np.concatenate(places))[: job.rows])

    def _flown(self, job: ShardJob, source: Source, task: IntArray, place: IntArray) -> Rollouts:
        """The rows of tasks (N,) of a source that is not searched, task by task; place: theirs in the shard."""
        draws = self.config.mix.rows_of_a_task(source)
        row = job.number * self.config.mix.rows + place
        repeated, draw = np.repeat(task, draws), np.tile(np.arange(draws), len(task))
        if source == Source.GIVEN:
            first_visit = job.number * self.config.mix.tasks_in_a_shard(source)
            plans = self._given(first_visit + np.repeat(np.arange(len(task)), draws), draw, row)
        else:
            plans = self._perturbed(source, repeated, draw)
        return fly(self.config, plans, row, self.simulator, self.threads)

    def _perturbed(self, source: Source, task: IntArray, draw: IntArray) -> Plans:
        seed, segments, short = self.config.seed, self.config.segments, self.config.short_yaw(task)
        if source == Source.OPTIMUM:
            return optima(task, short, segments)
        perturb = random_plans if source == Source.RANDOM else retimed_plans
        return perturb(seed, task, short, draw, segments)

    def _given(self, visit: IntArray, draw: IntArray, row: IntArray) -> Plans:
        assert self.given is not None  # noqa: S101 - as checked when it was made
        return jittered(self.given.visit(visit), row, draw == 0, self.config.seed)

    def _searched(self, task: IntArray) -> Rollouts:
        """Every sample of a search from minimum snap for each task (N,)."""
        config, mix = self.config, self.config.mix
        start = optima(task, config.short_yaw(task), config.segments)
        settings = SearchSettings(mix.population, mix.generations)
        return searched(config, start, settings, self.simulator, kept=mix.population, threads=self.threads)
