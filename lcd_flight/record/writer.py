"""Writes a flight as MCAP, so that a cut at any moment loses half a second of ticks and never the description."""

from __future__ import annotations

import contextlib
import importlib.metadata
import io
import os
from collections.abc import Iterable
from pathlib import Path
from typing import IO

from mcap.writer import CompressionType, Writer

from lcd_flight.model import MotorRequest, Phase, RefusedError, Tick, TickInputs
from lcd_flight.record import topics
from lcd_flight.record.display import Display, Shown
from lcd_flight.record.header import PROFILE, FlightHeader, attachments, metadata
from lcd_flight.record.paths import give_name, unnamed
from lcd_flight.record.topics import TOPICS, Topic
from lcd_flight.wire import json_records

CHUNK_BYTES = 64 * 1024
"""Larger chunks stall whoever fills them up by milliseconds."""

FLUSH_EACH_NS = 500_000_000
"""In the ticks' own time, so that equal ticks make equal chunks."""

_GIVEN_UP = frozenset({Phase.LAND_NOW, Phase.DESCEND_BLIND, Phase.HANDED_OVER, Phase.KILL, Phase.CRASHED})
_AT_THE_END = frozenset({MotorRequest.DISARM, MotorRequest.STOP})


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
        self._display = Display(flight.plan, flight.vehicle, flight.limits)
        self._turn = (False, False)
        self._path = target if isinstance(target, Path) else None
        try:
            self._stream = unnamed(target).open("wb") if isinstance(target, Path) else target
        except OSError as error:
            raise _refusal(target, error) from error
        self._mcap = Writer(self._stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._channels = {topic.name: self._register(topic) for topic in TOPICS}
        try:
            self._describe()
        except OSError as error:
            self._abandon()
            raise _refusal(target, error) from error

    def write(self, inputs: TickInputs, tick: Tick) -> None:
        """Write one tick.

        Raises:
            OSError: the disk would not take it; what was flushed before stays readable.
        """
        now_ns = tick.now_ns
        if self._flushed_ns is None:
            self._flushed_ns = now_ns
            # At the first tick, so that a viewer's time line begins there.
            self._show(self._display.surroundings(now_ns), tick)
        self._add(topics.TICK_INPUTS, json_records.encode(inputs), tick)
        self._add(topics.TICK, json_records.encode(tick), tick)
        self._show(self._display.tick(inputs, tick), tick)
        if self._turns(tick):
            self.sync()
        elif now_ns - self._flushed_ns >= FLUSH_EACH_NS:
            self._mcap.flush()  # type: ignore[no-untyped-call]
            self._flushed_ns = now_ns

    def _turns(self, tick: Tick) -> bool:
        """Whether this tick ends the flight or gives it up: what led to it must outlast what comes next."""
        before, self._turn = self._turn, (tick.phase in _GIVEN_UP, tick.motors in _AT_THE_END)
        return any(now and not earlier for now, earlier in zip(self._turn, before, strict=True))

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
            if self._path is not None:
                self._stream.close()

    def _abandon(self) -> None:
        """Leave nothing behind of a log that could not be begun."""
        if self._path is not None:
            with contextlib.suppress(OSError):
                self._stream.close()
            with contextlib.suppress(OSError):
                unnamed(self._path).unlink(missing_ok=True)

    def _describe(self) -> None:
        """Put all that is known before the flight on the disk."""
        version = importlib.metadata.version("lcd-flight")
        self._mcap.start(profile=PROFILE, library=f"lcd-flight {version}")
        for name, values in metadata(self._flight).items():
            self._mcap.add_metadata(name, values)
        for name, (media_type, data) in attachments(self._flight).items():
            self._mcap.add_attachment(create_time=0, log_time=0, name=name, media_type=media_type, data=data)
        self.sync()
        if self._path is not None:
            give_name(self._path)

    def _register(self, topic: Topic) -> int:
        schema_id = self._mcap.register_schema(topic.schema_name, topic.schema_encoding, topic.schema_data())
        about = {"rate": topic.rate, "units": topic.units}
        return self._mcap.register_channel(topic.name, topic.encoding, schema_id, about)

    def _show(self, messages: Iterable[Shown], tick: Tick) -> None:
        for topic, message, publish_ns in messages:
            self._add(topic, message.SerializeToString(), tick, publish_ns)

    def _add(self, topic: Topic, data: bytes, tick: Tick, publish_ns: int | None = None) -> None:
        self._mcap.add_message(
            channel_id=self._channels[topic.name],
            log_time=tick.now_ns,
            data=data,
            publish_time=tick.now_ns if publish_ns is None else publish_ns,
            sequence=tick.sequence,
        )


def _refusal(target: Path | IO[bytes], error: OSError) -> RefusedError:
    return RefusedError(f"cannot write the flight log {target}: {error.strerror}")
