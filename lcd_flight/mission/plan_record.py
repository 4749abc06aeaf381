"""A solved trajectory as JSON: what plan files and the cache are made of, and what it must keep to be believed."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from lcd_flight.mission.assemble import TrajectoryTask
from lcd_flight.mission.problems import dotted
from lcd_flight.mission.solution import ModelStamp, Option, Predictions, Solution
from lcd_flight.mission.soundness import flaw
from lcd_flight.model import COEFFICIENTS, FloatArray, Trajectory
from lcd_flight.planning.times import SAME_POINT

Duration = Annotated[float, Field(gt=0.0)]
Waypoint = tuple[float, float, float, float]
Polynomial = Annotated[tuple[float, ...], Field(min_length=COEFFICIENTS, max_length=COEFFICIENTS)]
Chain = tuple[Polynomial, ...]


class Record(BaseModel):
    """Part of a file that a program wrote: nothing unknown, nothing of another type, nothing that is not finite."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class PlanRecord(Record):
    """One trajectory: what was asked, what came of it, and what its planner expects; SI units."""

    waypoints: Annotated[tuple[Waypoint, ...], Field(min_length=2)]
    """(K) x, y, z in m and yaw in rad, unwrapped as it is flown."""
    asked_durations_s: tuple[Duration, ...] | None
    """(S) by the mission's speed or times; None where the trajectory brings its own."""
    method: Annotated[str, Field(min_length=1)]
    options: dict[str, Option]
    model: ModelStamp | None
    fallback: str | None
    durations_s: tuple[Duration, ...]
    """(S)"""
    coefficients: tuple[Chain, Chain, Chain, Chain]
    """(4, S, 8) of x, y, z, yaw; ascending powers of the segment's own time."""
    predictions: Predictions

    @staticmethod
    def of(task: TrajectoryTask, solution: Solution) -> PlanRecord:
        """What is kept of a solution."""
        trajectory = solution.trajectory
        x, y, z, yaw = (tuple(map(tuple, chain)) for chain in trajectory.coefficients.tolist())
        return PlanRecord(
            waypoints=tuple(map(tuple, task.waypoints.tolist())),
            asked_durations_s=None if solution.own_times else tuple(task.durations_s.tolist()),
            method=solution.method,
            options=dict(solution.options),
            model=solution.model,
            fallback=solution.fallback,
            durations_s=tuple(trajectory.durations_s.tolist()),
            coefficients=(x, y, z, yaw),
            predictions=solution.predictions,
        )

    def solution(self, *, cached: bool = False) -> Solution:
        """The solution that this was made of, equal to the bit.

        Raises:
            ValueError: it is damaged: of uneven lengths, not continuous, or it misses a waypoint.
        """
        uneven = {len(chain) for chain in self.coefficients} != {len(self.durations_s)}
        if uneven or not self.durations_s:
            raise ValueError(f"has {len(self.durations_s)} durations, but other numbers of polynomials")
        trajectory = Trajectory(np.array(self.durations_s), np.array(self.coefficients))
        wrong = flaw(trajectory, np.array(self.waypoints)) or self._uneven_predictions()
        if wrong:
            raise ValueError(wrong)
        return Solution(
            trajectory,
            method=self.method,
            fallback=self.fallback,
            own_times=self.asked_durations_s is None,
            options=self.options,
            model=self.model,
            predictions=self.predictions,
            cached=cached,
        )

    def mismatch(self, task: TrajectoryTask) -> str | None:
        """How `task` is another one than this was planned for; None if it is the same."""
        if len(self.waypoints) != len(task.waypoints):
            return f"was planned for {len(self.waypoints)} waypoints, the mission has {len(task.waypoints)}"
        apart = np.abs(np.array(self.waypoints) - task.waypoints).max(axis=1)
        if apart.max() > SAME_POINT:
            n = int(np.argmax(apart > SAME_POINT))
            there, here = _point(np.array(self.waypoints[n])), _point(task.waypoints[n])
            return f"was planned for waypoint {n + 1} at {there}, the mission has it at {here}"
        return self._other_times(task)

    def _other_times(self, task: TrajectoryTask) -> str | None:
        asked = self.asked_durations_s
        if asked is None:
            if not task.times_given:
                return None
            asked = self.durations_s
        apart = np.abs(np.array(asked) - task.durations_s)
        if len(asked) == len(task.durations_s) and apart.max() <= SAME_POINT:
            return None
        here, there = float(task.durations_s.sum()), sum(asked)
        return f"was planned for {there:.3f} s from the first waypoint to the last, the mission asks for {here:.3f} s"

    def _uneven_predictions(self) -> str | None:
        for name in ("segment_errors_m", "minimum_snap_segment_errors_m"):
            errors_m = getattr(self.predictions, name)
            if errors_m is not None and len(errors_m) != len(self.durations_s):
                return f"has {len(errors_m)} {name} for {len(self.durations_s)} segments"
        return None


def first_error(error: ValidationError) -> str:
    """The first thing that is wrong with a record, in one line: place, value, remark."""
    details = error.errors(include_url=False)
    first = details[0]
    place = dotted(tuple(first["loc"]))
    value = "" if isinstance(first["input"], dict | list | tuple) else f"{str(first['input'])[:40]!r}: "
    more = f" (and {len(details) - 1} more)" if len(details) > 1 else ""
    return f"{place + ': ' if place else ''}{value if place else ''}{first['msg']}{more}"


def _point(waypoint: FloatArray) -> str:
    x, y, z, yaw = waypoint.tolist()
    return f"({x:.3f}, {y:.3f}, {z:.3f}) m, yaw {np.degrees(yaw):.1f} deg"
