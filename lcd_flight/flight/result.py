"""What a flight came to: how the loop kept time, and how it ended."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field

from lcd_flight.model import Finding, Outcome, Phase, Tick, TickInputs
from lcd_flight.safety.preflight import Check


@dataclass(slots=True)
class LoopFigures:
    """How the loop kept time; counts while it runs."""

    ticks: int = 0
    missed: int = 0
    """Deadlines that were skipped."""
    stale: int = 0
    """Setpoints withheld because they were over 50 ms old when they were to be sent."""
    lateness_ns: array[int] = field(default_factory=lambda: array("q"))
    """Of each tick against its deadline."""
    busy_ns: array[int] = field(default_factory=lambda: array("q"))
    """From waking to having sent."""

    def note(self, inputs: TickInputs, sent_ns: int) -> None:
        """Count one tick, whose setpoint was handed over at `sent_ns`."""
        self.ticks += 1
        self.missed += inputs.missed
        self.lateness_ns.append(inputs.now_ns - inputs.deadline_ns)
        self.busy_ns.append(sent_ns - inputs.now_ns)

    def lateness_ms(self, share: float) -> float:
        """The quantile of the lateness; 0 where nothing ran."""
        return _quantile(self.lateness_ns, share) * 1e-6

    def busy_ms(self, share: float) -> float:
        """The quantile of the time that a tick took; 0 where nothing ran."""
        return _quantile(self.busy_ns, share) * 1e-6


def _quantile(values: array[int], share: float) -> int:
    ranked = sorted(values)
    return ranked[min(int(share * len(ranked)), len(ranked) - 1)] if ranked else 0


@dataclass(frozen=True, slots=True)
class FlightResult:
    """How a flight ended."""

    outcome: Outcome
    reason: str
    """One line; empty where the mission was completed."""
    phase: Phase
    """The last one."""
    checks: tuple[Check, ...]
    """Of the pre-flight; empty where it came to none."""
    figures: LoopFigures
    notes: tuple[str, ...]
    """What went wrong beside the flight, e.g. a priority that was not to be had."""

    @property
    def exit_code(self) -> int:
        """Of the process."""
        return self.outcome.exit_code


class Story:
    """An observer that remembers how the flight came to its end."""

    def __init__(self) -> None:
        self.phase = Phase.IDLE
        self.flown = False
        """Whether it ever took off."""
        self.landed_from: Phase | None = None
        self.turn: Finding | None = None
        """What made it leave the plan."""

    def observe(self, _inputs: TickInputs, tick: Tick) -> None:
        """Take note of one tick."""
        before, self.phase = self.phase, tick.phase
        if tick.phase is before:
            return
        self.flown = self.flown or tick.phase.airborne
        if tick.phase is Phase.LANDED:
            self.landed_from = before
        if tick.phase in _ABNORMAL or (tick.phase is Phase.IDLE and before is not Phase.IDLE):
            gravest = max(tick.findings, key=lambda f: f.severity, default=None)
            if gravest is not None and (self.turn is None or gravest.severity > self.turn.severity):
                self.turn = gravest
        elif tick.phase in _ON_PLAN:
            self.turn = None

    def close(self) -> None:
        """Nothing is held."""

    @property
    def outcome(self) -> Outcome:
        """How it ended; motors that are stopped after a landing do not undo it."""
        if not self.flown:
            return Outcome.REFUSED
        if self.phase is Phase.CRASHED:
            return Outcome.CRASHED
        if self.phase is Phase.HANDED_OVER:
            return Outcome.ABORTED
        if self.landed_from is None:
            return Outcome.CUT
        return Outcome.LANDED if self.landed_from is Phase.LAND else Outcome.ABORTED

    @property
    def reason(self) -> str:
        """Why it left the plan; empty where it did not."""
        return "" if self.turn is None else self.turn.message


_ABNORMAL = frozenset(
    {Phase.BRAKE_HOLD, Phase.LAND_NOW, Phase.DESCEND_BLIND, Phase.HANDED_OVER, Phase.KILL, Phase.CRASHED}
)
_ON_PLAN = frozenset({Phase.TAKEOFF, Phase.HOLD, Phase.TRACK, Phase.LAND})
