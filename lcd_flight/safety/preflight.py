"""Pre-flight checks: what must hold, over two seconds of ticks on the ground, before motors may turn."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean, pstdev

from lcd_flight.model import FlightPlan, RawPose, SafetyLimits, State, TickInputs
from lcd_flight.model.frames import angle_between, wrapped, yaw_of

WINDOW_S = 2.0
RATE_SHARES = (0.95, 1.05)
"""Of the expected pose rate."""
MAX_POSE_LATENCY_S = 0.01
"""Added to the period of the poses: at 100 Hz a pose may be 20 ms old."""
MAX_STILL_SIGMA_M = 0.001
MAX_HEADING_ERROR_RAD = math.radians(5.0)
MAX_ATTITUDE_ERROR_RAD = math.radians(5.0)


@dataclass(frozen=True, slots=True)
class Check:
    """One line of the pre-flight."""

    name: str
    ok: bool
    text: str
    """For a person: what was found and, where it failed, the limit and the remedy."""


def preflight(samples: Sequence[TickInputs], plan: FlightPlan, limits: SafetyLimits) -> tuple[Check, ...]:
    """All checks, passed or not.

    samples: the inputs of the ticks of the last `WINDOW_S` seconds, oldest first; at least two.
    """
    state = samples[-1].pose.state
    return (
        _pose_rate(samples, limits),
        _pose_age(samples, limits),
        _still(samples),
        _at_start(state, plan, limits),
        _heading(state, plan),
        _fence(plan, limits),
        _battery(samples, limits),
        _link(samples, limits),
        _vehicle(samples),
        _onboard_attitude(samples),
    )


def _pose_rate(samples: Sequence[TickInputs], limits: SafetyLimits) -> Check:
    first, last = samples[0], samples[-1]
    rate_hz = (_usable_frames(last) - _usable_frames(first)) / ((last.now_ns - first.now_ns) * 1e-9)
    low, high = (share * limits.expected_pose_rate_hz for share in RATE_SHARES)
    text = f"pose {rate_hz:.1f} Hz"
    remedy = f"{text}, not {low:.0f} to {high:.0f} Hz: set motion_capture.rate or the mocap system to the other's rate"
    return _check("pose rate", low <= rate_hz <= high, text, remedy)


def _usable_frames(sample: TickInputs) -> int:
    return sample.pose.received - sample.pose.rejected - sample.pose.late


def _pose_age(samples: Sequence[TickInputs], limits: SafetyLimits) -> Check:
    """The 95th percentile, so that one hiccup of a desktop computer refuses no flight."""
    ages_ns = sorted(s.pose.age_ns for s in samples if s.pose.age_ns is not None)
    if not ages_ns:
        return Check("pose age", False, "no pose: check motion_capture.endpoint and rigid_body, and that it is tracked")
    age_s = ages_ns[math.ceil(0.95 * len(ages_ns)) - 1] * 1e-9
    limit_s = 1.0 / limits.expected_pose_rate_hz + MAX_POSE_LATENCY_S
    text = f"age {age_s * 1e3:.0f} ms"
    remedy = f"pose {text} (95th percentile; limit {limit_s * 1e3:.0f} ms): look at network and mocap filters"
    return _check("pose age", age_s < limit_s, text, remedy)


def _still(samples: Sequence[TickInputs]) -> Check:
    frames = _distinct_frames(samples)
    if len(frames) < 2:
        return Check("still", False, "too few pose frames to see whether the vehicle stands still")
    sigma_m = max(pstdev(frame.p_WB[axis] for frame in frames) for axis in range(3))
    text = f"still to {sigma_m * 1e3:.2f} mm"
    remedy = f"{text} (limit {MAX_STILL_SIGMA_M * 1e3:.0f} mm): put the vehicle down, calibrate the cameras"
    return _check("still", sigma_m < MAX_STILL_SIGMA_M, text, remedy)


def _distinct_frames(samples: Sequence[TickInputs]) -> list[RawPose]:
    newest = {s.pose.raw.sequence: s.pose.raw for s in samples if s.pose.raw is not None}
    return list(newest.values())


def _at_start(state: State | None, plan: FlightPlan, limits: SafetyLimits) -> Check:
    if state is None:
        return Check("start", False, "no valid pose to compare with the start")
    distance_m, limit_m = math.dist(state.p_WB, plan.start_m), limits.initial_position_tolerance_m
    text = f"at start {distance_m:.2f} m"
    where, start = _point(state.p_WB), _point(plan.start_m)
    remedy = f"vehicle at {where}, {distance_m:.2f} m from the start {start} (limit {limit_m:g} m): carry it there"
    return _check("start", distance_m <= limit_m, text, remedy)


def _heading(state: State | None, plan: FlightPlan) -> Check:
    if state is None:
        return Check("heading", False, "no valid pose to compare with the heading at the start")
    heading_rad, start_rad = yaw_of(state.q_WB), plan.start_yaw_rad
    error_rad = abs(wrapped(heading_rad - start_rad))
    text = f"heading {math.degrees(error_rad):.1f} deg off"
    remedy = (
        f"vehicle heads {math.degrees(heading_rad):.0f} deg, the plan starts with {math.degrees(start_rad):.0f} deg "
        f"(limit {math.degrees(MAX_HEADING_ERROR_RAD):.0f} deg): turn it, or correct the rigid body's axes"
    )
    return _check("heading", error_rad <= MAX_HEADING_ERROR_RAD, text, remedy)


def _fence(plan: FlightPlan, limits: SafetyLimits) -> Check:
    clearance_m = limits.geofence.clearance_m(plan.start_m)
    remedy = f"the start {_point(plan.start_m)} is {-clearance_m:.2f} m outside safety.geofence"
    return _check("fence", clearance_m >= 0.0, "fence ok", remedy)


def _battery(samples: Sequence[TickInputs], limits: SafetyLimits) -> Check:
    telemetry = samples[-1].link.telemetry
    voltages = [t.battery_V for s in samples if (t := s.link.telemetry) is not None and t.battery_V is not None]
    if telemetry is None or not voltages:
        return Check("battery", False, "the vehicle has not reported its battery")
    voltage_V, limit_V = fmean(voltages), limits.battery_takeoff_V
    text = f"battery {voltage_V:.2f} V"
    remedy = f"{text}, below vehicle.battery.voltage_takeoff {limit_V:g} V: charge it"
    return _check("battery", voltage_V >= limit_V, text, remedy)


def _link(samples: Sequence[TickInputs], limits: SafetyLimits) -> Check:
    link = samples[-1].link
    if not link.connected or link.age_ns is None:
        return Check("link", False, "nothing heard from the vehicle: is it on, and in range?")
    age_s, limit_s = link.age_ns * 1e-9, limits.link_timeout_s
    remedy = f"newest packet from the vehicle {age_s * 1e3:.0f} ms old (limit {limit_s * 1e3:.0f} ms): check the link"
    return _check("link", age_s <= limit_s, f"link {age_s * 1e3:.0f} ms", remedy)


def _vehicle(samples: Sequence[TickInputs]) -> Check:
    telemetry = samples[-1].link.telemetry
    crashed = telemetry is not None and telemetry.crashed is True
    return _check("vehicle", not crashed, "vehicle ok", "the vehicle reports a crash or a lock: restart it")


def _onboard_attitude(samples: Sequence[TickInputs]) -> Check:
    telemetry, state = samples[-1].link.telemetry, samples[-1].pose.state
    if telemetry is None or telemetry.q_WB is None:
        return Check("estimator", True, "no onboard attitude to compare")
    if state is None:
        return Check("estimator", False, "no valid pose to compare the onboard attitude with")
    error_rad = angle_between(telemetry.q_WB, state.q_WB)
    text = f"estimator {math.degrees(error_rad):.1f} deg off"
    remedy = (
        f"onboard attitude and motion capture differ by {math.degrees(error_rad):.0f} deg "
        f"(limit {math.degrees(MAX_ATTITUDE_ERROR_RAD):.0f} deg): check motion_capture.frame and the rigid body's axes"
    )
    return _check("estimator", error_rad <= MAX_ATTITUDE_ERROR_RAD, text, remedy)


def _check(name: str, ok: bool, text: str, remedy: str) -> Check:
    return Check(name, ok, text if ok else remedy)


def _point(p_W: tuple[float, float, float]) -> str:
    return "({:.2f}, {:.2f}, {:.2f})".format(*p_W)
