"""Rows of a data set: what was flown, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from lcd_flight.model import BoolArray, IntArray, RolloutLabels, SeedArray

Float32Array = NDArray[np.float32]


class Source(IntEnum):
    """Where a plan came from."""

    OPTIMUM = 0
    """Minimum snap."""
    RANDOM = 1
    """Minimum snap, perturbed in the whitened free variables."""
    SEARCH = 2
    """A sample of a search in the simulator."""
    GIVEN = 3
    """A given plan (in the training's rounds that of the model so far), or a jitter around one."""
    TIMES = 4
    """Minimum snap for times that are not the paper's."""


@dataclass(frozen=True, slots=True, eq=False)
class Plans:
    """N plans in the whitened free variables of their tasks (`planning.knots`).

    z and theta are kept in float32 and are flown as such, so that stored rows can be rebuilt and flown again.
    """

    task: IntArray
    """(N,) global index of the task."""
    short_yaw: BoolArray
    """(N,) whether the task turns by the short way rather than as sampled."""
    source: IntArray
    """(N,) values of `Source`."""
    z: Float32Array
    """(N, D) free knot variables; 0 is minimum snap."""
    theta: Float32Array
    """(N, S) log-time variables; 0 is the paper's time allocation."""

    def __len__(self) -> int:
        """How many rows there are."""
        return len(self.task)

    def take(self, rows: slice | IntArray) -> Plans:
        """The chosen rows."""
        return Plans(*(getattr(self, f.name)[rows] for f in fields(Plans)))

    @staticmethod
    def concatenate(parts: list[Plans]) -> Plans:
        """One after another."""
        return Plans(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Plans)))


@dataclass(frozen=True, slots=True, eq=False)
class Rollouts:
    """N plans and what the simulator said about them."""

    plans: Plans
    drag: IntArray
    """(N,) drag configuration, counted from 1."""
    noise_seed: SeedArray
    """(N,)"""
    labels: RolloutLabels

    def __len__(self) -> int:
        """How many rows there are."""
        return len(self.plans)

    def take(self, rows: slice | IntArray) -> Rollouts:
        """The chosen rows."""
        return Rollouts(self.plans.take(rows), self.drag[rows], self.noise_seed[rows], self.labels.take(rows))

    @staticmethod
    def concatenate(parts: list[Rollouts]) -> Rollouts:
        """One after another."""
        return Rollouts(
            Plans.concatenate([p.plans for p in parts]),
            np.concatenate([p.drag for p in parts]),
            np.concatenate([p.noise_seed for p in parts]),
            RolloutLabels.concatenate([p.labels for p in parts]),
        )
