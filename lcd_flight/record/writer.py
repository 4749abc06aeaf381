"""Writes a flight as MCAP, so that a cut at any moment loses half a second of ticks and never the description."""

from __future__ import annotations

import contextlib
import importlib.metadata
import io
import os
from pathlib import Path
from typing import IO

from google.protobuf.message import Message
from mcap.writer import CompressionType, Writer

from lcd_flight.model import Finding, MotorRequest, Phase, RefusedError, Tick, TickInputs
from lcd_flight.record import scene, topics, viewer
from lcd_flight.record.header import PROFILE, FlightHeader, attachments, metadata
from lcd_flight.record.topics import TOPICS, Topic
from lcd_flight.wire import json_records

CHUNK_BYTES = 64 * 1024
"""Larger chunks stall whoever fills them up by milliseconds."""

FLUSH_EACH_NS = 500_000_000
"""In the ticks' own time, so that equal ticks make equal chunks."""

_LAST_STAMP_NS = 2**64 - 1
"""MCAP's stamps are unsigned; a source's clock may be anything."""


class LogWriter:
    """Writes one log. It may wait for the disk: a flight writes through `lcd_flight.observers.log_thread`.

    Messages depend on the ticks and on the header's plan, vehicle and fence alone: equal flights, equal bytes. What
    depends on the day and the machine stands in metadata.
    """

    def __init__(self, target: Path | IO[bytes], flight: FlightHeader) -> None:
        """Write and flush the flight's description.

        target: a path where nothing stands yet, or a binary stream, which is left open.

        Raises:
            RefusedError: it cannot be written.
        """
        self._flight = flight
        self._flushed_ns: int | None = None
        self._phase: Phase | None = None
        self._findings: frozenset[str] = frozenset()
        self._owned = isinstance(target, Path)
        try:
            self._stream = target.open("xb") if isinstance(target, Path) else target
        except OSError as error:
            raise RefusedError(f"cannot write the flight log {target}: {error.strerror}") from error
        self._mcap = Writer(self._stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._channels = {topic.name: self._register(topic) for topic in TOPICS}
        try:
            self._describe()
        except OSError as error:
            with contextlib.suppress(OSError):
                self._let_go()
            raise RefusedError(f"cannot write the flight log {target}: {error.strerror}") from error

    def write(self, inputs: TickInputs, tick: Tick) -> None:
        """Write one tick.

        Raises:
            OSError: the disk would not take it; what was flushed before stays readable.
        """
        now_ns = tick.now_ns
        if self._flushed_ns is None:
            self._flushed_ns = now_ns
            self._set_scene(tick)
        self._add(topics.TICK_INPUTS, json_records.encode(inputs), tick)
        self._add(topics.TICK, json_records.encode(tick), tick)
        self._draw(inputs, tick)
        self._tell(inputs, tick)
        if tick.motors in (MotorRequest.DISARM, MotorRequest.STOP):
            self.sync()
        elif now_ns - self._flushed_ns >= FLUSH_EACH_NS:
            self._mcap.flush()  # type: ignore[no-untyped-call]
            self._flushed_ns = now_ns

    def sync(self) -> None:
        """Flush, and wait until the disk itself has everything; a stream that is no file is flushed only.

        Raises:
            OSError: the disk would not take it.
        """
        self._mcap.flush()  # type: ignore[no-untyped-call]
        with contextlib.suppress(io.UnsupportedOperation):
            os.fsync(self._stream.fileno())

    def close(self) -> None:
        """Write the index, wait for the disk and close.

        Raises:
            OSError: the disk would not take it; what was flushed before stays readable.
        """
        try:
            self._mcap.finish()  # type: ignore[no-untyped-call]
            self.sync()
        finally:
            self._let_go()

    def _let_go(self) -> None:
        if self._owned:
            self._stream.close()

    def _describe(self) -> None:
        """Put all that is known before the flight on the disk."""
        version = importlib.metadata.version("lcd-flight")
        self._mcap.start(profile=PROFILE, library=f"lcd-flight {version}")
        for name, values in metadata(self._flight).items():
            self._mcap.add_metadata(name, values)
        for name, (media_type, data) in attachments(self._flight).items():
            self._mcap.add_attachment(create_time=0, log_time=0, name=name, media_type=media_type, data=data)
        self.sync()

    def _register(self, topic: Topic) -> int:
        schema_id = self._mcap.register_schema(topic.schema_name, topic.schema_encoding, topic.schema_data())
        about = {"rate": topic.rate, "units": topic.units}
        return self._mcap.register_channel(topic.name, topic.encoding, schema_id, about)

    def _set_scene(self, tick: Tick) -> None:
        """What stands still; at the first tick, so that a viewer's time line begins there."""
        flight = self._flight
        self._add_message(topics.PLAN, viewer.path_poses(tick.now_ns, flight.plan.joined()), tick)
        around = scene.flight_scene(tick.now_ns, flight.plan, flight.vehicle, flight.limits.geofence)
        self._add_message(topics.SCENE, around, tick)

    def _draw(self, inputs: TickInputs, tick: Tick) -> None:
        """What moves."""
        now_ns, state, raw = tick.now_ns, inputs.pose.state, inputs.pose.raw
        if state is not None:
            stamp_ns = now_ns if raw is None else min(max(raw.source_stamp_ns, 0), _LAST_STAMP_NS)
            self._add_message(topics.TRANSFORMS, viewer.transforms(now_ns, state), tick)
            self._add_message(topics.POSE, viewer.vehicle_pose(now_ns, state), tick, stamp_ns)
        if tick.reference is not None:
            self._add_message(topics.REFERENCE, viewer.reference_pose(now_ns, tick.reference), tick)

    def _tell(self, inputs: TickInputs, tick: Tick) -> None:
        """What is new in words: the phase, findings as they begin, and what the vehicle says."""
        if tick.phase is not self._phase:
            self._phase = tick.phase
            self._add_message(topics.LOG, viewer.text_line(tick.now_ns, "phase", tick.phase.value), tick)
        for finding in self._begun(tick.findings):
            self._add_message(topics.LOG, viewer.finding_line(tick.now_ns, finding), tick)
        telemetry = inputs.link.telemetry
        for text in telemetry.messages if telemetry is not None else ():
            self._add_message(topics.LOG, viewer.text_line(tick.now_ns, "vehicle", text), tick)

    def _begun(self, findings: tuple[Finding, ...]) -> list[Finding]:
        """Those that the tick before did not have."""
        before, self._findings = self._findings, frozenset(finding.code for finding in findings)
        return [finding for finding in findings if finding.code not in before]

    def _add_message(self, topic: Topic, message: Message, tick: Tick, publish_ns: int | None = None) -> None:
        self._add(topic, message.SerializeToString(), tick, publish_ns)

    def _add(self, topic: Topic, data: bytes, tick: Tick, publish_ns: int | None = None) -> None:
        self._mcap.add_message(
            channel_id=self._channels[topic.name],
            log_time=tick.now_ns,
            data=data,
            publish_time=tick.now_ns if publish_ns is None else publish_ns,
            sequence=tick.sequence,
        )
