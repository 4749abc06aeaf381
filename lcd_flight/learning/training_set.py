"""Features and targets of all rollouts, in memory: 0.7 GB for each million rollouts of three segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lcd_flight.learning.rebuild import features, trajectories
from lcd_flight.learning.rollouts import Rollouts
from lcd_flight.learning.targets import targets
from lcd_flight.model import BoolArray, FloatArray, IntArray, World
from lcd_flight.model.streams import Stream

TRAINING_SHARE = 0.8
"""Of the tasks; the others validate. By task, never by rollout: the rollouts of one task resemble each other."""
_LEAST_SPREAD = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Normalisation:
    """Each feature's mean and standard deviation, (114,)."""

    mean: FloatArray
    spread: FloatArray

    @staticmethod
    def of(raw: FloatArray) -> Normalisation:
        """From features (N, S, 114); a feature that never changes is left at its own scale."""
        rows = raw.reshape(-1, raw.shape[-1])
        spread = rows.std(axis=0)
        return Normalisation(rows.mean(axis=0), np.where(spread > _LEAST_SPREAD, spread, 1.0))


class TrainingSet:
    """Grows round by round up to a capacity; features are kept normalised in float16."""

    def __init__(self, capacity: int, segments: int, normalisation: Normalisation) -> None:
        self.normalisation = normalisation
        self._size = 0
        columns = len(normalisation.mean)
        self._features: NDArray[np.float16] = np.empty((capacity, segments, columns), np.float16)
        self._segment: NDArray[np.float32] = np.empty((capacity, segments), np.float32)
        self._kept: BoolArray = np.empty((capacity, segments), bool)
        self._rollout: NDArray[np.float32] = np.empty(capacity, np.float32)
        self._trains: BoolArray = np.empty(capacity, bool)

    def __len__(self) -> int:
        """How many rollouts it holds."""
        return self._size

    def add(self, world: World, seed: int, rollouts: Rollouts) -> None:
        """Take in the rows of a shard."""
        rows = slice(self._size, self._size + len(rollouts))
        raw = features(trajectories(world, seed, rollouts.plans))
        wanted = targets(rollouts.labels)
        self._features[rows] = (raw - self.normalisation.mean) / self.normalisation.spread
        self._segment[rows] = wanted.segment
        self._kept[rows] = wanted.kept
        self._rollout[rows] = wanted.rollout
        self._trains[rows] = trains(seed, rollouts.plans.task)
        self._size = rows.stop

    @property
    def features(self) -> NDArray[np.float16]:
        """(N, S, 114) normalised."""
        return self._features[: self._size]

    @property
    def segment(self) -> NDArray[np.float32]:
        """(N, S) targets."""
        return self._segment[: self._size]

    @property
    def kept(self) -> BoolArray:
        """(N, S) which of the segments' targets mean something."""
        return self._kept[: self._size]

    @property
    def rollout(self) -> NDArray[np.float32]:
        """(N,) targets of whole rollouts."""
        return self._rollout[: self._size]

    def rows(self, training: bool) -> IntArray:
        """The rows that train, or those that validate."""
        return np.flatnonzero(self._trains[: self._size] == training)


def trains(seed: int, task: IntArray) -> BoolArray:
    """(N,) whether a task's rollouts are for training; the same in every world and round."""
    return np.asarray(Stream(seed, "training/split").uniforms(task, 1)[:, 0] < TRAINING_SHARE)
