"""What a rehearsal found, and whether the mission may be flown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcd_flight.model import BoolArray, FloatArray, LegKind, RefusedError, Vector3

QUANTILE = 0.95


@dataclass(frozen=True, slots=True)
class Spot:
    """Where in a flight something happened."""

    place: str
    """Part of the mission, e.g. `missions/x.yaml:20: plan[2].trajectory`."""
    leg: int
    """Index into the plan's legs."""
    kind: LegKind
    segment: int
    """Of the leg, from 0."""
    time_s: float
    """From the start of the flight, without waits to settle."""
    leg_time_s: float
    """From the start of the leg."""
    p_W: Vector3
    """m, where the plan is then."""

    def __str__(self) -> str:
        """For a message."""
        point = "({:.2f}, {:.2f}, {:.2f})".format(*self.p_W)
        on_trajectory = self.kind is LegKind.TRAJECTORY
        between = f" between waypoints {self.segment + 1} and {self.segment + 2}," if on_trajectory else ""
        return f"{self.place} at {self.leg_time_s:.2f} s,{between} near {point}"


@dataclass(frozen=True, slots=True, eq=False)
class Rehearsal:
    """The runs and the verdict."""

    errors_m: FloatArray
    """(N,) largest position error of each run."""
    completed: BoolArray
    """(N,) whether the run kept within the error at which the flight lands, and within the model's validity."""
    longest_saturation_s: float
    """The longest that a motor was at its limit, over all runs."""
    limit_m: float
    """safety.max_predicted_error."""
    where: Spot
    """Where the worst run first exceeded the limit; where it was worst if it did not."""

    @property
    def runs(self) -> int:
        """How many flights."""
        return len(self.errors_m)

    @property
    def max_error_m(self) -> float:
        """The largest error of all."""
        return float(self.errors_m.max())

    @property
    def p95_error_m(self) -> float:
        """The least error that at least 95 % of the runs kept within."""
        return float(np.quantile(self.errors_m, QUANTILE, method="inverted_cdf"))

    @property
    def passed(self) -> bool:
        """Whether every run was completed and 95 % of them kept within the limit."""
        return bool(self.completed.all()) and self.p95_error_m <= self.limit_m

    @property
    def text(self) -> str:
        """The verdict in one line."""
        saturation = f"longest saturation {self.longest_saturation_s * 1e3:.0f} ms"
        found = (
            f"{int(self.completed.sum())}/{self.runs} runs completed, max error {self.max_error_m:.2f} m "
            f"(p95 {self.p95_error_m:.2f}, limit {self.limit_m:g}), {saturation}"
        )
        return f"{found}: pass" if self.passed else f"{found}: refused; trouble begins in {self.where}"

    @property
    def refusal(self) -> str:
        """Why the flight is refused, where, and what helps; empty where it passed."""
        if self.passed:
            return ""
        return (
            f"rehearsal: {self.text}; lower planner.speed, let planner.type be learned, or look at the faults in "
            "rehearse.faults"
        )

    def require(self) -> None:
        """Do nothing if it passed.

        Raises:
            RefusedError: it did not; `refusal` says why.
        """
        if not self.passed:
            raise RefusedError(self.refusal)
