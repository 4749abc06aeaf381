"""The numbers that say how good a flight was: those of the summary, of `--json` and of the report page."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from lcd_flight.model import Leg, LegKind, Outcome, Phase
from lcd_flight.model.types import BoolArray, FloatArray
from lcd_flight.record import FlightLog, Series
from lcd_flight.review.costs import SegmentFigures, segment_figures
from lcd_flight.review.kinematics import attitude_error_rad, attitude_lag_s, tilt_rad
from lcd_flight.review.spans import Span, airborne, span_name, spans, tracking


@dataclass(frozen=True, slots=True)
class PhaseFigures:
    """One stretch of the flight; None where there was nothing to measure."""

    name: str
    begin_s: float
    duration_s: float
    rmse_m: float | None
    max_error_m: float | None
    max_speed: float | None
    """m/s"""
    saturation_share: float


@dataclass(frozen=True, slots=True)
class FlightFigures:
    """Figures of merit. Position errors are those that the controller saw: filtered pose minus reference.

    None stands where there was nothing to measure.
    """

    outcome: Outcome | None
    """None where the log ends before the flight does."""
    duration_s: float
    """In the air."""
    position_rmse_m: float | None
    """Over the mission's trajectories: not take-off, holds, ways between and landing."""
    max_position_error_m: float | None
    """Over the mission's trajectories."""
    max_position_error_time_s: float | None
    """When that was, since the first tick."""
    overall_rmse_m: float | None
    """Over all ticks in the air."""
    overall_max_error_m: float | None
    """Over all ticks in the air."""
    waypoint_errors_m: tuple[float | None, ...]
    """Distance from each waypoint at the instant that the plan gave it; None where it was not reached."""
    predicted_max_error_m: float | None
    """The rehearsal's."""
    saturation_share: float
    """Of the ticks in the air, those with a motor or the thrust command at its limit."""
    max_speed: float | None
    """m/s"""
    max_tilt_rad: float | None
    ticks: int
    missed_ticks: int
    loop_rate_hz: float | None
    lateness_median_s: float
    lateness_p99_s: float
    lateness_max_s: float
    battery_first_V: float | None
    battery_last_V: float | None
    battery_min_V: float | None
    pose_received: int
    pose_lost: int
    pose_late: int
    pose_rejected: int
    pose_age_max_s: float | None
    """In the air."""
    link_lost: int
    max_attitude_error_rad: float | None
    """Angle between setpoint and flown attitude, in the air."""
    attitude_lag_s: float | None
    """By how much the thrust direction follows its setpoint late."""
    segments: tuple[SegmentFigures, ...]
    """The planner's expectation beside what was flown."""
    phases: tuple[PhaseFigures, ...]

    def to_json(self) -> dict[str, Any]:
        """As builtin types, fit for JSON: no NaN, no enumerations."""
        return {**asdict(self), "outcome": None if self.outcome is None else self.outcome.value}


def figures_of(log: FlightLog) -> FlightFigures:
    """Measure a flight."""
    series = log.series
    flying, on_track = airborne(series), tracking(log)
    error_m = series.error_m
    speed = np.linalg.norm(series.v_WB_W, axis=1)
    lateness_s = np.percentile(series.lateness_s, (50.0, 99.0, 100.0))
    battery_V = series.battery_V[np.isfinite(series.battery_V)]
    received, lost, late, rejected = series.pose_counts[-1].tolist()
    return FlightFigures(
        outcome=_outcome(series),
        duration_s=float(series.dt_s[flying].sum()),
        position_rmse_m=_rms(error_m[on_track]),
        max_position_error_m=_largest(error_m[on_track]),
        max_position_error_time_s=_time_of_largest(series, np.where(on_track, error_m, np.nan)),
        overall_rmse_m=_rms(error_m[flying]),
        overall_max_error_m=_largest(error_m[flying]),
        waypoint_errors_m=waypoint_errors_m(log),
        predicted_max_error_m=log.header.predicted_max_error_m,
        saturation_share=_share(series.saturated[flying]),
        max_speed=_largest(speed[flying]),
        max_tilt_rad=_largest(tilt_rad(series.q_WB[flying])),
        ticks=len(series),
        missed_ticks=int(series.missed.sum()),
        loop_rate_hz=_rate(series),
        lateness_median_s=float(lateness_s[0]),
        lateness_p99_s=float(lateness_s[1]),
        lateness_max_s=float(lateness_s[2]),
        battery_first_V=float(battery_V[0]) if len(battery_V) else None,
        battery_last_V=float(battery_V[-1]) if len(battery_V) else None,
        battery_min_V=_smallest(battery_V),
        pose_received=received,
        pose_lost=lost,
        pose_late=late,
        pose_rejected=rejected,
        pose_age_max_s=_largest(series.pose_age_s[flying]),
        link_lost=int(series.link_counts[-1, 2]),
        max_attitude_error_rad=_largest(attitude_error_rad(series)[flying]),
        attitude_lag_s=attitude_lag_s(series),
        segments=segment_figures(log),
        phases=tuple(_phase(log, span, error_m, speed) for span in spans(series)),
    )


