"""What a finished plan asks of the vehicle at its worst: speed, tilt, thrust, body rates; and the limits on them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lcd_flight.model import GRAVITY_M_PER_S2, Finding, FloatArray, Severity, Trajectory, Vehicle

_SAMPLES = 64
"""Instants in each segment; around the highest the same number again, twice: peaks are right to about 1e-6."""


@dataclass(frozen=True, slots=True)
class Peak:
    """The largest value of something along a trajectory."""

    value: float
    time_s: float
    """When, from the start of the trajectory."""
    segment: int
    """In which segment, from 0."""


@dataclass(frozen=True, slots=True)
class Peaks:
    """The worst moments of a trajectory, flown exactly."""

    speed: Peak
    """m/s"""
    tilt: Peak
    """rad, angle of the thrust from the vertical."""
    thrust_ratio: Peak
    """m |a + g e3| over the vehicle's static thrust; drag is left out."""
    body_rate: Peak
    """rad/s, roll and pitch together: how fast the thrust turns."""


@dataclass(frozen=True, slots=True)
class PlanLimits:
    """What a plan may ask for; None: no limit."""

    max_velocity: float | None = None
    """m/s"""
    max_thrust_ratio: float | None = None
    """Of the vehicle's static thrust."""
    max_tilt_rad: float | None = None
    max_body_rate: float | None = None
    """rad/s, roll and pitch together."""


def peaks(trajectory: Trajectory, vehicle: Vehicle) -> Peaks:
    """The largest speed, tilt, thrust ratio and body rate of `trajectory` flown by `vehicle`."""
    return Peaks(
        speed=_peak(trajectory, _speed),
        tilt=_peak(trajectory, _tilt),
        thrust_ratio=_peak(trajectory, lambda t, at: vehicle.mass_kg * _force(t, at) / vehicle.max_thrust_N),
        body_rate=_peak(trajectory, _body_rate),
    )


def check_limits(found: Peaks, limits: PlanLimits) -> tuple[Finding, ...]:
    """One finding for each limit that `found` is above; empty when the plan keeps them all."""
    rows = (
        ("plan_speed", "speed", "m/s", 1.0, found.speed, limits.max_velocity),
        ("plan_tilt", "tilt", "deg", np.degrees(1.0), found.tilt, limits.max_tilt_rad),
        ("plan_thrust", "thrust", "% of full thrust", 100.0, found.thrust_ratio, limits.max_thrust_ratio),
        ("plan_rate", "body rate", "deg/s", np.degrees(1.0), found.body_rate, limits.max_body_rate),
    )
    return tuple(
        Finding(
            code,
            Severity.WARN,
            f"planned {what} {peak.value * scale:.3g} {unit} at {peak.time_s:.2f} s, between waypoints "
            f"{peak.segment + 1} and {peak.segment + 2} (limit {limit * scale:.3g})",
            peak.value,
            limit,
        )
        for code, what, unit, scale, peak, limit in rows
        if limit is not None and peak.value > limit
    )


def _peak(trajectory: Trajectory, measure: Callable[[Trajectory, FloatArray], FloatArray]) -> Peak:
    """Sample every segment, then more and more finely around the highest sample."""
    knots = trajectory.knot_times_s
    shares = np.linspace(0.0, 1.0, _SAMPLES + 1)
    times = (knots[:-1, None] + trajectory.durations_s[:, None] * shares).ravel()
    step = float(trajectory.durations_s.max()) / _SAMPLES
    for _ in range(3):
        values = measure(trajectory, times)
        best = int(np.argmax(values))
        value, time = float(values[best]), float(times[best])
        times = np.clip(np.linspace(time - step, time + step, 2 * _SAMPLES + 1), 0.0, knots[-1])
        step /= _SAMPLES
    segment = int(np.clip(np.searchsorted(knots, time, side="right") - 1, 0, trajectory.segments - 1))
    return Peak(value, time, segment)


def _speed(trajectory: Trajectory, times_s: FloatArray) -> FloatArray:
    """(T,) m/s."""
    return np.asarray(np.linalg.norm(trajectory.derivative(times_s, 1)[:, :3], axis=1))


def _specific_force(trajectory: Trajectory, times_s: FloatArray) -> FloatArray:
    """(T, 3) a + g e3 in m/s^2."""
    return np.asarray(trajectory.derivative(times_s, 2)[:, :3] + np.array([0.0, 0.0, GRAVITY_M_PER_S2]))


def _force(trajectory: Trajectory, times_s: FloatArray) -> FloatArray:
    """(T,) |a + g e3| in m/s^2."""
    return np.asarray(np.linalg.norm(_specific_force(trajectory, times_s), axis=1))


def _body_rate(trajectory: Trajectory, times_s: FloatArray) -> FloatArray:
    """(T,) rad/s across the thrust: |j x F| / |F|^2; without a thrust to turn, infinite or none."""
    force = _specific_force(trajectory, times_s)
    turning = np.linalg.norm(np.cross(trajectory.derivative(times_s, 3)[:, :3], force), axis=1)
    return np.asarray(turning / np.maximum((force**2).sum(axis=1), np.finfo(float).tiny))


def _tilt(trajectory: Trajectory, times_s: FloatArray) -> FloatArray:
    """(T,) rad."""
    force = _specific_force(trajectory, times_s)
    return np.asarray(np.arctan2(np.hypot(force[:, 0], force[:, 1]), force[:, 2]))
