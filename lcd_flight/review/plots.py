"""Which charts a flight is shown in: how it moved, against what it should have done. `health.py` has the rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from lcd_flight.drawing.scale import Axis, axis_around
from lcd_flight.model import CRASH_ERROR_M
from lcd_flight.model.types import FloatArray
from lcd_flight.record import FlightLog, Series
from lcd_flight.review.chart import Chart, Panel, Rule, Trace
from lcd_flight.review.costs import SegmentFigures, segment_figures
from lcd_flight.review.health import health
from lcd_flight.review.kinematics import (
    attitude_error_rad,
    attitude_lag_s,
    euler_deg,
    reference_rates,
    thrust_direction_error_rad,
)

LEAST_ERROR_M = 1e-3
"""Lower end of logarithmic axes of errors."""

AXES = ("x", "y", "z")
ANGLES = ("roll", "pitch", "yaw")


def panels(log: FlightLog) -> Iterator[Panel]:
    """All panels, in the order of the page."""
    series = log.series
    yield _error(log)
    yield from _cost(series, segment_figures(log))
    yield _axes("Position", "m", series, series.p_WB, series.reference_p_W, played=True)
    yield _axes("Velocity", "m/s", series, series.v_WB_W, series.reference_v_W)
    yield _attitude(series)
    yield _rates(series)
    yield _lag(series)
    yield from health(log)


def error_axis(*errors_m: FloatArray) -> Axis:
    """By powers of ten, so that centimetres of tracking and the crash bound are both legible."""
    known = np.concatenate([error_m[np.isfinite(error_m)] for error_m in errors_m])
    return Axis(LEAST_ERROR_M, max(3.0, 1.3 * float(known.max(initial=0.0))), log=True)


def error_rules(log: FlightLog) -> list[Rule]:
    """The crash bound, and the flight's own limits where they are others."""
    limits = log.header.limits
    levels = {limits.max_position_error_m: "land at once", limits.brake_position_error_m: "brake"}
    crash = f"{CRASH_ERROR_M:g} m: crash bound"
    if CRASH_ERROR_M in levels:
        crash += f", {levels.pop(CRASH_ERROR_M)}"
    return [
        Rule(crash, CRASH_ERROR_M, "limit"),
        *(Rule(f"{value:g} m: {words}", value, "warning") for value, words in levels.items()),
    ]


def _error(log: FlightLog) -> Panel:
    series, predicted = log.series, log.header.predicted_max_error_m
    rules = error_rules(log)
    if predicted is not None:
        rules.append(Rule(f"{predicted:.2f} m: rehearsed maximum", predicted, "note"))
    trace = Trace("from the reference", series.time_s, np.maximum(series.error_m, LEAST_ERROR_M), "flown")
    chart = Chart("Distance", "m, by powers of ten", [trace], error_axis(series.error_m), rules)
    return Panel("Position error", [chart], wide=True)


def _cost(series: Series, segments: Sequence[SegmentFigures]) -> Iterator[Panel]:
    """Steps over the time of each segment; nothing where no trajectory was flown."""
    traces = [
        Trace(name, series.time_s, values, style)
        for name, attribute, style in (
            ("minimum snap predicted", "minimum_snap_predicted_m", "baseline"),
            ("predicted", "predicted_m", "reference"),
            ("measured", "measured_m", "flown"),
        )
        for values in [_steps(series, segments, attribute)]
        if np.isfinite(values).any()
    ]
    if not traces:
        return
    axis = Axis(LEAST_ERROR_M * 10.0, error_axis(*(trace.values for trace in traces)).high, log=True)
    note = (
        "The largest error of each segment as the tracking cost means it: with a share of the yaw error, between 1 cm "
        "and 5 m. Predicted: by the planner, before the flight."
    )
    rules = [Rule(f"{CRASH_ERROR_M:g} m: crash bound", CRASH_ERROR_M, "limit")]
    chart = Chart("Error of the segment", "m, by powers of ten", traces, axis, rules)
    yield Panel("Tracking cost, predicted and measured", [chart], note, wide=True)


def _steps(series: Series, segments: Sequence[SegmentFigures], attribute: str) -> FloatArray:
    """(T,) each segment's value while it was flown."""
    values = np.full(len(series), np.nan)
    for row in segments:
        value = getattr(row, attribute)
        if value is not None and row.begin_s is not None and row.end_s is not None:
            values[(series.time_s >= row.begin_s) & (series.time_s < row.end_s)] = value
    return values


def _axes(
    title: str, unit: str, series: Series, flown: FloatArray, reference: FloatArray, played: bool = False
) -> Panel:
    """Flown against reference, an axis of the world each; `played`: the path is played by these."""
    charts = [
        Chart(
            name,
            unit,
            [
                Trace("reference", series.time_s, reference[:, axis], "reference", f"0/reference-{name}" * played),
                Trace("flown", series.time_s, flown[:, axis], "flown", f"0/{name}" * played),
            ],
            axis_around(flown[:, axis], reference[:, axis], least=0.2),
        )
        for axis, name in enumerate(AXES)
    ]
    return Panel(title, charts)


def _attitude(series: Series) -> Panel:
    flown, asked = euler_deg(series.q_WB), euler_deg(series.setpoint_q_WB)
    # Each was unwrapped on its own: bring the setpoint's yaw to the turn that the vehicle is on.
    difference = flown[:, 2] - asked[:, 2]
    turns = np.nanmedian(difference) / 360.0 if np.isfinite(difference).any() else 0.0
    asked[:, 2] += 360.0 * round(float(turns))
    charts = [
        Chart(
            name,
            "°",
            [
                Trace("setpoint", series.time_s, asked[:, axis], "reference"),
                Trace("flown", series.time_s, flown[:, axis], "flown", f"0/{name}"),
            ],
            axis_around(flown[:, axis], asked[:, axis], least=10.0),
        )
        for axis, name in enumerate(ANGLES)
    ]
    return Panel("Attitude", charts)


def _rates(series: Series) -> Panel:
    flown, reference = np.degrees(series.w_WB_B), np.degrees(reference_rates(series))
    charts = [
        Chart(
            name,
            "°/s",
            [
                Trace("reference", series.time_s, reference[:, axis], "reference"),
                Trace("flown", series.time_s, flown[:, axis], "flown"),
            ],
            axis_around(flown[:, axis], reference[:, axis], least=20.0),
        )
        for axis, name in enumerate(AXES)
    ]
    return Panel("Body rates", charts, "Reference: the rates that following the trajectory exactly would take.")


def _lag(series: Series) -> Panel:
    angle, tilted = np.degrees(attitude_error_rad(series)), np.degrees(thrust_direction_error_rad(series))
    top = max(10.0, 1.1 * float(np.nanmax(angle, initial=0.0)))
    lag_s = attitude_lag_s(series)
    note = (
        "The setpoint hardly moved: no delay can be told."
        if lag_s is None
        else f"In flight the thrust direction follows its setpoint {1e3 * lag_s:.0f} ms late."
    )
    traces = [
        Trace("attitude", series.time_s, angle, "reference"),
        Trace("thrust direction alone", series.time_s, tilted, "flown"),
    ]
    return Panel("Attitude lag", [Chart("Angle to the setpoint", "°", traces, Axis(0.0, top))], note)
