"""MCAP records in the order of a file, up to its end or to where it was cut; what was altered is told, never passed on.

The library's indexed reader refuses a cut file, and its streaming one takes ten times as long over the messages of a
chunk: chunks are taken apart here (https://mcap.dev/spec).
"""

from __future__ import annotations

import os
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import IO, Any, TypeAlias

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader, get_chunk_data_stream

DAMAGE = (McapError, zstandard.ZstdError, struct.error, ValueError)
"""What the MCAP library raises where a file was cut or altered (CRC and UTF-8 errors are ValueErrors)."""

_LARGEST_RECORD_BYTES = 2**30
"""A length above this is damage, not a record: it would only fill the memory."""

_RECORD_HEAD = struct.Struct("<BQ")
"""Opcode and length."""
_MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Channel, sequence, log time, publish time."""


@dataclass(frozen=True, slots=True)
class LostChunk:
    """A chunk whose checksum or compression is wrong; what was in it is gone, the file goes on."""

    size: int
    """Compressed bytes."""


@dataclass(frozen=True, slots=True)
class Cut:
    """The file ends here, within a record or before its end mark."""


Record: TypeAlias = McapRecord | LostChunk | Cut

Advance: TypeAlias = Callable[[int], object]
"""Told how much more of long work is done: bytes, or ticks."""


def unwatched(_: int) -> None:
    """For callers whom nobody watches."""


class _Bounded:
    """A file of which no more is read than there is: the library believes a damaged length and asks for exabytes."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        here = stream.tell()
        self._left = stream.seek(0, os.SEEK_END) - here
        stream.seek(here)

    def read(self, size: int) -> bytes:
        """`size` bytes, or what is left."""
        data = self._stream.read(min(size, self._left))
        self._left -= len(data)
        return data


def records(stream: IO[bytes], advance: Advance = unwatched) -> Iterator[Record]:
    """Every record, those of chunks in the place of the chunk. The last is a `Footer`, or `Cut`.

    advance: told with each chunk.
    """
    bounded: Any = _Bounded(stream)  # all that the reader asks of a stream
    reader = StreamReader(bounded, emit_chunks=True, validate_crcs=True, record_size_limit=_LARGEST_RECORD_BYTES)
    told = 0
    try:
        for record in reader.records:
            if isinstance(record, Chunk):
                yield from _of_chunk(record)
                advance(stream.tell() - told)
                told = stream.tell()
            else:
                yield record
    except DAMAGE:
        yield Cut()


def _of_chunk(chunk: Chunk) -> Iterator[Record]:
    """What a chunk holds, after its checksum was found right."""
    try:
        stream, size = get_chunk_data_stream(chunk, validate_crc=True)
        data = stream.read(size)
    except DAMAGE:
        yield LostChunk(len(chunk.data))
        return
    begin = 0
    while begin < size:
        opcode, length = _RECORD_HEAD.unpack_from(data, begin)
        begin += _RECORD_HEAD.size
        yield from _record(opcode, data, begin, begin + length)
        begin += length


def _record(opcode: int, data: bytes, begin: int, end: int) -> Iterator[McapRecord]:
    """One record; none where the format has grown a kind that this version does not know."""
    if opcode == Opcode.MESSAGE:
        channel_id, sequence, log_time, publish_time = _MESSAGE_HEAD.unpack_from(data, begin)
        yield Message(channel_id, log_time, data[begin + _MESSAGE_HEAD.size : end], publish_time, sequence)
    elif opcode == Opcode.SCHEMA:
        yield Schema.read(ReadDataStream(BytesIO(data[begin:end])))
    elif opcode == Opcode.CHANNEL:
        yield Channel.read(ReadDataStream(BytesIO(data[begin:end])))
