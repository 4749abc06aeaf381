"""Planning methods by name, behind one interface: every table holds each of them in the same way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from lcd_flight.model import BoolArray, FloatArray, InputError, IntArray, Simulator, Tasks, Trajectories, Vehicle, World
from lcd_flight.planning.minimum_snap import minimum_snap_batch

Timing: TypeAlias = Literal["fixed", "retimed"]
"""`fixed`: the paper's time allocation. `retimed`: moved between segments at equal total time."""


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """What a method may know."""

    world: World
    vehicle: Vehicle
    """With the drag that is planned for."""
    tasks: Tasks
    indices: IntArray
    """(N,) their numbers among all tasks of the evaluation, so that a plan does not depend on the grouping."""
    timing: Timing
    simulator: Simulator
    """For methods that search in it; `learned` and `analytic` do not."""
    seed: int
    """Of a method's own random choices; nothing in common with the noise that its plans are judged by."""
    model: str
    """Name or path of the learned cost."""

    def take(self, rows: IntArray) -> Problem:
        """The same for some of the tasks (rows of `tasks`)."""
        return replace(self, tasks=self.tasks.take(rows), indices=self.indices[rows])

    @property
    def durations_s(self) -> FloatArray:
        """(N, S) the paper's time allocation."""
        return self.tasks.durations_s(self.world.speed)


@dataclass(frozen=True, slots=True, eq=False)
class Planned:
    """What a method came up with."""

    plans: Trajectories
    fell_back: BoolArray
    """(N,) where the method failed and gave minimum snap instead."""


Method: TypeAlias = Callable[[Problem], Planned]


def minimum_snap(problem: Problem) -> Planned:
    """The paper's MS-GC: minimum snap at the paper's time allocation, whatever the timing."""
    plans = minimum_snap_batch(problem.tasks.poses, problem.durations_s)
    return Planned(plans, np.zeros(len(plans), bool))


METHODS: dict[str, Method] = {"minimum-snap": minimum_snap}


def find_method(name: str) -> Method:
    """One of the methods.

    Raises:
        InputError: there is none of that name.
    """
    if name not in METHODS:
        raise InputError(f"no method `{name}`; there are {', '.join(METHODS)}")
    return METHODS[name]


def shipped_model(world: World) -> str:
    """The name of the model that ships for a world's vehicle and loop."""
    return f"{world.base_vehicle.name}-{world.loop}"
