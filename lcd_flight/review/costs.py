"""The planner's expectation beside what was flown: the largest error of each segment, as the tracking cost means it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcd_flight.model import Leg, LegKind, Phase
from lcd_flight.model.types import FloatArray
from lcd_flight.record import FlightLog, Series
from lcd_flight.review.kinematics import yaw_rad

YAW_WEIGHT_M2 = 0.1
LEAST_M, GREATEST_M = 0.01, 5.0
"""As the cost was trained (`lcd_flight.learning.targets`, which a test holds these to)."""


@dataclass(frozen=True, slots=True)
class SegmentFigures:
    """One segment of one trajectory; errors in m hold a share of the yaw error and lie between 1 cm and 5 m."""

    leg: int
    """Index into the plan's legs."""
    segment: int
    """Within the leg, from 0."""
    begin_s: float | None
    """In the flight; None where it was not reached."""
    end_s: float | None
    measured_m: float | None
    """None where it was not flown to its end."""
    predicted_m: float | None
    """By the planner, for the plan that was flown; None where it had no learned cost."""
    minimum_snap_predicted_m: float | None
    """By the planner, for minimum snap through the same waypoints."""


def segment_figures(log: FlightLog) -> tuple[SegmentFigures, ...]:
    """All segments of the mission's trajectories, in order."""
    predicted = {row.leg: row for row in log.header.predictions}
    rows: list[SegmentFigures] = []
    for number, leg in enumerate(log.header.plan.legs):
        if leg.kind is not LegKind.TRAJECTORY:
            continue
        prediction = predicted.get(number)
        learned = prediction.segment_errors_m if prediction else None
        baseline = prediction.minimum_snap_segment_errors_m if prediction else None
        for segment, (begin_s, end_s, measured_m) in enumerate(_measured(log.series, number, leg)):
            rows.append(
                SegmentFigures(
                    number, segment, begin_s, end_s, measured_m, _at(learned, segment), _at(baseline, segment)
                )
            )
    return tuple(rows)


def cost_error_m(max_error_m: FloatArray, yaw_cost: float) -> FloatArray:
    """What the tracking cost calls an error, from largest position errors in m and the mean of 2 (1 - cos e_yaw)."""
    squared = np.clip(max_error_m**2 + YAW_WEIGHT_M2 * yaw_cost, LEAST_M**2, GREATEST_M**2)
    return np.asarray(np.sqrt(squared))


_Measured = tuple[float | None, float | None, float | None]


def _measured(series: Series, number: int, leg: Leg) -> list[_Measured]:
    """Begin, end and error of each segment; while a leg settles its time stands still, which is not flown any more."""
    ticks = np.flatnonzero((series.leg == number) & (series.phase == Phase.TRACK.value))
    leg_time_s, first = np.unique(series.leg_time_s[ticks], return_index=True)
    ticks = ticks[first]
    error_m = series.error_m[ticks]
    yaw_error = series.reference_yaw_rad[ticks] - yaw_rad(series.q_WB[ticks])
    known = np.isfinite(error_m) & np.isfinite(yaw_error)
    knots = leg.trajectory.knot_times_s
    if not known.any():
        return [(None, None, None)] * (len(knots) - 1)
    yaw_cost = float(np.mean(2.0 * (1.0 - np.cos(yaw_error[known]))))
    zero_s = float(series.time_s[ticks[0]] - leg_time_s[0])
    tick_s = float(np.median(series.dt_s[ticks]))
    rows: list[_Measured] = []
    for begin, end in zip(knots[:-1].tolist(), knots[1:].tolist(), strict=True):
        inside = known & (leg_time_s >= begin - 1e-9) & (leg_time_s <= end + 1e-9)
        flown = bool(inside.any()) and leg_time_s[-1] >= end - 1.5 * tick_s
        measured = float(cost_error_m(error_m[inside].max(), yaw_cost)) if flown else None
        reached = leg_time_s[-1] >= begin
        rows.append((zero_s + begin if reached else None, zero_s + end if reached else None, measured))
    return rows


def _at(values: tuple[float, ...] | None, index: int) -> float | None:
    return values[index] if values is not None and index < len(values) else None
