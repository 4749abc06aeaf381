"""A flight cut into stretches of one phase on one leg."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcd_flight.model import FlightPlan, LegKind, Phase
from lcd_flight.model.types import BoolArray
from lcd_flight.record import FlightLog, Series

AIRBORNE = [phase.value for phase in Phase if phase.airborne]


@dataclass(frozen=True, slots=True)
class Span:
    """Ticks `first` to `last`, both included, of one phase on one leg."""

    phase: Phase
    leg: int
    first: int
    last: int
    begin_s: float
    end_s: float
    """When the next span begins; the last tick's time for the last span."""

    @property
    def ticks(self) -> slice:
        """To cut a column with."""
        return slice(self.first, self.last + 1)


def spans(series: Series) -> tuple[Span, ...]:
    """All of them, in order."""
    changes = np.flatnonzero((series.phase[1:] != series.phase[:-1]) | (series.leg[1:] != series.leg[:-1])) + 1
    firsts = [0, *changes.tolist()]
    nexts = [*changes.tolist(), len(series)]
    return tuple(
        Span(
            phase=Phase(str(series.phase[first])),
            leg=int(series.leg[first]),
            first=first,
            last=after - 1,
            begin_s=float(series.time_s[first]),
            end_s=float(series.time_s[min(after, len(series) - 1)]),
        )
        for first, after in zip(firsts, nexts, strict=True)
    )


def span_name(span: Span, plan: FlightPlan) -> str:
    """For people: the phase, and on a track what it leads to."""
    if span.phase is Phase.TRACK and 0 <= span.leg < len(plan.legs):
        return plan.legs[span.leg].kind.value
    return span.phase.value.replace("_", " ")


def airborne(series: Series) -> BoolArray:
    """(T,) ticks in which motors carried the vehicle."""
    return np.asarray(np.isin(series.phase, AIRBORNE))


def tracking(log: FlightLog) -> BoolArray:
    """(T,) ticks on the trajectories that the mission asks for, without the ways to and from them."""
    wanted = [n for n, leg in enumerate(log.header.plan.legs) if leg.kind is LegKind.TRAJECTORY]
    return np.asarray(np.isin(log.series.leg, wanted) & (log.series.phase == Phase.TRACK.value))
