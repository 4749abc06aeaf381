"""Reads flight logs, whole or cut, and says in one line what is wrong with a file that is none."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import msgspec
from mcap.records import Attachment, Channel, Footer, Header, Message, Metadata
from mcap.writer import MCAP0_MAGIC

from lcd_flight.model import InputError, Tick, TickInputs
from lcd_flight.record.container import Advance, LostChunk, Record, records, unwatched
from lcd_flight.record.flight_log import FlightLog, findings_of, missing_ticks, series_of
from lcd_flight.record.header import FLIGHT, LOG_SCHEMA, PROFILE, RECOVERED, FlightHeader, header_from
from lcd_flight.record.topics import TICK, TICK_INPUTS
from lcd_flight.wire import json_records

Pair = tuple[TickInputs, Tick]


@dataclass(slots=True)
class _Content:
    """What of a file makes a flight, undecoded."""

    header: Header | None = None
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    topics: dict[int, str] = field(default_factory=dict)
    inputs: dict[int, bytes] = field(default_factory=dict)
    """By sequence."""
    ticks: dict[int, bytes] = field(default_factory=dict)
    ended: bool = False
    """Whether the file ends as it should."""
    damaged: bool = False
    """Whether a chunk was lost."""


def read_log(path: Path, advance: Advance = unwatched) -> FlightLog:
    """The flight as arrays; of a cut file, what was flushed before the cut.

    advance: told the bytes that were read.

    Raises:
        InputError: it is no flight log, or not one that this version can read, or it holds no tick.
    """
    content = _content_of(path, advance)
    header, pairs = _header(path, content), _pairs(path, content)
    if not pairs:
        raise InputError(f"{path}: describes a flight but holds no tick: it ended before the first was written")
    ticks = [tick for _, tick in pairs]
    return FlightLog(
        path=path,
        header=header,
        series=series_of(pairs),
        findings=findings_of(ticks),
        complete=content.ended and not content.damaged and RECOVERED not in content.metadata,
        missing_ticks=missing_ticks(ticks),
    )


def read_ticks(path: Path) -> list[Pair]:
    """The records themselves, equal to the bit to those that were written, in order.

    Where ticks were dropped or a chunk was damaged, numbers are missing from the sequence.

    Raises:
        InputError: it is no flight log, or not one that this version can read.
    """
    return read_flight(path)[1]


def read_flight(path: Path, advance: Advance = unwatched) -> tuple[FlightHeader, list[Pair]]:
    """The flight's description and its ticks.

    advance: told the bytes that were read.

    Raises:
        InputError: it is no flight log, or not one that this version can read.
    """
    content = _content_of(path, advance)
    return _header(path, content), _pairs(path, content)


def read_header(path: Path) -> FlightHeader:
    """The flight's description alone: reading ends at the first message.

    Raises:
        InputError: it is no flight log, or not one that this version can read.
    """
    with opened(path) as stream:
        content = _Content()
        for record in records(stream):
            if isinstance(record, Message):
                break
            _take(content, record)
    return _header(path, content)


@contextmanager
def opened(path: Path) -> Iterator[IO[bytes]]:
    """The file, from its beginning, once that was found to be MCAP's.

    Raises:
        InputError: it cannot be read, or does not even begin as MCAP.
    """
    try:
        with path.open("rb") as stream:
            beginning = stream.read(len(MCAP0_MAGIC))
            if not beginning:
                raise InputError(f"{path}: is empty")
            if not MCAP0_MAGIC.startswith(beginning):
                raise InputError(f"{path}: is not an MCAP file; flight logs end in .mcap")
            stream.seek(0)
            yield stream
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error


def _content_of(path: Path, advance: Advance) -> _Content:
    with opened(path) as stream:
        content = _Content()
        for record in records(stream, advance):
            _take(content, record)
    return content


def _take(content: _Content, record: Record) -> None:
    """Sort one record in."""
    match record:
        case Message():
            topic = content.topics.get(record.channel_id)
            if topic == TICK.name:
                content.ticks[record.sequence] = record.data
            elif topic == TICK_INPUTS.name:
                content.inputs[record.sequence] = record.data
        case Header():
            content.header = record
        case Metadata():
            content.metadata[record.name] = record.metadata
        case Attachment():
            content.attachments[record.name] = record.data
        case Channel():
            content.topics[record.id] = record.topic
        case Footer():
            content.ended = True
        case LostChunk():
            content.damaged = True


def _pairs(path: Path, content: _Content) -> list[Pair]:
    """What each tick knew and decided; one that lost its partner to a cut is left out."""
    whole = [(content.inputs[n], data) for n, data in content.ticks.items() if n in content.inputs]
    try:
        with _collector_resting():
            return [
                (json_records.decode(inputs, TickInputs), json_records.decode(tick, Tick)) for inputs, tick in whole
            ]
    except msgspec.MsgspecError as error:
        raise InputError(f"{path}: a tick is not as this version of lcd-flight writes it: {error}") from error


@contextmanager
def _collector_resting() -> Iterator[None]:
    """Records hold no cycles, and looking for some among millions of them would take twice as long as reading them."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


def _header(path: Path, content: _Content) -> FlightHeader:
    """The flight's description.

    Raises:
        InputError: there is none, or not one that this version can read.
    """
    if content.header is None:
        raise InputError(f"{path}: was cut before the flight's description: nothing can be had from it")
    if content.header.profile != PROFILE:
        raise InputError(f"{path}: was written by another program ({content.header.library}), not by lcd-flight")
    schema = content.metadata.get(FLIGHT, {}).get("log_schema", "")
    if schema.isdecimal() and int(schema) > LOG_SCHEMA:
        raise InputError(
            f"{path}: has log schema {schema}, this version reads up to {LOG_SCHEMA}: "
            f"update lcd-flight (it was written by {content.header.library})"
        )
    try:
        return header_from(content.metadata, content.attachments)
    except KeyError as error:
        raise InputError(f"{path}: was cut within the flight's description ({error} is missing)") from error
    except (ValueError, msgspec.MsgspecError) as error:
        raise InputError(f"{path}: the flight's description is damaged: {error}") from error
