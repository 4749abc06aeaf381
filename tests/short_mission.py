"""A mission of seven seconds in the simulator, and flying it in virtual time with a listener on board."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache

import yaml

from lcd_flight.flight.operator import Operator
from lcd_flight.flight.progress import Progress
from lcd_flight.flight.result import FlightResult
from lcd_flight.flight.session import FlightOptions, run_flight
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.mission import Mission
from lcd_flight.mission.airframe import vehicle_of
from lcd_flight.mission.plan_mission import plan_mission
from lcd_flight.model import FlightPlan, Observer, Phase, Tick, TickInputs, Vehicle

TEXT = """
version: 1
name: short
vehicle: {type: crazyflie, uri: sim://}
planner: {type: minimum-snap, speed: 1.2}
plan:
  - takeoff: {height: 0.8, duration: 1.5}
  - trajectory:
      waypoints:
        - {position: [0.0, 0.0, 0.8], yaw_deg: 0}
        - {position: [1.2, 0.4, 1.0]}
        - {position: [0.4, 1.2, 0.8], yaw_deg: 60}
  - land: {duration: 2.0}
safety: {geofence: {min: [-3.0, -3.0, 0.0], max: [4.0, 4.0, 3.0]}}
"""


def mission(**changes: object) -> Mission:
    """The mission; `changes` are whole sections in place of its own."""
    return Mission.model_validate({**yaml.safe_load(TEXT), **changes})


@cache
def vehicle() -> Vehicle:
    """What it flies."""
    return vehicle_of(mission())


@cache
def plan() -> FlightPlan:
    """Its plan."""
    return plan_mission(mission(), vehicle()).plan


def setup() -> FlightSetup:
    """What the session makes of it."""
    return FlightSetup.of(plan(), vehicle(), mission().safety_limits())


@dataclass
class Listener:
    """Keeps every tick; `act` may do something at each."""

    act: Callable[[TickInputs, Tick], None] = lambda _inputs, _tick: None
    flight: list[tuple[TickInputs, Tick]] = field(default_factory=list)
    closed: int = 0

    def observe(self, inputs: TickInputs, tick: Tick) -> None:
        self.flight.append((inputs, tick))
        self.act(inputs, tick)

    def close(self) -> None:
        self.closed += 1

    @property
    def phases(self) -> list[Phase]:
        """In order, each once for as long as it lasts."""
        found: list[Phase] = []
        for _, decided in self.flight:
            if not found or found[-1] is not decided.phase:
                found.append(decided.phase)
        return found

    @property
    def codes(self) -> set[str]:
        """Of all findings."""
        return {finding.code for _, decided in self.flight for finding in decided.findings}

    def began_s(self, phase: Phase) -> float:
        """Seconds since take-off."""
        first = {decided.phase: inputs.now_ns for inputs, decided in reversed(self.flight)}
        return (first[phase] - first[Phase.TAKEOFF]) * 1e-9

    def height_m(self) -> float:
        """Of the vehicle when it was last seen."""
        return next(i.pose.state.p_WB[2] for i, _ in reversed(self.flight) if i.pose.state is not None)


def fly(
    uri: str = "sim://",
    *,
    seed: int = 0,
    listener: Listener | None = None,
    operator: Operator | None = None,
    progress: Progress | None = None,
    options: FlightOptions | None = None,
    flown: Mission | None = None,
    others: tuple[Observer, ...] = (),
) -> tuple[FlightResult, Listener]:
    """One flight in virtual time."""
    listener = listener or Listener()
    chosen = replace(options or FlightOptions(), uri=uri, fast=True, operator=operator or Operator())
    flown = flown or mission(seed=seed)
    observers = (listener, *others)
    result = run_flight(flown, plan(), vehicle(), chosen, observers=observers, progress=progress)
    return result, listener
