"""The learned tracking cost: how far a vehicle will stray from a plan, and the gradient of that.

    features of each segment -> normalised -> window (previous, this, next segment, 2 flags) -> members of an ensemble
    -> log of each segment's largest error -> logsumexp over segments -> mean + 1 standard deviation over members

Other inputs than windows (`inputs`) see the whole trajectory in one row, which stands where a segment does here.

The logsumexp (sharpness 3) is the smooth maximum that makes a segment's error the plan's; the standard deviation is
the pessimism that keeps a planner from where the members disagree, which is where there were no data.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lcd_flight.model import BoolArray, FloatArray, InputError
from lcd_flight.planning.cost.inputs import INPUTS, Inputs
from lcd_flight.planning.cost.network import Array, Network, Tape

if TYPE_CHECKING:
    from lcd_flight.planning.cost.model_card import ModelCard

SHARPNESS = 3.0
"""beta of the smooth maximum over segments, (1 / beta) log sum exp(beta y)."""
PESSIMISM = 1.0
"""Standard deviations over members that count on top of their mean."""

_BATCH_WINDOWS = 512
"""Windows that go through the networks at once: enough for fast products, few enough to stay in cache."""
_STD_FLOOR_SQUARED = 1e-12
"""Below the root of the variance over members, so that its gradient exists where they agree."""

RANGE_TOLERANCE = 0.15
"""How far beyond the training range a feature may be, as a share of its span. A long mission has thousands of features,
each a little outside now and then, which networks that are nearly linear there survive; what the range is for is plans
of another kind."""

_LEAST_MARGIN = 1e-6
"""So that a feature that never varied has a range, too."""


@dataclass(frozen=True, slots=True, eq=False)
class CostModel:
    """A trained tracking cost; what it was trained for stands on its card.

    What it predicts is y = log of the largest error in m; that error holds a share of the yaw error
    (`lcd_flight.learning.targets`).
    """

    network: Network
    """One output y for each row of its inputs; as many members as were trained."""
    feature_mean: FloatArray
    """(F,) taken from the features before the networks see them."""
    feature_spread: FloatArray
    """(F,) that they are divided by then."""
    feature_low: FloatArray
    """(F,) lower end of what the networks were trained on."""
    feature_high: FloatArray
    """(F,) upper end."""
    inputs: Inputs = INPUTS["windows"]
    """What the networks see of a plan."""
    card: ModelCard | None = None
    """None for a model that was not saved yet."""

    def value_and_gradient(
        self, durations_s: FloatArray, coefficients: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The pessimistic log error of N plans and its gradients.

        Args:
            durations_s: (N, S) s, all > 0.
            coefficients: (N, 4, S, 8), laid out as in `Trajectories`.

        Returns:
            The costs (N,), their gradients by the durations (N, S) with the coefficients held, and by the
            coefficients (N, 4, S, 8). Not finite where the plan is not.
        """
        value, grad_durations, grad_coefficients, _ = self.judged(durations_s, coefficients)
        return value, grad_durations, grad_coefficients

    def judged(
        self, durations_s: FloatArray, coefficients: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
        """`value_and_gradient` and `in_range`, from the same features."""
        features = self._features(durations_s, coefficients)
        value, grad_features = np.empty(len(features)), np.empty(features.shape)
        for rows in self._row_blocks(len(features), features.shape[1]):
            value[rows], grad_features[rows] = self._of_features(features[rows])
        return value, *self.inputs.pullback(durations_s, coefficients, grad_features), self._inside(features)

    def predict(self, durations_s: FloatArray, coefficients: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What `value_and_gradient` gives as costs (N,), and the largest error in each segment in m (N, S).

        The errors are by the mean of the members' logarithms: no pessimism. (N, 1) that of the whole trajectory, where
        that is what the networks see.
        """
        features = self._features(durations_s, coefficients)
        value, mean = np.empty(len(features)), np.empty(features.shape[:2])
        for rows in self._row_blocks(len(features), features.shape[1]):
            log_errors, _ = self._log_errors(features[rows])
            value[rows], _ = _aggregate(log_errors)
            mean[rows] = log_errors.mean(axis=0)
        return value, np.asarray(np.exp(mean))

    def predict_segment_errors_m(self, durations_s: FloatArray, coefficients: FloatArray) -> FloatArray:
        """(N, S) the second of `predict`."""
        return self.predict(durations_s, coefficients)[1]

    def predict_max_error_m(self, durations_s: FloatArray, coefficients: FloatArray) -> FloatArray:
        """(N,) the largest error of each plan in m: that of its worst segment."""
        return np.asarray(self.predict_segment_errors_m(durations_s, coefficients).max(axis=1))

    def in_range(self, durations_s: FloatArray, coefficients: FloatArray) -> BoolArray:
        """(N,) whether all features of a plan are within what the networks were trained on."""
        return self._inside(self._features(durations_s, coefficients))

    def out_of_range(self, durations_s: FloatArray, coefficients: FloatArray) -> tuple[str | None, ...]:
        """For each plan None, or which feature is farthest out."""
        names = self.inputs.names(durations_s.shape[1])
        return tuple(self._farthest(features, names) for features in self._features(durations_s, coefficients))

    def _features(self, durations_s: FloatArray, coefficients: FloatArray) -> FloatArray:
        """(N, R, F).

        Raises:
            InputError: the networks see whole trajectories of another number of segments.
        """
        features = self.inputs.features(durations_s, coefficients)
        if features.shape[2] != len(self.feature_mean):
            name = "this model" if self.card is None else f"model {self.card.name}"
            raise InputError(f"{name}: sees whole trajectories, of another number of waypoints; use one of windows")
        return features

    def _farthest(self, features: FloatArray, names: tuple[str, ...]) -> str | None:
        """What of features (R, F) is farthest out, in units of the range; None where all is inside."""
        low, high, beyond = self.feature_low, self.feature_high, self._beyond(features)
        segment, column = np.unravel_index(beyond.argmax(), beyond.shape)
        if beyond[segment, column] <= 0.0:
            return None
        value, bounds = features[segment, column], f"{low[column]:.3g} to {high[column]:.3g}"
        place = f" of segment {segment + 1}" if len(features) > 1 else ""
        return f"{names[column]}{place} is {value:.3g}, trained on {bounds}"

    def _inside(self, features: FloatArray) -> BoolArray:
        """(N,) whether features (N, R, F) are all within what is tolerated; what is not a number is not."""
        slack = RANGE_TOLERANCE * (self.feature_high - self.feature_low)
        inside = (features >= self.feature_low - slack) & (features <= self.feature_high + slack)
        return np.asarray(inside.all(axis=(1, 2)))

    def _beyond(self, features: FloatArray) -> FloatArray:
        """How far features (..., F) are beyond what is tolerated, in spans of their range; above 0 is outside."""
        span = self.feature_high - self.feature_low
        beyond = np.maximum(self.feature_low - features, features - self.feature_high) / span - RANGE_TOLERANCE
        return np.nan_to_num(beyond, nan=np.inf)

    def _normalised(self, features: FloatArray) -> Array:
        with np.errstate(over="ignore", invalid="ignore"):  # judged by the caller, as values that are not finite
            scaled = (features - self.feature_mean) / self.feature_spread
            return np.asarray(scaled.astype(self.network.dtype))

    def _log_errors(self, features: FloatArray) -> tuple[FloatArray, Tape]:
        """What the members say of features (N, R, F), (M, N, R), and what the way back needs."""
        inputs = self.inputs.arrange(self._normalised(features))
        with np.errstate(over="ignore", invalid="ignore"):
            outputs, tape = self.network.forward(inputs.reshape(-1, inputs.shape[2]))
        return outputs.astype(np.float64).reshape(-1, *inputs.shape[:2]), tape

    def _of_features(self, features: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The costs (N,) of features (N, R, F), and their gradient by these."""
        log_errors, tape = self._log_errors(features)
        with np.errstate(over="ignore", invalid="ignore"):
            value, grad_log_errors = _aggregate(log_errors)
            grad_inputs = self.network.backward(tape, grad_log_errors.reshape(len(log_errors), -1))
            grad_arranged = grad_inputs.reshape(*features.shape[:2], -1)
            return value, self.inputs.arrange_pullback(grad_arranged) / self.feature_spread

    @staticmethod
    def _row_blocks(tasks: int, rows: int) -> list[slice]:
        step = max(1, _BATCH_WINDOWS // rows)
        return [slice(first, first + step) for first in range(0, tasks, step)]


def _aggregate(log_errors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """From y of members, plans and segments (M, N, S) to the cost (N,), and its gradient by y."""
    largest = log_errors.max(axis=2, keepdims=True)
    powers = np.exp(SHARPNESS * (log_errors - largest))
    sums = powers.sum(axis=2, keepdims=True)
    of_member = (largest + np.log(sums) / SHARPNESS)[..., 0]
    mean = of_member.mean(axis=0)
    deviation = of_member - mean
    std = np.sqrt((deviation**2).mean(axis=0) + _STD_FLOOR_SQUARED)
    grad_of_member = (1.0 + PESSIMISM * deviation / std) / len(log_errors)
    return mean + PESSIMISM * std, grad_of_member[..., None] * (powers / sums)


def training_range(features: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What counts as trained on, from features (..., F): the 0.01 and 99.99 % quantiles.

    So far out because the tails are where the hard tasks are: near free fall the thrust direction turns at any rate.
    """
    rows = features.reshape(-1, features.shape[-1])
    low, high = np.quantile(rows, [0.0001, 0.9999], axis=0)
    return low - _LEAST_MARGIN, high + _LEAST_MARGIN
