"""What viewers are shown of a flight, tick by tick: for the log, and for viewers that watch it live."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from google.protobuf.message import Message

from lcd_flight.model import Finding, FlightPlan, Phase, SafetyLimits, Tick, TickInputs, Vehicle
from lcd_flight.record import scene, topics, viewer
from lcd_flight.record.topics import Topic

_LAST_STAMP_NS = 2**64 - 1
"""MCAP's stamps are unsigned; a source's clock may be anything."""


class Shown(NamedTuple):
    """One message for viewers."""

    topic: Topic
    message: Message
    publish_ns: int
    """The source's own stamp where there is one, else the tick's."""


class Display:
    """Remembers what was shown already, so that words come once."""

    def __init__(self, plan: FlightPlan, vehicle: Vehicle, limits: SafetyLimits) -> None:
        self._plan, self._vehicle, self._limits = plan, vehicle, limits
        self._phase: Phase | None = None
        self._findings: frozenset[str] = frozenset()

    def surroundings(self, now_ns: int) -> Iterator[Shown]:
        """What stands still."""
        yield Shown(topics.PLAN, viewer.path_poses(now_ns, self._plan.joined()), now_ns)
        around = scene.flight_scene(now_ns, self._plan, self._vehicle, self._limits.geofence)
        yield Shown(topics.SCENE, around, now_ns)

    def tick(self, inputs: TickInputs, tick: Tick) -> Iterator[Shown]:
        """What moves, and what is new in words: the phase, findings as they begin, and what the vehicle says."""
        now_ns, state, raw = tick.now_ns, inputs.pose.state, inputs.pose.raw
        if state is not None:
            stamp_ns = now_ns if raw is None else min(max(raw.source_stamp_ns, 0), _LAST_STAMP_NS)
            yield Shown(topics.TRANSFORMS, viewer.transforms(now_ns, state), now_ns)
            yield Shown(topics.POSE, viewer.vehicle_pose(now_ns, state), stamp_ns)
        if tick.reference is not None:
            yield Shown(topics.REFERENCE, viewer.reference_pose(now_ns, tick.reference), now_ns)
        if tick.phase is not self._phase:
            self._phase = tick.phase
            yield Shown(topics.LOG, viewer.text_line(now_ns, "phase", tick.phase.value), now_ns)
        for finding in self._begun(tick.findings):
            yield Shown(topics.LOG, viewer.finding_line(now_ns, finding), now_ns)
        telemetry = inputs.link.telemetry
        for text in telemetry.messages if telemetry is not None else ():
            yield Shown(topics.LOG, viewer.text_line(now_ns, "vehicle", text), now_ns)

    def _begun(self, findings: tuple[Finding, ...]) -> list[Finding]:
        """Those that the tick before did not have."""
        before, self._findings = self._findings, frozenset(finding.code for finding in findings)
        return [finding for finding in findings if finding.code not in before]
