"""The monitors: one table of what is watched, against which limit, and what a breach asks for.

A monitor measures one number from the evidence of a tick. Beyond its limit for longer than its debounce time it
becomes a finding; what is not a number counts as beyond. What a severity leads to stands in `lcd_flight.flight.phases`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from lcd_flight.model import Finding, SafetyLimits, Severity
from lcd_flight.model.frames import tilt_of
from lcd_flight.safety.evidence import Evidence, SafetyMemory, Scope
from lcd_flight.safety.fence import stopping_margin_m

VEHICLE_CRASHED = "vehicle_crashed"
"""Code of the finding that is adopted rather than reacted to."""

TAKEN_OVER = "taken_over"
"""Code of the finding after which somebody else flies."""

_FEW_PACKETS_S = 0.5
"""A share of a handful of packets says nothing; by then there are some."""

Measure = Callable[[Evidence], "float | None"]


@dataclass(frozen=True, slots=True)
class Monitor:
    """One row of the table."""

    code: str
    reads: str
    """What it measures, for a person."""
    measure: Measure
    """None where there is nothing to judge."""
    limit: float
    severity: Severity
    message: str
    """`{value}` and `{limit}` are filled in, times `scale`; `{reason}` is the pose filter's, `{who}` the link's."""
    scale: float = 1.0
    below: bool = False
    """Whether the breach is below the limit instead of above."""
    debounce_s: float = 0.0
    scope: Scope = Scope.AIRBORNE

    def breached(self, value: float) -> bool:
        """Whether a measurement is beyond the limit; NaN is."""
        return not (value >= self.limit if self.below else value <= self.limit)

    def finding(self, value: float, evidence: Evidence) -> Finding:
        """The finding of a breach."""
        shown, limit = value * self.scale, self.limit * self.scale
        text = self.message.format(value=shown, limit=limit, reason=evidence.reject_reason, who=evidence.taken_over)
        return Finding(self.code, self.severity, text, value, self.limit)


def judge(
    table: tuple[Monitor, ...], evidence: Evidence, memory: SafetyMemory
) -> tuple[tuple[Finding, ...], SafetyMemory]:
    """All findings that hold in this tick, in the order of the table, and the memory for the next tick."""
    findings: list[Finding] = []
    since: list[int | None] = []
    for monitor, before_ns in zip(table, memory.since_ns or (None,) * len(table), strict=True):
        value = monitor.measure(evidence) if evidence.scope >= monitor.scope else None
        if value is None or not monitor.breached(value):
            since.append(None)
            continue
        began_ns = evidence.now_ns if before_ns is None else before_ns
        since.append(began_ns)
        if (evidence.now_ns - began_ns) * 1e-9 >= monitor.debounce_s:
            findings.append(monitor.finding(value, evidence))
    return tuple(findings), replace(memory, since_ns=tuple(since))


def monitors(limits: SafetyLimits) -> tuple[Monitor, ...]:
    """The table, with the limits of one mission filled in."""
    return (*_pose(limits), *_vehicle(limits), *_link(limits), *_tracking(limits), *_fence(limits), *_LOOP)


def _pose(limits: SafetyLimits) -> tuple[Monitor, ...]:
    lost = Severity.KILL if limits.on_mocap_lost == "cut" else Severity.DESCEND
    period_s, rate_hz = 1.0 / limits.expected_pose_rate_hz, 0.9 * limits.expected_pose_rate_hz
    late_s, coast_s = max(0.03, 2.0 * period_s), max(limits.pose_coast_s, 3.0 * period_s)
    gap = "pose gap {value:.0f} ms (limit {limit:.0f} ms)"
    age, armed = "time since the newest usable pose", Scope.ARMED
    return (
        Monitor("pose_late", age, _pose_gap_s, late_s, Severity.WARN, gap, 1e3, scope=armed),
        Monitor("pose_gap", age, _pose_gap_s, coast_s, Severity.BRAKE, gap, 1e3),
        Monitor("pose_lost", age, _pose_gap_s, limits.pose_timeout_s, lost, gap, 1e3, scope=armed),
        Monitor(
            "pose_rejected",
            "frames that the pose filter refused since the last tick",
            lambda e: float(e.rejected),
            0.0,
            Severity.WARN,
            "{value:.0f} pose frames rejected: {reason}",
            scope=armed,
        ),
        Monitor(
            "pose_rate",
            "usable frames in the last second",
            lambda e: e.pose_rate_hz,
            rate_hz,
            Severity.BRAKE,
            "pose rate {value:.0f} Hz (limit {limit:.0f} Hz)",
            below=True,
            debounce_s=1.0,
        ),
    )


def _vehicle(limits: SafetyLimits) -> tuple[Monitor, ...]:
    critical = Severity.LAND if limits.on_battery_critical == "land" else Severity.WARN
    battery = "battery {value:.2f} V (limit {limit:.2f} V)"
    reads, debounce_s = "battery voltage", limits.battery_debounce_s
    return (
        Monitor(
            VEHICLE_CRASHED,
            "the vehicle's own report",
            lambda e: None if e.telemetry is None or e.telemetry.crashed is None else float(e.telemetry.crashed),
            0.0,
            Severity.KILL,
            "the vehicle reports that it has crashed or is locked",
            scope=Scope.ALWAYS,
        ),
        Monitor(
            "tumbled",
            "tilt",
            lambda e: None if e.state is None else tilt_of(e.state.q_WB),
            math.radians(100.0),
            Severity.KILL,
            "tilt {value:.0f} deg for over half a second (limit {limit:.0f} deg)",
            scale=math.degrees(1.0),
            debounce_s=0.5,
        ),
        Monitor(
            "battery_low", reads, _battery_V, limits.battery_warning_V, Severity.WARN, battery,
            below=True, debounce_s=debounce_s, scope=Scope.ARMED,
        ),
        Monitor(
            "battery_critical", reads, _battery_V, limits.battery_critical_V, critical, battery,
            below=True, debounce_s=debounce_s, scope=Scope.ARMED,
        ),
    )  # fmt: skip


def _link(limits: SafetyLimits) -> tuple[Monitor, ...]:
    age, loss = "time since the vehicle's newest packet", "packets lost in the last second"
    silent = "nothing heard from the vehicle for {value:.0f} ms (limit {limit:.0f} ms)"
    lossy = "link loses {value:.0f} % of its packets (limit {limit:.0f} %)"
    closed = "the connection to the vehicle is closed"
    return (
        Monitor(
            "link_closed", "the link's own report", lambda e: float(e.disconnected), 0.0, Severity.LAND, closed,
            scope=Scope.ARMED,
        ),
        Monitor(
            TAKEN_OVER, "the link's own report", lambda e: float(bool(e.taken_over)), 0.0, Severity.LAND, "{who}",
            scope=Scope.ARMED,
        ),
        Monitor("link_age", age, _link_age_s, limits.link_timeout_s, Severity.BRAKE, silent, 1e3),
        Monitor("link_lost", age, _link_age_s, 1.0, Severity.LAND, silent, 1e3, scope=Scope.ARMED),
        Monitor("link_loss", loss, _loss_share, 0.10, Severity.WARN, lossy, 100.0, scope=Scope.ARMED),
        Monitor("link_loss_high", loss, _loss_share, 0.15, Severity.BRAKE, lossy, 100.0, debounce_s=_FEW_PACKETS_S),
        Monitor("link_loss_severe", loss, _loss_share, 0.25, Severity.LAND, lossy, 100.0, debounce_s=_FEW_PACKETS_S),
    )  # fmt: skip


def _tracking(limits: SafetyLimits) -> tuple[Monitor, ...]:
    error, text = "distance from the reference", "position error {value:.2f} m (limit {limit:.2f} m)"
    brake_m, land_m = limits.brake_position_error_m, limits.max_position_error_m
    invalid, failed = "control steps in a row that were not finite", "the controller failed {value:.0f} times in a row"
    return (
        Monitor("position_error", error, lambda e: e.position_error_m, brake_m, Severity.BRAKE, text),
        Monitor("position_lost", error, lambda e: e.position_error_m, land_m, Severity.LAND, text),
        Monitor(
            "saturation",
            "ticks of the last 0.5 s with a motor or the thrust at its limit, on legs whose plan leaves some to spare",
            lambda e: e.saturation_share,
            0.5,
            Severity.BRAKE,
            "motors saturated in {value:.0f} % of the last 0.5 s (limit {limit:.0f} %)",
            scale=100.0,
        ),
        Monitor("controller_failed", invalid, _invalid_commands, 2.0, Severity.BRAKE, failed),
        Monitor("controller_lost", invalid, _invalid_commands, 5.0, Severity.DESCEND, failed),
    )


def _fence(limits: SafetyLimits) -> tuple[Monitor, ...]:
    fence = limits.geofence
    return (
        Monitor(
            "fence_ahead",
            "how far outside the walls the vehicle would come to rest",
            lambda e: None if e.state is None else -stopping_margin_m(fence, e.state.p_WB, e.state.v_WB_W),
            0.0,
            Severity.BRAKE,
            "would come to rest {value:.2f} m outside the geofence",
        ),
        Monitor(
            "fence_left",
            "how far outside the walls the vehicle is",
            lambda e: None if e.state is None else -stopping_margin_m(fence, e.state.p_WB, (0.0, 0.0, 0.0)),
            0.0,
            Severity.LAND,
            "{value:.2f} m outside the geofence",
        ),
        Monitor(
            "fence_far",
            "how far outside the box the vehicle is, floor included",
            lambda e: None if e.state is None else -fence.clearance_m(e.state.p_WB),
            1.0,
            Severity.KILL,
            "{value:.2f} m outside the geofence (limit {limit:.1f} m)",
        ),
    )


_LOOP = (
    Monitor(
        "loop_late",
        "lateness of the tick against its deadline",
        lambda e: e.lateness_s,
        0.02,
        Severity.WARN,
        "tick {value:.0f} ms late (limit {limit:.0f} ms)",
        scale=1e3,
        scope=Scope.ARMED,
    ),
    Monitor(
        "loop_slow",
        "ticks skipped in the last second (10 % is a mean step of 11.1 ms)",
        lambda e: e.skipped_share,
        0.1,
        Severity.LAND,
        "{value:.0f} % of the ticks of the last second were skipped (limit {limit:.0f} %)",
        scale=100.0,
    ),
)


def _pose_gap_s(evidence: Evidence) -> float:
    return evidence.pose_gap_s


def _link_age_s(evidence: Evidence) -> float:
    return evidence.link_age_s


def _loss_share(evidence: Evidence) -> float:
    return evidence.loss_share


def _invalid_commands(evidence: Evidence) -> float:
    return float(evidence.invalid_commands)


def _battery_V(evidence: Evidence) -> float | None:
    return None if evidence.telemetry is None else evidence.telemetry.battery_V
