"""What a data set is a function of, besides its length. All of it goes into the hash that its shards carry."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from lcd_flight.learning.mix import Mix
from lcd_flight.learning.sources import SHORT_YAW_SHARE, turns_short
from lcd_flight.model import BoolArray, InputError, IntArray, World


@dataclass(frozen=True, slots=True)
class CollectConfig:
    """A world, a seed, and what is flown in it."""

    world: World
    seed: int
    drags: tuple[int, ...] = (1, 2, 3, 4, 5)
    """Drag configurations, dealt out to the tasks in turn."""
    mix: Mix = field(default_factory=Mix)
    short_yaw_share: float = SHORT_YAW_SHARE
    """Of the tasks: those that turn by the short way; the others turn as sampled."""
    plans_sha256: str = ""
    """Of the given plans, where the mix has any."""

    def __post_init__(self) -> None:
        """Check what does not depend on files.

        Raises:
            InputError: a share of short turns that is none, drag configurations that the world does not have, or two
                waypoints, between which there is one trajectory only.
        """
        if self.segments < 2:
            raise InputError("data need tasks of at least 3 waypoints: between two there is nothing to choose")
        if not 0.0 <= self.short_yaw_share <= 1.0:
            raise InputError(f"short yaw: {self.short_yaw_share:g} of the tasks is no share; give 0 to 1")
        most = len(self.world.drag_configurations)
        if not self.drags or not all(1 <= drag <= most for drag in self.drags):
            raise InputError(f"drags {list(self.drags)}: world {self.world.name} has configurations 1 to {most}")

    @property
    def segments(self) -> int:
        """Of each task."""
        return self.world.sampler.waypoints - 1

    def drag(self, task: IntArray) -> IntArray:
        """(N,) the drag configuration of each task."""
        return np.asarray(self.drags)[task % len(self.drags)]

    def short_yaw(self, task: IntArray) -> BoolArray:
        """(N,) whether each task turns by the short way."""
        return turns_short(self.seed, task, self.short_yaw_share)
