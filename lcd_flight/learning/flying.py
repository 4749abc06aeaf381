"""Fly rows: each with the drag configuration of its task."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lcd_flight.learning.collect_config import CollectConfig
from lcd_flight.learning.rebuild import trajectories
from lcd_flight.learning.rollouts import Plans, Rollouts
from lcd_flight.learning.spread import still_wanted
from lcd_flight.model import (
    IntArray,
    RolloutLabels,
    RolloutOptions,
    SeedArray,
    Simulator,
    Trajectories,
    Vector3,
    Vehicle,
    World,
)
from lcd_flight.model.streams import Stream


@dataclass(frozen=True, slots=True, eq=False)
class DragByRow:
    """A simulator that flies each row with a drag of its own in place of the vehicle's."""

    simulator: Simulator
    configurations: tuple[Vector3, ...]
    drag: IntArray
    """(N,) configuration of each row, counted from 1."""

    def rollout(
        self, plans: Trajectories, vehicle: Vehicle, seeds: SeedArray, options: RolloutOptions
    ) -> RolloutLabels:
        """As `model.Simulator`; no gaps in the pose."""
        still_wanted()
        groups = [np.flatnonzero(self.drag == drag) for drag in range(1, len(self.configurations) + 1)]
        labels = [
            self.simulator.rollout(plans.take(rows), replace(vehicle, parasitic_drag=c), seeds[rows], options)
            for c, rows in zip(self.configurations, groups, strict=True)
            if len(rows)
        ]
        return RolloutLabels.concatenate(labels).take(np.argsort(np.concatenate(groups)))


def options_of(world: World, threads: int = 0) -> RolloutOptions:
    """How a world's rollouts are flown, on so many threads (0: all cores)."""
    return RolloutOptions(loop=world.loop, start_aligned=world.start_aligned, threads=threads)


def fly(config: CollectConfig, plans: Plans, rows: IntArray, simulator: Simulator, threads: int = 0) -> Rollouts:
    """Fly each plan once, with the drag of its task and noise of its own.

    rows: (N,) global numbers of the rows, which their noise is keyed by.
    """
    world, drag = config.world, config.drag(plans.task)
    seeds = Stream(config.seed, "training/noise").seeds(rows)
    flown = trajectories(world, config.seed, plans)
    arena = DragByRow(simulator, world.drag_configurations, drag)
    labels = arena.rollout(flown, world.base_vehicle, seeds, options_of(world, threads))
    return Rollouts(plans, drag, seeds, labels)
