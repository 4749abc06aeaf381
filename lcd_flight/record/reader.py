"""Reads flight logs, whole or cut, and says in one line what is wrong with a file that is none."""

from __future__ import annotations

import contextlib
import struct
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import msgspec
import zstandard
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, Footer, Header, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC

from lcd_flight.model import InputError, Tick, TickInputs
from lcd_flight.record import codec
from lcd_flight.record.flight_log import FlightLog, findings_of, series_of
from lcd_flight.record.header import FLIGHT, LOG_SCHEMA, PROFILE, FlightHeader, header_from
from lcd_flight.record.topics import TICK, TICK_INPUTS

_DAMAGE = (McapError, zstandard.ZstdError, struct.error, ValueError)
"""What the MCAP library raises where a file was cut or altered (CRC and UTF-8 errors are ValueErrors)."""

_LARGEST_RECORD_BYTES = 2**30
"""A length above this is damage, not a record: it would only fill the memory."""


@dataclass(slots=True)
class _Content:
    """What a file holds, undecoded."""

    header: Header | None = None
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    topics: dict[int, str] = field(default_factory=dict)
    messages: dict[str, list[bytes]] = field(default_factory=lambda: defaultdict(list))
    """By topic, in the order of the file."""
    complete: bool = False


def read_log(path: Path) -> FlightLog:
    """The flight as arrays; of a cut file, what was flushed before the cut.

    Raises:
        InputError: it is no flight log, or not one that this version can read, or it holds no tick.
    """
    header, ticks, complete = _read(path)
    if not ticks:
        raise InputError(f"{path}: describes a flight but holds no tick: it ended before the first was written")
    return FlightLog(
        path=path,
        header=header,
        series=series_of(ticks),
        findings=findings_of([tick for _, tick in ticks]),
        complete=complete,
    )


def read_ticks(path: Path) -> list[tuple[TickInputs, Tick]]:
    """The records themselves, equal to the bit to those that were written.

    Raises:
        InputError: it is no flight log, or not one that this version can read.
    """
    return _read(path)[1]


def _read(path: Path) -> tuple[FlightHeader, list[tuple[TickInputs, Tick]], bool]:
    """Header, ticks, and whether the file is whole."""
    try:
        with path.open("rb") as stream:
            content = _content(path, stream)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    header = _header(path, content)
    try:
        # A tick whose inputs were flushed and which was itself cut off has no partner: zip ends before it.
        inputs = [codec.decode(data, TickInputs) for data in content.messages[TICK_INPUTS.name]]
        ticks = [codec.decode(data, Tick) for data in content.messages[TICK.name]]
    except msgspec.MsgspecError as error:
        raise InputError(f"{path}: a tick is not as this version of lcd-flight writes it: {error}") from error
    return header, list(zip(inputs, ticks, strict=False)), content.complete


def _content(path: Path, stream: IO[bytes]) -> _Content:
    """All records up to the end, or to the first that is not whole.

    Raises:
        InputError: it does not even begin as MCAP.
    """
    beginning = stream.read(len(MCAP0_MAGIC))
    if not beginning:
        raise InputError(f"{path}: is empty")
    if not MCAP0_MAGIC.startswith(beginning):
        raise InputError(f"{path}: is not an MCAP file; flight logs end in .mcap")
    stream.seek(0)
    content = _Content()
    with contextlib.suppress(*_DAMAGE):
        for record in _records(stream):
            _take(content, record)
    return content


def _records(stream: IO[bytes]) -> Iterator[McapRecord]:
    return StreamReader(stream, validate_crcs=True, record_size_limit=_LARGEST_RECORD_BYTES).records


def _take(content: _Content, record: McapRecord) -> None:
    """Sort one record in."""
    match record:
        case Header():
            content.header = record
        case Metadata():
            content.metadata[record.name] = record.metadata
        case Attachment():
            content.attachments[record.name] = record.data
        case Channel():
            content.topics[record.id] = record.topic
        case Message():
            content.messages[content.topics[record.channel_id]].append(record.data)
        case Footer():
            content.complete = True


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
