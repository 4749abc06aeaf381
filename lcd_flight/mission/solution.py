"""What a planner made of one trajectory of a mission, whoever that was: a solver, a plan file, the cache, a CSV."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from lcd_flight.model import Trajectory

MINIMUM_SNAP = "minimum-snap"
"""The method that all others are held against and fall back to."""

Option: TypeAlias = str | int | float | bool | None


@dataclass(frozen=True, slots=True)
class ModelStamp:
    """Which learned cost was asked."""

    name: str
    hash: str
    """16 hexadecimal digits over its numbers (`plan_key.model_hash`)."""


@dataclass(frozen=True, slots=True)
class Predictions:
    """What a planner says of its plan and of minimum snap through the same waypoints; None where it does not say."""

    cost: float | None = None
    """Tracking cost of the plan, in the cost's own unit."""
    minimum_snap_cost: float | None = None
    predicted_max_error_m: float | None = None
    minimum_snap_predicted_max_error_m: float | None = None
    segment_errors_m: tuple[float, ...] | None = None
    """The largest error predicted for each segment."""
    minimum_snap_segment_errors_m: tuple[float, ...] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """A trajectory and what its planner says of it."""

    trajectory: Trajectory
    method: str
    """What it is, e.g. `learned`; `minimum-snap` where the method asked for fell back."""
    fallback: str | None = None
    """Why it is minimum snap though more was asked for."""
    own_times: bool = False
    """Whether it brings its own durations, whatever speed the mission asks for."""
    options: Mapping[str, Option] = field(default_factory=dict)
    """Of the method."""
    model: ModelStamp | None = None
    predictions: Predictions = field(default_factory=Predictions)
    cached: bool = False
    """Whether it was taken from the cache."""
