"""What a network is to predict: the logarithm of a segment's largest error, or of the trajectory's.

    y = 1/2 log clip(max |e_p|^2 + 0.1 mean 2 (1 - cos e_yaw), 1e-4, 25)

so that exp(y) is an error in m between 1 cm and 5 m. What comes after an error above 2 m says nothing about the
segment that is flown then, so it is left out.

`released` is the logarithm of the released code's label instead, for the whole trajectory.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from lcd_flight.model import BoolArray, FloatArray, RolloutLabels

YAW_WEIGHT_M2 = 0.1
CLIP_M2 = (1e-4, 25.0)
LOST_ERROR_M = 2.0
TargetName: TypeAlias = Literal["error", "released"]
_LEAST_COST = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """Of N rollouts, in R rows each: one for a segment, or one for the whole."""

    row: FloatArray
    """(N, R); meaningless where not kept."""
    kept: BoolArray
    """(N, R) reached, and not lost in an earlier segment."""
    rollout: FloatArray
    """(N,) the same of the whole rollout."""


def targets(labels: RolloutLabels) -> Targets:
    """What labels mean for a network that sees segments."""
    error = labels.segment_max_error_m
    reached = ~np.isnan(error)
    worst_before = np.maximum.accumulate(np.where(reached, error, np.inf), axis=1)[:, :-1]
    kept = reached.copy()
    kept[:, 1:] &= worst_before <= LOST_ERROR_M
    segment = log_error(np.where(reached, error, 0.0), labels.yaw_cost[:, None])
    return Targets(segment, kept, log_error(labels.max_error_m, labels.yaw_cost))


def whole_targets(labels: RolloutLabels, target: TargetName) -> Targets:
    """What labels mean for a network that sees the whole trajectory."""
    if target == "released":
        rollout = np.asarray(np.log(np.maximum(labels.released_cost, _LEAST_COST)))
    else:
        rollout = log_error(labels.max_error_m, labels.yaw_cost)
    return Targets(rollout[:, None], np.ones((len(rollout), 1), bool), rollout)


def log_error(error_m: FloatArray, yaw_cost: FloatArray) -> FloatArray:
    """The target of a largest position error in m and a mean of 2 (1 - cos e_yaw)."""
    return np.asarray(0.5 * np.log(np.clip(error_m**2 + YAW_WEIGHT_M2 * yaw_cost, *CLIP_M2)))
