"""Feeding a flight's logged inputs through the tick again: the same setpoints, to the bit, or where they differ."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from lcd_flight.flight.memory import Memory
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.flight.tick import tick
from lcd_flight.model import AttitudeThrust, Tick, TickInputs
from lcd_flight.model.frames import angle_between


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


def replayed(inputs: Iterable[TickInputs], setup: FlightSetup) -> Iterator[Tick]:
    """What the tick decides on these inputs, from the first tick of a flight on.

    setup: the flight's own, or another one to see what it would have commanded.
    """
    memory = Memory()
    for given in inputs:
        decided, memory = tick(given, setup, memory)
        yield decided


def differences(flight: Iterable[tuple[TickInputs, Tick]], setup: FlightSetup) -> list[Difference]:
    """Every logged tick that comes out otherwise; none on the machine and version that flew it."""
    pairs = list(flight)
    again = replayed((inputs for inputs, _ in pairs), setup)
    return [Difference(logged, now) for (_, logged), now in zip(pairs, again, strict=True) if logged != now]


def _pair(a: AttitudeThrust | None, b: AttitudeThrust | None) -> tuple[AttitudeThrust, AttitudeThrust] | None:
    if a is None and b is None:
        return AttitudeThrust(0.0, (0.0, 0.0, 0.0, 1.0)), AttitudeThrust(0.0, (0.0, 0.0, 0.0, 1.0))
    return None if a is None or b is None else (a, b)
