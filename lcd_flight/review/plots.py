"""Which charts a flight is shown in."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lcd_flight.drawing.scale import Axis, axis_around
from lcd_flight.model import Severity
from lcd_flight.model.types import BoolArray, FloatArray
from lcd_flight.record import FlightLog, Series
from lcd_flight.review.chart import Band, Chart, Flag, Panel, Rule, Timeline, Trace
from lcd_flight.review.spans import airborne, span_name, spans

_BEFORE_TAKEOFF_S = 2.0
"""How much of the time on the ground is shown: a pilot may have waited for minutes."""

_FLAGS = {Severity.INFO: "info", Severity.WARN: "warn"}
_AXES = ("x", "y", "z")


def timeline(log: FlightLog) -> Timeline:
    """The time shown: from just before take-off, or all of it where there was none."""
    series = log.series
    flying = np.flatnonzero(airborne(series))
    begin_s = max(0.0, float(series.time_s[flying[0]]) - _BEFORE_TAKEOFF_S) if len(flying) else 0.0
    axis = Axis(begin_s, max(float(series.time_s[-1]), begin_s + 0.1))
    shown = [span for span in spans(series) if span.end_s > begin_s]
    phases = [
        Band(
            span_name(span, log.header.plan),
            span.begin_s,
            span.end_s,
            f"phase-{number % 2}" if span.phase.airborne else "ground",
        )
        for number, span in enumerate(shown)
    ]
    flags = [
        Flag(found.finding.message, found.begin_s, _FLAGS.get(found.finding.severity, "severe"))
        for found in log.findings
        if found.begin_s >= begin_s
    ]
    return Timeline(series.time_s, axis, phases, flags)


def panels(log: FlightLog) -> Iterator[Panel]:
    """All panels, in the order of the page."""
    series = log.series
    yield _error(log)
    yield _axes("Position", "m", series.p_WB, series.reference_p_W, least=0.2)
    yield _axes("Velocity", "m/s", series.v_WB_W, series.reference_v_W, least=0.2)
    yield _attitude(series)
    yield _rates(series)
    yield _thrust(log)
    yield from _health(log)


def euler_deg(q: FloatArray) -> FloatArray:
    """(T, 3) roll, pitch and yaw (unwrapped) in degrees from (T, 4) attitudes; turned about z, then y, then x."""
    x, y, z, w = q.T
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    known = np.isfinite(yaw)
    yaw[known] = np.unwrap(yaw[known])
    return np.asarray(np.degrees(np.stack([roll, pitch, yaw], axis=1)))


def _error(log: FlightLog) -> Panel:
    limits, predicted = log.header.limits, log.header.predicted_max_error_m
    error_m = log.series.error_m
    known = error_m[np.isfinite(error_m)]
    top = max(3.0, 1.3 * float(known.max(initial=0.0)))
    rules = [
        Rule(f"{limits.max_position_error_m:g} m: land at once", limits.max_position_error_m, "limit"),
        Rule(f"{limits.brake_position_error_m:g} m: brake", limits.brake_position_error_m, "warning"),
    ]
    if predicted is not None:
        rules.append(Rule(f"{predicted:.2f} m: rehearsed maximum", predicted, "note"))
    trace = Trace("distance from the reference", np.maximum(error_m, 1e-3), "flown")
    chart = Chart("Error", "m, by powers of ten", [trace], Axis(1e-3, top, log=True), rules)
    return Panel("Position error", [chart], wide=True)


def _axes(title: str, unit: str, flown: FloatArray, reference: FloatArray, least: float) -> Panel:
    """Flown against reference, an axis of the world each."""
    charts = [
        Chart(
            name,
            unit,
            [Trace("reference", reference[:, axis], "reference"), Trace("flown", flown[:, axis], "flown")],
            axis_around(flown[:, axis], reference[:, axis], least=least),
        )
        for axis, name in enumerate(_AXES)
    ]
    return Panel(title, charts)


def _attitude(series: Series) -> Panel:
    flown, asked = euler_deg(series.q_WB), euler_deg(series.setpoint_q_WB)
    # Each was unwrapped on its own: bring the setpoint's yaw to the turn that the vehicle is on.
    difference = np.nanmedian(flown[:, 2] - asked[:, 2]) if np.isfinite(flown[:, 2] - asked[:, 2]).any() else 0.0
    asked[:, 2] += 360.0 * round(float(difference) / 360.0)
    charts = [
        Chart(
            name,
            "°",
            [Trace("setpoint", asked[:, axis], "reference"), Trace("flown", flown[:, axis], "flown")],
            axis_around(flown[:, axis], asked[:, axis], least=10.0),
        )
        for axis, name in enumerate(("roll", "pitch", "yaw"))
    ]
    return Panel("Attitude", charts)


def _rates(series: Series) -> Panel:
    rates = np.degrees(series.w_WB_B)
    charts = [
        Chart(name, "°/s", [Trace("flown", rates[:, axis], "flown")], axis_around(rates[:, axis], least=20.0))
        for axis, name in enumerate(_AXES)
    ]
    return Panel("Body rates", charts)


def _thrust(log: FlightLog) -> Panel:
    series, vehicle = log.series, log.header.vehicle
    saturated = [
        Band("saturated", begin, end, "saturated") for begin, end in _stretches(series.time_s, series.saturated)
    ]
    rules = [Rule("full thrust", vehicle.max_thrust_N, "limit"), Rule("weight", vehicle.weight_N, "note")]
    thrust = Chart(
        "Collective thrust",
        "N",
        [Trace("setpoint", series.setpoint_thrust_N, "flown")],
        Axis(0.0, 1.1 * vehicle.max_thrust_N),
        rules,
        saturated,
    )
    if not np.isfinite(series.motor_shares).any():
        return Panel("Thrust and saturation", [thrust], "Shaded: a motor or the thrust command at its limit.")
    motors = [
        Trace(f"motor {number + 1}", 100.0 * series.motor_shares[:, number], style)
        for number, style in zip(range(series.motor_shares.shape[1]), "abcd", strict=False)
    ]
    shares = Chart("Motor commands", "% of full scale", motors, Axis(0.0, 105.0), [], saturated)
    return Panel("Thrust and saturation", [thrust, shares], "Shaded: a motor or the thrust command at its limit.")


def _health(log: FlightLog) -> Iterator[Panel]:
    series, limits = log.series, log.header.limits
    if np.isfinite(series.battery_V).any():
        rules = [
            Rule("warning", limits.battery_warning_V, "warning"),
            Rule("critical", limits.battery_critical_V, "limit"),
        ]
        levels = np.array([rule.value for rule in rules])
        axis = axis_around(series.battery_V, levels, least=0.2)
        yield Panel("Battery", [Chart("Battery", "V", [Trace("voltage", series.battery_V, "flown")], axis, rules)])
    age_ms = 1e3 * series.pose_age_s
    rules = [
        Rule("coasting ends: brake", 1e3 * limits.pose_coast_s, "warning"),
        Rule("pose lost", 1e3 * limits.pose_timeout_s, "limit"),
    ]
    top = max(20.0, 1.2 * float(np.nanmax(age_ms, initial=0.0)))
    age = Chart("Age of the pose", "ms", [Trace("since the newest frame", age_ms, "flown")], Axis(0.0, top), rules)
    yield Panel("Motion capture", [age])


def _stretches(time_s: FloatArray, flags: BoolArray) -> list[tuple[float, float]]:
    """Begin and end of each stretch of true flags, a tick at least; gaps too small to see are closed."""
    tick_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.01
    gap_s = max(tick_s, (float(time_s[-1]) - float(time_s[0])) / 500.0)
    found: list[tuple[float, float]] = []
    for begin_s in time_s[flags].tolist():
        if found and begin_s - found[-1][1] <= gap_s:
            found[-1] = (found[-1][0], begin_s + tick_s)
        else:
            found.append((begin_s, begin_s + tick_s))
    return found
