"""A tracking cost that keeps to limits: what breaking them costs is added to it."""

from __future__ import annotations

from dataclasses import dataclass

from lcd_flight.model import BoolArray, FloatArray
from lcd_flight.planning.cost.limit_cost import LimitCost
from lcd_flight.planning.planner import ErrorPredictor, TrackingCost


def limited(cost: TrackingCost, limits: LimitCost) -> TrackingCost:
    """`cost` with `limits`, for the solve: it predicts errors if `cost` does."""
    return _LimitedPredictor(cost, limits) if isinstance(cost, ErrorPredictor) else _Limited(cost, limits)


@dataclass(frozen=True, slots=True)
class _Limited:
    """A cost that only tells its value."""

    cost: TrackingCost
    limits: LimitCost

    def value_and_gradient(
        self, durations_s: FloatArray, coefficients: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The sum of both."""
        terms = (term.value_and_gradient(durations_s, coefficients) for term in (self.cost, self.limits))
        values, grad_durations, grad_coefficients = zip(*terms, strict=True)
        return sum(values), sum(grad_durations), sum(grad_coefficients)


@dataclass(frozen=True, slots=True)
class _LimitedPredictor:
    """A cost that predicts errors."""

    cost: ErrorPredictor
    limits: LimitCost

    def value_and_gradient(
        self, durations_s: FloatArray, coefficients: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The sum of both."""
        return _Limited(self.cost, self.limits).value_and_gradient(durations_s, coefficients)

    def judged(
        self, durations_s: FloatArray, coefficients: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
        """The sum of both, where the cost is good for."""
        value, grad_durations, grad_coefficients, trusted = self.cost.judged(durations_s, coefficients)
        more, by_durations, by_coefficients = self.limits.value_and_gradient(durations_s, coefficients)
        return value + more, grad_durations + by_durations, grad_coefficients + by_coefficients, trusted

    def predict(self, durations_s: FloatArray, coefficients: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As the cost predicts, and a metre for each unit that broken limits cost: a plan that keeps them is better."""
        value, errors_m = self.cost.predict(durations_s, coefficients)
        more, _, _ = self.limits.value_and_gradient(durations_s, coefficients)
        return value + more, errors_m + more[:, None]

    def out_of_range(self, durations_s: FloatArray, coefficients: FloatArray) -> tuple[str | None, ...]:
        """As the cost says."""
        return self.cost.out_of_range(durations_s, coefficients)