def waypoint_errors_m(log: FlightLog) -> tuple[float | None, ...]:
    """Distance from each waypoint at its planned instant, over all trajectories of the mission."""
    return tuple(
        error
        for number, leg in enumerate(log.header.plan.legs)
        if leg.kind is LegKind.TRAJECTORY and leg.waypoints is not None
        for error in _leg_waypoint_errors_m(log.series, number, leg, leg.waypoints)
    )


def _leg_waypoint_errors_m(series: Series, number: int, leg: Leg, waypoints: FloatArray) -> list[float | None]:
    """The flown position is interpolated between ticks."""
    ticks = np.flatnonzero((series.leg == number) & (series.phase == Phase.TRACK.value))
    if len(ticks) == 0:
        return [None] * len(waypoints)
    # The last waypoint's instant falls between the leg's last tick and the next leg's first. While a leg settles, its
    # time stands still: the first tick of each time counts.
    after = ticks[-1] + 1
    leg_time_s = series.leg_time_s[ticks]
    if after < len(series):
        ticks = np.append(ticks, after)
        leg_time_s = np.append(leg_time_s, leg_time_s[-1] + series.dt_s[after])
    leg_time_s, first = np.unique(leg_time_s, return_index=True)
    flown = series.p_WB[ticks[first]]
    planned_s = leg.trajectory.knot_times_s
    at = np.stack([np.interp(planned_s, leg_time_s, axis, right=np.nan) for axis in flown.T], axis=1)
    return [_number(float(np.linalg.norm(row))) for row in at - waypoints[:, :3]]


def _outcome(series: Series) -> Outcome | None:
    """What the phases say of the flight's end. Motors that are stopped after a landing do not undo it."""
    last = Phase(str(series.phase[-1]))
    landed = np.flatnonzero(series.phase == Phase.LANDED.value)
    if last is Phase.CRASHED:
        return Outcome.CRASHED
    if last is Phase.HANDED_OVER:
        return Outcome.ABORTED
    if len(landed):
        before = series.phase[max(int(landed[0]) - 1, 0)]
        return Outcome.LANDED if before == Phase.LAND.value else Outcome.ABORTED
    return Outcome.CUT if last is Phase.KILL else None


def _phase(log: FlightLog, span: Span, error_m: FloatArray, speed: FloatArray) -> PhaseFigures:
    return PhaseFigures(
        name=span_name(span, log.header.plan),
        begin_s=span.begin_s,
        duration_s=span.end_s - span.begin_s,
        rmse_m=_rms(error_m[span.ticks]),
        max_error_m=_largest(error_m[span.ticks]),
        max_speed=_largest(speed[span.ticks]),
        saturation_share=_share(log.series.saturated[span.ticks]),
    )


def _rate(series: Series) -> float | None:
    """Mean rate at which ticks were flown."""
    duration_s = float(series.time_s[-1])
    return (len(series) - 1) / duration_s if duration_s > 0.0 else None


def _rms(values: FloatArray) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else None


def _largest(values: FloatArray) -> float | None:
    known = values[np.isfinite(values)]
    return float(known.max()) if len(known) else None


def _time_of_largest(series: Series, values: FloatArray) -> float | None:
    known = np.isfinite(values)
    return float(series.time_s[int(np.nanargmax(values))]) if known.any() else None


def _smallest(values: FloatArray) -> float | None:
    return float(values.min()) if len(values) else None


def _share(flags: BoolArray) -> float:
    return float(flags.mean()) if len(flags) else 0.0


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
