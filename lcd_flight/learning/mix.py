"""What a data set is made of: its sources, their shares of the rows, and the order in which their tasks come.

A source turns one task into a fixed number of rows. The tasks of a shard stand in the order of weighted fair queueing:
a task comes when its source's share of the rows so far is due. So the first rows of a data set, however few, hold
about the same mix as all of it, and a shorter data set is the beginning of a longer one.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from lcd_flight.learning.rollouts import Source
from lcd_flight.model import InputError, IntArray

SHARD_ROWS = 1 << 15
"""Where nothing else is asked for."""
_EXACT = 1e-9


@dataclass(frozen=True, slots=True)
class Mix:
    """Shares of the rows by source, which add up to 1, and how many rows a task of each gives."""

    search: float = 0.88
    """Every sample of a search in the simulator."""
    random: float = 0.09
    """Perturbations of minimum snap, most of them with other times."""
    optimum: float = 0.03
    """Minimum snap."""
    times: float = 0.0
    """Minimum snap for other times at the same total."""
    plans: float = 0.0
    """Given plans, and jitter around them."""
    population: int = 16
    """Rollouts of a search's task in each generation."""
    generations: int = 20
    draws: int = 3
    """Rows of a task of `random` and of `times`."""
    jitters: int = 16
    """Rows of a given plan: itself first, then jitters around it."""
    shard_rows: int = SHARD_ROWS
    """A whole shard has as many whole tasks as fit into so many rows."""

    def __post_init__(self) -> None:
        """Check that it can be dealt out.

        Raises:
            InputError: negative shares, a sum that is not 1, or a share that is less than a task in a shard.
        """
        shares = {source: getattr(self, name) for name, source in SOURCES.items()}
        if not all(0.0 <= share <= 1.0 for share in shares.values()) or abs(sum(shares.values()) - 1.0) > _EXACT:
            raise InputError(f"sources: shares from 0 to 1 that add up to 1 are wanted, not {_told(self)}")
        for name, source in SOURCES.items():
            if shares[source] > 0.0 and self.tasks_in_a_shard(source) < 1:
                lump, most = self.rows_of_a_task(source), self.shard_rows
                remedy = f"{lump / most:.3g} or more" if lump <= most else f"shards of at least {lump} rows"
                raise InputError(f"sources: {name}={shares[source]:g} is less than a task in a shard; give {remedy}")

    def rows_of_a_task(self, source: Source) -> int:
        """How many rows one task of a source gives."""
        return {
            Source.SEARCH: self.population * self.generations,
            Source.RANDOM: self.draws,
            Source.TIMES: self.draws,
            Source.OPTIMUM: 1,
            Source.GIVEN: self.jitters,
        }[source]

    def tasks_in_a_shard(self, source: Source) -> int:
        """How many tasks of a source a whole shard has."""
        share: float = getattr(self, _NAMES[source])
        return int(self.shard_rows * share / self.rows_of_a_task(source) + _EXACT)

    @property
    def tasks(self) -> int:
        """Of all sources in a whole shard."""
        return sum(self.tasks_in_a_shard(source) for source in SOURCES.values())

    @property
    def rows(self) -> int:
        """Of a whole shard."""
        return sum(self.tasks_in_a_shard(source) * self.rows_of_a_task(source) for source in SOURCES.values())


SOURCES = {
    "search": Source.SEARCH,
    "random": Source.RANDOM,
    "optimum": Source.OPTIMUM,
    "times": Source.TIMES,
    "plans": Source.GIVEN,
}
"""The sources that can be mixed, by the names of their shares."""

_NAMES = {source: name for name, source in SOURCES.items()}


def parse_mix(text: str, shard_rows: int = SHARD_ROWS) -> Mix:
    """A mix from `search=0.9,random=0.1`; sources that are not named get nothing.

    Raises:
        InputError: an unknown source, a share that is no number, or as `Mix`.
    """
    shares: dict[str, Any] = dict.fromkeys(SOURCES, 0.0)
    for item in text.split(","):
        name, _, share = (part.strip() for part in item.partition("="))
        if name not in SOURCES:
            raise InputError(f"sources: {name!r} is none; write NAME=SHARE, with names from {', '.join(SOURCES)}")
        try:
            shares[name] = float(share)
        except ValueError as error:
            raise InputError(f"sources: {name}={share}: the share must be a number from 0 to 1") from error
    return Mix(**shares, shard_rows=shard_rows)


@dataclass(frozen=True, slots=True, eq=False)
class Order:
    """The tasks of a shard, one after another."""

    source: IntArray
    """(T,) values of `Source`."""
    rows: IntArray
    """(T,) how many rows each gives."""

    @staticmethod
    def of(mix: Mix) -> Order:
        """The tasks of a whole shard."""
        counts = {source: mix.tasks_in_a_shard(source) for source in SOURCES.values()}
        dues = [np.arange(1, count + 1) / count for count in counts.values() if count]
        source = np.repeat(np.array(list(counts), np.int64), list(counts.values()))
        rows = np.repeat([mix.rows_of_a_task(s) for s in counts], list(counts.values()))
        order = np.argsort(np.concatenate(dues), kind="stable")
        return Order(source[order], rows[order])

    def until(self, rows: int) -> Order:
        """The first tasks, so many that they have at least `rows` rows."""
        tasks = int(np.searchsorted(np.cumsum(self.rows), rows)) + 1
        return Order(self.source[:tasks], self.rows[:tasks])

    @property
    def first(self) -> IntArray:
        """(T,) the row that each begins with."""
        return np.asarray(np.cumsum(self.rows) - self.rows)

    def tasks_of(self, source: Source) -> IntArray:
        """Which of the tasks belong to a source."""
        return np.flatnonzero(self.source == source)


def shard_rows(count: int, whole: int) -> list[int]:
    """How many rows each shard has: whole ones, and the last as short as it must be."""
    return [min(whole, count - first) for first in range(0, count, whole)]


def _told(mix: Mix) -> str:
    return ", ".join(f"{f.name}={getattr(mix, f.name):g}" for f in fields(mix) if f.name in SOURCES)
