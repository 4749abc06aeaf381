"""What networks learn from, in memory: features and targets of all rollouts.

0.7 GB for each million rollouts of three segments, seen as windows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lcd_flight.learning.rebuild import in_slices, trajectories
from lcd_flight.learning.rollouts import Rollouts
from lcd_flight.learning.targets import TargetName, targets, whole_targets
from lcd_flight.model import BoolArray, FloatArray, IntArray, Trajectories, World
from lcd_flight.model.streams import Stream
from lcd_flight.planning.cost.inputs import Inputs

TRAINING_SHARE = 0.8
"""Of the tasks; the others validate. By task, never by rollout: the rollouts of one task resemble each other."""
_LEAST_SPREAD = 1e-3
_FLOAT16 = (-6e4, 6e4)
"""What half precision holds; raw coefficients of strange plans go beyond."""


@dataclass(frozen=True, slots=True, eq=False)
class Normalisation:
    """Each feature's mean and standard deviation, (F,)."""

    mean: FloatArray
    spread: FloatArray

    @staticmethod
    def of(raw: FloatArray) -> Normalisation:
        """From features (N, R, F); a feature that never changes is left at its own scale."""
        rows = raw.reshape(-1, raw.shape[-1])
        spread = rows.std(axis=0)
        return Normalisation(rows.mean(axis=0), np.where(spread > _LEAST_SPREAD, spread, 1.0))


class TrainingSet:
    """Grows round by round up to a capacity; features are kept normalised in float16."""

    def __init__(
        self, capacity: int, first: FloatArray, inputs: Inputs, target: TargetName, normalisation: Normalisation
    ) -> None:
        """For so many rollouts. first: (N, R, F) some features, whose shape all others have."""
        self.inputs, self.target, self.normalisation = inputs, target, normalisation
        self._size = 0
        rows, columns = first.shape[1:]
        self._features: NDArray[np.float16] = np.empty((capacity, rows, columns), np.float16)
        self._wanted: NDArray[np.float32] = np.empty((capacity, rows), np.float32)
        self._kept: BoolArray = np.empty((capacity, rows), bool)
        self._rollout: NDArray[np.float32] = np.empty(capacity, np.float32)
        self._source: NDArray[np.int8] = np.empty(capacity, np.int8)
        self._trains: BoolArray = np.empty(capacity, bool)

    def __len__(self) -> int:
        """How many rollouts it holds."""
        return self._size

    def add(self, world: World, seed: int, rollouts: Rollouts) -> None:
        """Take in the rows of a shard."""
        rows = slice(self._size, self._size + len(rollouts))
        raw = features(trajectories(world, seed, rollouts.plans), self.inputs)
        of_segments = self.inputs.name == "windows"
        wanted = targets(rollouts.labels) if of_segments else whole_targets(rollouts.labels, self.target)
        self._features[rows] = np.clip((raw - self.normalisation.mean) / self.normalisation.spread, *_FLOAT16)
        self._wanted[rows] = wanted.row
        self._kept[rows] = wanted.kept
        self._rollout[rows] = wanted.rollout
        self._source[rows] = rollouts.plans.source
        self._trains[rows] = trains(seed, rollouts.plans.task)
        self._size = rows.stop

    @property
    def features(self) -> NDArray[np.float16]:
        """(N, R, F) normalised; R rows a rollout, as its inputs have them."""
        return self._features[: self._size]

    @property
    def wanted(self) -> NDArray[np.float32]:
        """(N, R) targets."""
        return self._wanted[: self._size]

    @property
    def kept(self) -> BoolArray:
        """(N, R) which of the rows' targets mean something."""
        return self._kept[: self._size]

    @property
    def rollout(self) -> NDArray[np.float32]:
        """(N,) targets of whole rollouts."""
        return self._rollout[: self._size]

    @property
    def source(self) -> NDArray[np.int8]:
        """(N,) where the plans came from (`rollouts.Source`)."""
        return self._source[: self._size]

    def rows(self, training: bool) -> IntArray:
        """The rows that train, or those that validate."""
        return np.flatnonzero(self._trains[: self._size] == training)


def features(plans: Trajectories, inputs: Inputs) -> FloatArray:
    """(N, R, F) what a network sees of plans, before it is normalised; on all cores."""
    return np.concatenate(
        in_slices(lambda rows: inputs.features(plans.durations_s[rows], plans.coefficients[rows]), len(plans))
    )


def trains(seed: int, task: IntArray) -> BoolArray:
    """(N,) whether a task's rollouts are for training; the same in every world and round."""
    return np.asarray(Stream(seed, "training/split").uniforms(task, 1)[:, 0] < TRAINING_SHARE)
