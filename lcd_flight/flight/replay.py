"""Feeding a flight's logged inputs through the tick again: the same setpoints, to the bit, or where they differ."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from lcd_flight.flight.memory import Memory
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.flight.tick import tick
from lcd_flight.model import AttitudeThrust, Tick, TickInputs
from lcd_flight.model.frames import angle_between

Pair = tuple[TickInputs, Tick]

THRUST_TOLERANCE_SHARE = 1e-9
"""Of the vehicle's greatest thrust: what setpoints may differ by on another machine, whose sine and cosine may round
the last bit otherwise. The loop has no state that would let such a difference grow without bound but the integral."""
ANGLE_TOLERANCE_RAD = 1e-7
"""Likewise. An angle between unit quaternions of doubles cannot be told better than 4e-8."""


@dataclass(frozen=True, slots=True)
class Difference:
    """A tick that came out otherwise than it was logged."""

    logged: Tick
    replayed: Tick

    @property
    def thrust_N(self) -> float:
        """Between the setpoints; infinite where only one of the two sent anything."""
        pair = _pair(self.logged.setpoint, self.replayed.setpoint)
        return math.inf if pair is None else abs(pair[0].thrust_N - pair[1].thrust_N)

    @property
    def angle_rad(self) -> float:
        """Between the attitudes asked for; pi where only one of the two sent anything."""
        pair = _pair(self.logged.setpoint, self.replayed.setpoint)
        return math.pi if pair is None else angle_between(pair[0].q_WB, pair[1].q_WB)


@dataclass(frozen=True, slots=True)
class Comparison:
    """A flight beside its replay."""

    pairs: tuple[Difference, ...]
    """Every tick that was compared, equal or not."""
    different: tuple[Difference, ...]
    """Those in which anything differs: a setpoint, a phase, a finding."""
    missing_after: int | None
    """The tick after which the log misses some, so that the comparison ended there; None where it has all."""

    @property
    def equal(self) -> bool:
        """Whether every tick is the same, to the bit."""
        return not self.different

    @property
    def thrust_N(self) -> float:
        """The largest difference between setpoints."""
        return max((d.thrust_N for d in self.different), default=0.0)

    @property
    def angle_rad(self) -> float:
        """The largest difference between setpoints."""
        return max((d.angle_rad for d in self.different), default=0.0)

    def agrees(self, greatest_thrust_N: float) -> bool:
        """Whether it is the same flight but for what another machine may round otherwise."""
        same_phases = all(d.logged.phase is d.replayed.phase for d in self.different)
        close = self.thrust_N <= THRUST_TOLERANCE_SHARE * greatest_thrust_N and self.angle_rad <= ANGLE_TOLERANCE_RAD
        return same_phases and close


def replayed(inputs: Iterable[TickInputs], setup: FlightSetup) -> Iterator[Tick]:
    """What the tick decides on these inputs, from the first tick of a flight on.

    setup: the flight's own, or another one to see what it would have commanded.
    """
    memory = Memory()
    for given in inputs:
        decided, memory = tick(given, setup, memory)
        yield decided


def compare(
    flight: Sequence[Pair], setup: FlightSetup, advance: Callable[[int], object] = lambda _: None
) -> Comparison:
    """The flight beside its replay, from its first tick to the first that the log misses.

    advance: told with every tick.

    What a tick remembers comes from all ticks before it: after a gap there is nothing to compare with.
    """
    unbroken = _unbroken(flight)
    pairs = []
    for (_, logged), now in zip(unbroken, replayed((inputs for inputs, _ in unbroken), setup), strict=True):
        pairs.append(Difference(logged, now))
        advance(1)
    different = tuple(pair for pair in pairs if pair.logged != pair.replayed)
    return Comparison(tuple(pairs), different, None if len(unbroken) == len(flight) else len(unbroken) - 1)


def _unbroken(flight: Sequence[Pair]) -> Sequence[Pair]:
    """The ticks before the first that is missing."""
    gap = next((number for number, (inputs, _) in enumerate(flight) if inputs.sequence != number), len(flight))
    return flight[:gap]


def differences(flight: Iterable[Pair], setup: FlightSetup) -> list[Difference]:
    """Every logged tick that comes out otherwise; none on the machine and version that flew it."""
    return list(compare(list(flight), setup).different)


def _pair(a: AttitudeThrust | None, b: AttitudeThrust | None) -> tuple[AttitudeThrust, AttitudeThrust] | None:
    if a is None and b is None:
        return AttitudeThrust(0.0, (0.0, 0.0, 0.0, 1.0)), AttitudeThrust(0.0, (0.0, 0.0, 0.0, 1.0))
    return None if a is None or b is None else (a, b)
