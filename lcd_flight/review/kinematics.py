"""Angles and rates that a log implies: attitudes in degrees, the reference's body rates, how late attitude follows."""

from __future__ import annotations

import numpy as np

from lcd_flight.model import GRAVITY_M_PER_S2
from lcd_flight.model.types import BoolArray, FloatArray
from lcd_flight.record import Series
from lcd_flight.review.spans import airborne

_LONGEST_LAG_S = 0.3
_LEAST_SWING_RAD = np.radians(2.0)
"""Below this standard deviation of the setpoint's thrust direction there is nothing to measure a lag by."""


def euler_deg(q: FloatArray) -> FloatArray:
    """(T, 3) roll, pitch and yaw (unwrapped) in degrees from (T, 4) attitudes; turned about z, then y, then x."""
    x, y, z, w = q.T
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    known = np.isfinite(yaw)
    yaw[known] = np.unwrap(yaw[known])
    return np.asarray(np.degrees(np.stack([roll, pitch, yaw], axis=1)))


def yaw_rad(q: FloatArray) -> FloatArray:
    """(T,) heading from (T, 4) attitudes."""
    x, y, z, w = q.T
    return np.asarray(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def body_z(q: FloatArray) -> FloatArray:
    """(T, 3) direction of thrust in the world from (T, 4) attitudes."""
    x, y, z, w = q.T
    return np.stack([2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)], axis=1)


def tilt_rad(q: FloatArray) -> FloatArray:
    """(T,) angle between the body's z axis and the vertical, from (T, 4) attitudes."""
    return np.asarray(np.arccos(np.clip(body_z(q)[:, 2], -1.0, 1.0)))


def attitude_error_rad(series: Series) -> FloatArray:
    """(T,) angle of the rotation from the setpoint's attitude to the flown one."""
    dot = np.abs(np.sum(series.q_WB * series.setpoint_q_WB, axis=1))
    return np.asarray(2.0 * np.arccos(np.minimum(dot, 1.0)))


def thrust_direction_error_rad(series: Series) -> FloatArray:
    """(T,) angle between the direction of thrust that was asked for and the flown one: without the heading."""
    cosine = np.sum(body_z(series.q_WB) * body_z(series.setpoint_q_WB), axis=1)
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def reference_rates(series: Series) -> FloatArray:
    """(T, 3) rad/s, body: the rates at which a vehicle turns that follows the reference exactly, without drag.

    Differential flatness (Mellinger and Kumar 2011): the thrust direction b3 is that of a + g e3, its derivative gives
    the rates about b1 and b2; b2 stays at right angles to the heading, which gives the rate about b3.
    """
    force = series.reference_a_W + np.array([0.0, 0.0, GRAVITY_M_PER_S2])
    with np.errstate(invalid="ignore", divide="ignore"):
        size = np.linalg.norm(force, axis=1, keepdims=True)
        b3 = force / size
        yaw = series.reference_yaw_rad
        heading = np.stack([np.cos(yaw), np.sin(yaw), 0.0 * yaw], axis=1)
        across = np.stack([-np.sin(yaw), np.cos(yaw), 0.0 * yaw], axis=1)
        b2 = np.cross(b3, heading)
        b2 /= np.linalg.norm(b2, axis=1, keepdims=True)
        b1 = np.cross(b2, b3)
        jerk = series.reference_j_W
        turning = (jerk - np.sum(b3 * jerk, axis=1, keepdims=True) * b3) / size
        p, q = -np.sum(turning * b2, axis=1), np.sum(turning * b1, axis=1)
        known = p * np.sum(b3 * heading, axis=1) + series.reference_yaw_rate * np.sum(b2 * across, axis=1)
        rates = np.stack([p, q, known / np.sum(b1 * heading, axis=1)], axis=1)
    rates[~np.isfinite(rates)] = np.nan
    return rates


def attitude_lag_s(series: Series) -> float | None:
    """By how much the thrust direction follows its setpoint late: the shift at which the two differ least, in flight.

    None where the setpoint hardly moved or the flight was too short to say. Resolved to a fraction of a tick by a
    parabola through the three best shifts.
    """
    flying = airborne(series)
    asked, flown = body_z(series.setpoint_q_WB), body_z(series.q_WB)
    usable = flying & np.isfinite(asked).all(axis=1) & np.isfinite(flown).all(axis=1)
    tick_s = float(np.median(np.diff(series.time_s))) if len(series) > 1 else 0.0
    shifts = round(_LONGEST_LAG_S / tick_s) if tick_s > 0.0 else 0
    if np.count_nonzero(usable) < 4 * max(shifts, 1) or np.std(asked[usable], axis=0).max() < _LEAST_SWING_RAD:
        return None
    differences = np.array([_difference(asked, flown, usable, shift) for shift in range(shifts + 1)])
    return float(_vertex(differences)) * tick_s


def _difference(asked: FloatArray, flown: FloatArray, usable: BoolArray, shift: int) -> float:
    """Mean square distance between the flown direction and the one asked for `shift` ticks before."""
    end = len(asked) - shift
    both = usable[:end] & usable[shift:]
    return float(np.mean(np.sum((flown[shift:][both] - asked[:end][both]) ** 2, axis=1)))


def _vertex(values: FloatArray) -> float:
    """Place of the least value, between the samples."""
    best = int(np.argmin(values))
    if not 0 < best < len(values) - 1:
        return float(best)
    before, at, after = values[best - 1 : best + 2].tolist()
    bend = before - 2.0 * at + after
    return best + (0.5 * (before - after) / bend if bend > 0.0 else 0.0)
