"""The rate keeper: ticks on absolute deadlines. A deadline that has passed is counted and skipped, never made up."""

from __future__ import annotations

from dataclasses import dataclass

from lcd_flight.model import Clock
from lcd_flight.safety.evidence import PERIOD_NS


@dataclass(frozen=True, slots=True)
class Wake:
    """One wake-up."""

    deadline_ns: int
    now_ns: int
    missed: int
    """Deadlines that passed unused since the wake-up before."""


class RateKeeper:
    """Wakes its caller at the start of each period."""

    def __init__(self, clock: Clock, period_ns: int = PERIOD_NS) -> None:
        self._clock = clock
        self._period_ns = period_ns
        self._deadline_ns = clock.now_ns()

    async def next(self) -> Wake:
        """Wait for the next deadline that is not a whole period away in the past."""
        self._deadline_ns += self._period_ns
        await self._clock.sleep_until(self._deadline_ns)
        now_ns = self._clock.now_ns()
        missed = max(0, (now_ns - self._deadline_ns) // self._period_ns)
        self._deadline_ns += missed * self._period_ns
        return Wake(self._deadline_ns, now_ns, missed)
