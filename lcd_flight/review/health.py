"""Charts of what a flight depends on: thrust, battery, motion capture, link and loop."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lcd_flight.drawing.scale import Axis, axis_around
from lcd_flight.model.types import BoolArray, FloatArray, IntArray
from lcd_flight.record import FlightLog, Series
from lcd_flight.review.chart import Band, Chart, Panel, Rule, Trace

_COUNTS = (("lost", "b", 1), ("late", "c", 2), ("rejected", "d", 3))
"""Columns of `Series.pose_counts` that tell of trouble."""

_MOST_STRETCHES = 800
"""Of saturation, in one chart."""


def health(log: FlightLog) -> Iterator[Panel]:
    """The panels, in the order of the page; none for what was never reported."""
    yield thrust(log)
    if np.isfinite(log.series.battery_V).any():
        yield _battery(log)
    yield _mocap(log)
    yield _link(log)
    yield _loop(log.series)


def saturated_bands(series: Series) -> list[Band]:
    """Where a motor or the thrust command was at its limit."""
    return [Band("saturated", begin, end, "saturated") for begin, end in stretches(series.time_s, series.saturated)]


def thrust(log: FlightLog) -> Panel:
    """Thrust, and the motors where they were reported, with saturation shaded."""
    series, vehicle = log.series, log.header.vehicle
    bands = saturated_bands(series)
    rules = [Rule("full thrust", vehicle.max_thrust_N, "limit"), Rule("weight", vehicle.weight_N, "note")]
    setpoint = Trace("setpoint", series.time_s, series.setpoint_thrust_N, "flown")
    charts = [Chart("Collective thrust", "N", [setpoint], Axis(0.0, 1.1 * vehicle.max_thrust_N), rules, bands)]
    if np.isfinite(series.motor_shares).any():
        motors = [
            Trace(f"motor {number + 1}", series.time_s, 100.0 * series.motor_shares[:, number], style)
            for number, style in zip(range(series.motor_shares.shape[1]), "abcd", strict=False)
        ]
        charts.append(Chart("Motor commands", "% of full scale", motors, Axis(0.0, 105.0), [], bands))
    return Panel("Thrust and saturation", charts, "Shaded red: a motor or the thrust command at its limit.")


def stretches(time_s: FloatArray, flags: BoolArray) -> list[tuple[float, float]]:
    """Begin and end of each stretch of true flags, a tick at least; gaps too small to see are closed."""
    tick_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.01
    gap_s = max(1.5 * tick_s, (float(time_s[-1]) - float(time_s[0])) / _MOST_STRETCHES)
    found: list[tuple[float, float]] = []
    for begin_s in time_s[flags].tolist():
        if found and begin_s - found[-1][1] <= gap_s:
            found[-1] = (found[-1][0], begin_s + tick_s)
        else:
            found.append((begin_s, begin_s + tick_s))
    return found


def _battery(log: FlightLog) -> Panel:
    series, limits = log.series, log.header.limits
    rules = [
        Rule("warning", limits.battery_warning_V, "warning"),
        Rule("critical", limits.battery_critical_V, "limit"),
    ]
    axis = axis_around(series.battery_V, np.array([rule.value for rule in rules]), least=0.2)
    voltage = Trace("voltage", series.time_s, series.battery_V, "flown")
    return Panel("Battery", [Chart("Battery", "V", [voltage], axis, rules)])


def _mocap(log: FlightLog) -> Panel:
    series, limits = log.series, log.header.limits
    rules = [
        Rule("coasting ends: brake", 1e3 * limits.pose_coast_s, "warning"),
        Rule("pose lost", 1e3 * limits.pose_timeout_s, "limit"),
    ]
    age_ms = 1e3 * series.pose_age_s
    age = Trace("since the newest frame", series.time_s, age_ms, "flown")
    counts = [
        Trace(name, series.time_s, series.pose_counts[:, n].astype(np.float64), style) for name, style, n in _COUNTS
    ]
    charts = [
        Chart("Age of the pose", "ms", [age], _upwards(age_ms, 20.0), rules),
        Chart("Frames", "in all", counts, _upwards(series.pose_counts[:, 1:], 5.0)),
    ]
    received = int(series.pose_counts[-1, 0])
    rate_hz = series.pose_rate_hz[np.isfinite(series.pose_rate_hz)]
    rate = f", {np.median(rate_hz):.0f} a second in the median" if len(rate_hz) else ""
    lost, late, rejected = series.pose_counts[-1, 1:].tolist()
    note = f"{received} frames{rate}; {lost} lost, {late} late, {rejected} rejected by the filter's gate."
    return Panel("Motion capture", charts, note)


def _link(log: FlightLog) -> Panel:
    series = log.series
    loss = Trace("of the last second", series.time_s, 100.0 * series.link_loss_share, "d")
    age_ms = 1e3 * series.link_age_s
    age = Trace("since the newest packet", series.time_s, age_ms, "flown")
    timeout = Rule("link timeout", 1e3 * log.header.limits.link_timeout_s, "limit")
    charts = [
        Chart("Packets lost", "%", [loss], _upwards(loss.values, 5.0)),
        Chart("Age of the link", "ms", [age], _upwards(age_ms, 20.0), [timeout]),
    ]
    sent, received, lost = series.link_counts[-1].tolist()
    return Panel("Link", charts, f"{sent} packets sent, {received} received, {lost} lost.")


def _loop(series: Series) -> Panel:
    late = Trace("late by", series.time_s, 1e3 * series.lateness_s, "flown")
    charts = [Chart("Lateness of ticks", "ms", [late], _upwards(late.values, 1.0))]
    if series.missed.any():
        missed = Trace("missed", series.time_s, np.cumsum(series.missed).astype(np.float64), "d")
        charts.append(Chart("Missed ticks", "in all", [missed], _upwards(missed.values, 5.0)))
    return Panel("Loop", charts)


def _upwards(values: FloatArray | IntArray, least: float) -> Axis:
    """From zero to above the greatest value."""
    return Axis(0.0, max(least, 1.15 * float(np.nanmax(values, initial=0.0))))
