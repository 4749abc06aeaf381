"""The attachments that planning leaves in a log: the legs as they are to be flown, and what the planner expected."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lcd_flight.model import FlightPlan, Leg, LegKind, Trajectory
from lcd_flight.model.types import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """What the planner expected of one trajectory, beside minimum snap through the same waypoints; SI units.

    An entry of `prediction.json`. Errors are those that the cost was trained on: the largest position error of a
    segment, with a share of the yaw error (`lcd_flight.learning.targets`), by the mean of the members' logarithms.
    """

    leg: int
    """Index into the plan's legs."""
    method: str
    """What is flown: `learned` or `minimum-snap`."""
    relative_snap: float = 1.0
    """Snap of the position over the least possible."""
    cost: float | None = None
    """Tracking cost of the plan: log of an error in m, with the cost's pessimism; None where none was asked."""
    minimum_snap_cost: float | None = None
    segment_errors_m: tuple[float, ...] | None = None
    """(S) of the plan; None where no cost that predicts errors was asked."""
    minimum_snap_segment_errors_m: tuple[float, ...] | None = None
    """(S) of minimum snap."""
    fallback: str | None = None
    """Why minimum snap is flown though the mission asks for more."""


@dataclass(frozen=True, slots=True)
class LegFile:
    """A leg in `plan.json`: durations (S) in s, coefficients (4, S, 8) of x, y, z and yaw in ascending powers."""

    kind: LegKind
    durations_s: list[float]
    coefficients: list[list[list[float]]]
    settle: bool = False
    waypoints: list[list[float]] | None = None
    baseline_durations_s: list[float] | None = None
    baseline_coefficients: list[list[list[float]]] | None = None
    item: int | None = None

    @staticmethod
    def of(leg: Leg) -> LegFile:
        """What is written of a leg."""
        return LegFile(
            kind=leg.kind,
            durations_s=leg.trajectory.durations_s.tolist(),
            coefficients=leg.trajectory.coefficients.tolist(),
            settle=leg.settle,
            waypoints=None if leg.waypoints is None else leg.waypoints.tolist(),
            baseline_durations_s=None if leg.baseline is None else leg.baseline.durations_s.tolist(),
            baseline_coefficients=None if leg.baseline is None else leg.baseline.coefficients.tolist(),
            item=leg.item,
        )

    def leg(self) -> Leg:
        """The leg that this was made of, equal to the bit."""
        baseline = None
        if self.baseline_durations_s is not None and self.baseline_coefficients is not None:
            baseline = Trajectory(_array(self.baseline_durations_s), _array(self.baseline_coefficients))
        return Leg(
            kind=self.kind,
            trajectory=Trajectory(_array(self.durations_s), _array(self.coefficients)),
            waypoints=None if self.waypoints is None else _array(self.waypoints),
            settle=self.settle,
            baseline=baseline,
            item=self.item,
        )


def written(plan: FlightPlan) -> tuple[LegFile, ...]:
    """All legs, as they are written."""
    return tuple(LegFile.of(leg) for leg in plan.legs)


def read(legs: list[LegFile]) -> FlightPlan:
    """The plan of these legs."""
    return FlightPlan(tuple(file.leg() for file in legs))


def _array(values: Any) -> FloatArray:
    return np.asarray(values, dtype=np.float64)
