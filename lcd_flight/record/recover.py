"""Makes an indexed file of one that was cut or damaged, and says what was lost. The old file is never touched."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from mcap.records import Attachment, Channel, Header, Message, Metadata, Schema
from mcap.writer import CompressionType, Writer

from lcd_flight.model import InputError, RefusedError
from lcd_flight.record.container import Advance, Cut, LostChunk, Record, records, unwatched
from lcd_flight.record.header import RECOVERED
from lcd_flight.record.reader import opened, read_header
from lcd_flight.record.topics import TICK, TICK_INPUTS
from lcd_flight.record.writer import CHUNK_BYTES


@dataclass(frozen=True, slots=True)
class Condition:
    """What of a flight a file still holds."""

    ticks: int
    duration_s: float
    """From the first tick to the last."""
    missing_ticks: int
    """Whose numbers are missing in between: there was no room to log them, or they stood in a damaged chunk."""
    lost_chunks: int
    """Whose content was altered."""
    cut: bool
    """Whether the file ends within a record or before its end mark."""

    @property
    def whole(self) -> bool:
        """Whether there is nothing to recover; ticks that were never written cannot be."""
        return not self.cut and not self.lost_chunks

    @property
    def lost(self) -> str:
        """For a person: what is no longer there."""
        parts = ["what was flown after its last whole record"] if self.cut else []
        if self.lost_chunks:
            parts.append(f"{self.lost_chunks} damaged chunk{'s' if self.lost_chunks > 1 else ''}")
        if self.missing_ticks:
            parts.append(f"{self.missing_ticks} ticks in between")
        return ", ".join(parts) or "nothing"


def condition(path: Path) -> Condition:
    """Read a log through and see what it holds.

    Raises:
        InputError: it is no flight log, or its description is lost.
    """
    read_header(path)
    topics: dict[int, str] = {}
    stamps: dict[str, dict[int, int]] = {TICK.name: {}, TICK_INPUTS.name: {}}
    lost_chunks, cut = 0, False
    with opened(path) as stream:
        for record in records(stream):
            match record:
                case Message() if topics.get(record.channel_id) in stamps:
                    stamps[topics[record.channel_id]][record.sequence] = record.log_time
                case Channel():
                    topics[record.id] = record.topic
                case LostChunk():
                    lost_chunks += 1
                case Cut():
                    cut = True
    # A chunk may end between what a tick knew and what it decided.
    ticks = [(n, stamp_ns) for n, stamp_ns in stamps[TICK.name].items() if n in stamps[TICK_INPUTS.name]]
    if not ticks:
        return Condition(0, 0.0, 0, lost_chunks, cut)
    (first, first_ns), (last, last_ns) = ticks[0], ticks[-1]
    return Condition(len(ticks), (last_ns - first_ns) * 1e-9, last - first + 1 - len(ticks), lost_chunks, cut)


def recover(path: Path, target: Path, lost: str, advance: Advance = unwatched) -> None:
    """Write all that can be read of a log into a new file, indexed; `target` appears once it is whole.

    advance: told the bytes that were read.
    lost: goes into the new file's metadata, by which readers know that the flight's end may be missing.

    Raises:
        InputError: it is no flight log, or its description is lost; `target` exists already.
        RefusedError: `target` cannot be written.
    """
    read_header(path)
    if target.exists():
        raise InputError(f"{target}: exists already; remove it or choose another name with --out")
    try:
        with _appearing_whole(target) as stream, opened(path) as source:
            copy = _Copy(stream)
            for record in records(source, advance):
                copy.take(record)
            copy.finish({"from": path.name, "lost": lost})
    except OSError as error:
        raise RefusedError(f"{target}: cannot be written: {error.strerror}; choose another place with --out") from error


@contextmanager
def _appearing_whole(target: Path) -> Iterator[IO[bytes]]:
    """A file that gets its name once it is on the disk; after an error or Ctrl-C there is none."""
    temporary = target.with_name(f".{target.name}.part")
    try:
        with temporary.open("wb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


class _Copy:
    """Puts the records of one file into another."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._mcap = Writer(stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._schemas: dict[int, int] = {}
        """Numbers of the old file to those of the new one."""
        self._channels: dict[int, int] = {}

    def take(self, record: Record) -> None:
        """Copy one record; a message whose channel was lost cannot be read by anybody and is left out."""
        match record:
            case Message() if record.channel_id in self._channels:
                channel = self._channels[record.channel_id]
                self._mcap.add_message(channel, record.log_time, record.data, record.publish_time, record.sequence)
            case Header():
                self._mcap.start(profile=record.profile, library=record.library)
            case Metadata():
                self._mcap.add_metadata(record.name, record.metadata)
            case Attachment():
                self._mcap.add_attachment(
                    record.create_time, record.log_time, record.name, record.media_type, record.data
                )
            case Schema() if record.id not in self._schemas:
                self._schemas[record.id] = self._mcap.register_schema(record.name, record.encoding, record.data)
            case Channel() if record.id not in self._channels:
                schema = self._schemas[record.schema_id]
                self._channels[record.id] = self._mcap.register_channel(
                    record.topic, record.message_encoding, schema, record.metadata
                )

    def finish(self, about: dict[str, str]) -> None:
        """Write the index."""
        self._mcap.add_metadata(RECOVERED, about)
        self._mcap.finish()  # type: ignore[no-untyped-call]
