"""The transmit gate: the last clamp before a link. Nothing gets past it that is not finite, level enough and fresh."""

from __future__ import annotations

import math
from dataclasses import dataclass

from lcd_flight.model import AttitudeThrust, Finding, Severity, Vehicle
from lcd_flight.model.frames import body_z_axis, multiply, normalized
from lcd_flight.model.types import Quaternion

MAX_AGE_NS = 50_000_000
"""A setpoint older than this is never sent."""
UNIT_TOLERANCE = 1e-3
"""How far from unit length an attitude may be before its correction is reported."""


@dataclass(frozen=True, slots=True)
class GateLimits:
    """What the gate clamps to."""

    thrust_N: float
    tilt_rad: float = math.radians(80.0)
    """Of the desired attitude; beyond it thrust no longer holds a vehicle up, whatever the plan says."""
    yaw_rate: float = 10.0
    """rad/s"""

    @staticmethod
    def of(vehicle: Vehicle) -> GateLimits:
        """The largest collective thrust that the onboard controller takes, else the rotors' own."""
        share = 1.0 if vehicle.onboard is None else vehicle.onboard.thrust_limit
        return GateLimits(share * vehicle.max_thrust_N)


def is_fresh(stamp_ns: int, now_ns: int) -> bool:
    """Whether a setpoint decided at `stamp_ns` may still be sent."""
    return now_ns - stamp_ns <= MAX_AGE_NS


def gate(
    setpoint: AttitudeThrust, limits: GateLimits, fallback: AttitudeThrust
) -> tuple[AttitudeThrust, tuple[Finding, ...]]:
    """The setpoint as it may be sent, and a finding for each thing that was changed.

    fallback: what is sent in place of a setpoint that is not finite or whose attitude is no rotation.
    """
    if not setpoint.is_finite() or sum(q * q for q in setpoint.q_WB) < 0.25:
        return fallback, (_changed("gate_invalid", "setpoint was not finite or no rotation: replaced by the fallback"),)
    thrust_N, thrust_finding = clamp_and_warn(setpoint.thrust_N, 0.0, limits.thrust_N, "thrust", "N")
    yaw_rate, yaw_finding = clamp_and_warn(setpoint.yaw_rate, -limits.yaw_rate, limits.yaw_rate, "yaw_rate", "rad/s")
    q_WB, unit_finding = _unit(setpoint.q_WB)
    q_WB, tilt_finding = _tilt_limited(q_WB, limits.tilt_rad)
    findings = tuple(f for f in (thrust_finding, yaw_finding, unit_finding, tilt_finding) if f is not None)
    return AttitudeThrust(thrust_N, q_WB, yaw_rate), findings


def clamp_and_warn(value: float, low: float, high: float, label: str, unit: str) -> tuple[float, Finding | None]:
    """`value` within [low, high], and a finding `gate_<label>` where that changed it."""
    if low <= value <= high:
        return value, None
    limit = low if value < low else high
    return limit, _changed(f"gate_{label}", f"{label} {value:.3g} {unit} clamped to {limit:.3g}", value, limit)


def _unit(q_WB: Quaternion) -> tuple[Quaternion, Finding | None]:
    length = math.sqrt(sum(q * q for q in q_WB))
    if abs(length - 1.0) <= UNIT_TOLERANCE:
        return normalized(q_WB), None
    return normalized(q_WB), _changed("gate_unit", f"attitude of length {length:.3f} scaled to 1", length, 1.0)


def _tilt_limited(q_WB: Quaternion, limit_rad: float) -> tuple[Quaternion, Finding | None]:
    """The attitude turned back towards level, about a horizontal axis, until its tilt is within the limit."""
    x, y, z = body_z_axis(q_WB)
    tilt_rad = math.acos(max(-1.0, min(1.0, z)))
    if tilt_rad <= limit_rad:
        return q_WB, None
    sine = math.hypot(x, y)
    axis = (y / sine, -x / sine) if sine > 1e-9 else (1.0, 0.0)
    half = 0.5 * (tilt_rad - limit_rad)
    back = (axis[0] * math.sin(half), axis[1] * math.sin(half), 0.0, math.cos(half))
    text = f"tilt {math.degrees(tilt_rad):.0f} deg clamped to {math.degrees(limit_rad):.0f} deg"
    return multiply(back, q_WB), _changed("gate_tilt", text, tilt_rad, limit_rad)


def _changed(code: str, message: str, value: float | None = None, limit: float | None = None) -> Finding:
    return Finding(code, Severity.WARN, f"transmit gate: {message}", value, limit)
