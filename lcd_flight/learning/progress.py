"""How long work reports where it stands; the command line decides what to show."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True, slots=True)
class Progress:
    """Where long work stands."""

    done: int
    total: int
    unit: str
    """What is counted, e.g. `rollouts`."""
    rate: float
    """Units per second since this run began; 0 where nothing was done yet."""
    note: str = ""

    @property
    def seconds_left(self) -> float | None:
        """At the present rate; None while there is none."""
        return (self.total - self.done) / self.rate if self.rate > 0.0 else None


ProgressCallback: TypeAlias = Callable[[Progress], None]


def ignore(_: Progress) -> None:
    """For callers who do not want to know."""


class Meter:
    """Counts work and tells the callback; what an earlier run had done does not count into the rate."""

    def __init__(self, callback: ProgressCallback, total: int, unit: str, already_done: int = 0) -> None:
        self._callback = callback
        self._total = total
        self._unit = unit
        self._first = already_done
        self._done = already_done
        self._began_s = time.monotonic()

    def begin(self, already_done: int) -> None:
        """So much was found done; the rate counts from now."""
        self._first = self._done = already_done
        self._began_s = time.monotonic()

    def advance(self, count: int, note: str = "") -> None:
        """So much more is done."""
        self._done += count
        elapsed_s = time.monotonic() - self._began_s
        rate = (self._done - self._first) / elapsed_s if elapsed_s > 0.0 else 0.0
        self._callback(Progress(self._done, self._total, self._unit, rate, note))
