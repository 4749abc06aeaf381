"""What the simulator says about a batch of flown plans."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from lcd_flight.model.types import BoolArray, FloatArray, IntArray

CRASH_ERROR_M = 1.5
"""The paper's crash bound on the largest position error."""


@dataclass(frozen=True, slots=True, eq=False)
class RolloutLabels:
    """One row for each rollout; the errors are sampled once per control step of 10 ms.

    A rollout that leaves the model's validity (any |v_i| > 20 m/s or |w_i| > 100 rad/s) ends there: `valid` is
    False, `crashed` is True and the errors hold what was seen until then.
    """

    max_error_m: FloatArray
    """(N,) largest position error."""
    max_error_time_s: FloatArray
    """(N,) when that was, from the start of the plan."""
    mean_error_m: FloatArray
    """(N,)"""
    rms_error_m: FloatArray
    """(N,)"""
    p8_error_m: FloatArray
    """(N,) eighth-power mean of the position error: a smooth stand-in for the largest."""
    segment_max_error_m: FloatArray
    """(N, S); NaN for segments that were never reached."""
    waypoint_error_m: FloatArray
    """(N, S + 1) distance from each waypoint at its instant; NaN where never reached."""
    yaw_cost: FloatArray
    """(N,) mean of 2 (1 - cos e_yaw)."""
    paper_cost: FloatArray
    """(N,) sum over steps of |e_p|^2 + e_yaw^2, yaw wrapped (paper, section IV)."""
    released_cost: FloatArray
    """(N,) the released code's: sum of |e_p|^2 + |e_v|^2 + e_yaw^2, yaw not wrapped."""
    saturation_share: FloatArray
    """(N,) share of motor commands that were clipped."""
    longest_saturation_s: FloatArray
    """(N,) longest unbroken time with at least one motor clipped."""
    valid: BoolArray
    """(N,) whether the rollout stayed within the model's validity to its end."""

    @property
    def crashed(self) -> BoolArray:
        """(N,) largest error above 1.5 m, or the early exit (`method.md`: count it as a crash)."""
        return np.asarray((self.max_error_m > CRASH_ERROR_M) | ~self.valid)

    def __len__(self) -> int:
        """How many rollouts there are."""
        return len(self.max_error_m)

    def take(self, rows: slice | IntArray) -> RolloutLabels:
        """The chosen rows."""
        return RolloutLabels(*(getattr(self, f.name)[rows] for f in fields(RolloutLabels)))

    @staticmethod
    def concatenate(parts: list[RolloutLabels]) -> RolloutLabels:
        """Batches of the same segment count, one after another."""
        return RolloutLabels(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(RolloutLabels)))


@dataclass(frozen=True, slots=True, eq=False)
class FlownPath:
    """Where one rollout went, tick by tick of 10 ms, up to its end or to where it left the model's validity."""

    times_s: FloatArray
    """(T,) from the start of the plan."""
    p_WB: FloatArray
    """(T, 3) m"""
    yaw_rad: FloatArray
    """(T,) unwrapped, from the yaw of the plan's first waypoint on."""
