"""What a flight tells whoever watches: connected, checked, and how it goes, ten times a second."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lcd_flight.flight.setup import FlightSetup
from lcd_flight.model import Finding, LegKind, Phase, Severity, Tick, TickInputs
from lcd_flight.safety.preflight import Check

REPORT_NS = 100_000_000
QUIET_NS = 1_000_000_000
"""A finding that comes and goes is told once in this time."""
MAX_MESSAGES = 10
"""All of them are in the log."""


@dataclass(frozen=True, slots=True)
class Connected:
    """The link is up."""

    uri: str
    description: str
    """Of the vehicle, in the link's words."""


@dataclass(frozen=True, slots=True)
class Checked:
    """The pre-flight is done."""

    checks: tuple[Check, ...]

    @property
    def ok(self) -> bool:
        """Whether all of it passed."""
        return all(check.ok for check in self.checks)


@dataclass(frozen=True, slots=True)
class ByHand:
    """The check by hand goes on."""

    checks: tuple[Check, ...]
    """Of the motions that were made."""
    request: str
    """What the operator is to do next; empty when nothing is left."""


@dataclass(frozen=True, slots=True)
class Flying:
    """How it stands."""

    phase: Phase
    entered: bool
    """Whether the phase or the leg began since the last report."""
    time_s: float
    """Since take-off; 0 before."""
    kind: LegKind | None
    leg: int
    legs: int
    leg_time_s: float
    leg_duration_s: float
    waypoint: int
    """How many of the leg's waypoints have been passed."""
    waypoints: int
    """0 for legs without."""
    error_m: float | None
    max_error_m: float
    """Since take-off."""
    thrust_share: float | None
    """Of the largest collective thrust that may be asked for."""
    battery_V: float | None
    rate_hz: float
    """Ticks in the time since the last report."""
    findings: tuple[Finding, ...]
    """Warnings and worse that began since the last report."""
    messages: tuple[str, ...] = ()
    """What the vehicle and its link said since the last report; the first `MAX_MESSAGES` of a tick."""


Progress = Callable[[Connected | Checked | ByHand | Flying], None]


class Reporter:
    """The observer behind `Flying`: reports each change of phase or leg, each new finding or message, and at 10 Hz."""

    def __init__(self, setup: FlightSetup, progress: Progress) -> None:
        self._setup, self._progress = setup, progress
        self._where: tuple[Phase, int] | None = None
        """Phase and leg of the last report."""
        self._takeoff_ns: int | None = None
        self._max_error_m = 0.0
        self._reported_ns: int | None = None
        self._ticks = 0
        self._told_ns: dict[str, int] = {}

    def observe(self, inputs: TickInputs, tick: Tick) -> None:
        """Take note of one tick."""
        self._ticks += 1
        if self._takeoff_ns is None and tick.phase.airborne:
            self._takeoff_ns = tick.now_ns
        if tick.position_error_W is not None and tick.phase.airborne:
            self._max_error_m = max(self._max_error_m, math.hypot(*tick.position_error_W))
        entered = (tick.phase, tick.leg) != self._where
        findings = self._new_findings(tick)
        telemetry = inputs.link.telemetry
        messages = () if telemetry is None else telemetry.messages[:MAX_MESSAGES]
        due = self._reported_ns is None or tick.now_ns - self._reported_ns >= REPORT_NS
        if entered or findings or messages or due:
            self._progress(self._report(inputs, tick, entered, findings, messages))
            self._where, self._reported_ns, self._ticks = (tick.phase, tick.leg), tick.now_ns, 0

    def close(self) -> None:
        """Nothing is held."""

    def _new_findings(self, decided: Tick) -> tuple[Finding, ...]:
        """Warnings and worse that were not told in the last second."""
        told = [f for f in decided.findings if f.severity >= Severity.WARN]
        new = tuple(f for f in told if decided.now_ns - self._told_ns.get(f.code, -QUIET_NS) >= QUIET_NS)
        for finding in told:
            self._told_ns[finding.code] = decided.now_ns
        return new

    def _report(
        self, inputs: TickInputs, decided: Tick, entered: bool, findings: tuple[Finding, ...], messages: tuple[str, ...]
    ) -> Flying:
        legs, now_ns = self._setup.plan.legs, decided.now_ns
        leg = legs[decided.leg] if decided.leg >= 0 else None
        knots = None if leg is None or leg.waypoints is None else leg.trajectory.knot_times_s
        since_ns = 0 if self._reported_ns is None else now_ns - self._reported_ns
        telemetry, error_W = inputs.link.telemetry, decided.position_error_W
        return Flying(
            phase=decided.phase,
            entered=entered,
            time_s=0.0 if self._takeoff_ns is None else (now_ns - self._takeoff_ns) * 1e-9,
            kind=None if leg is None else leg.kind,
            leg=decided.leg,
            legs=len(legs),
            leg_time_s=decided.leg_time_s,
            leg_duration_s=0.0 if leg is None else leg.duration_s,
            waypoint=0 if knots is None else int(np.searchsorted(knots, decided.leg_time_s, side="right")),
            waypoints=0 if knots is None else len(knots),
            error_m=None if error_W is None else math.hypot(*error_W),
            max_error_m=self._max_error_m,
            thrust_share=None if decided.setpoint is None else decided.setpoint.thrust_N / self._setup.gate.thrust_N,
            battery_V=None if telemetry is None else telemetry.battery_V,
            rate_hz=self._ticks * 1e9 / since_ns if since_ns > 0 else 0.0,
            findings=findings,
            messages=messages,
        )
