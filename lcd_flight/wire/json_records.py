"""Our records as JSON and back, exact to the bit.

Floats are written with the fewest digits that read back as the same number. JSON has no word for what is not finite:
such numbers are written as the strings `NaN`, `Infinity` and `-Infinity`, and read back as numbers.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any, TypeVar

import msgspec

Record = TypeVar("Record")


def encode(record: Any) -> bytes:
    """A frozen dataclass (or a tuple, or a mapping) as JSON, its fields in the order of the class.

    The encoder writes null for what is not finite. Nulls are rare in flight, so the record is looked through only
    where one was written that does not read back as it was.
    """
    data = _ENCODER.encode(record)
    if b"null" in data and not _reads_back(data, record):
        return _ENCODER.encode(_spelled_out(record))
    return data


def decode(data: bytes, record: type[Record]) -> Record:
    """The dataclass that `encode` was given.

    Raises:
        msgspec.ValidationError: the JSON is of something else.
        msgspec.DecodeError: it is not JSON.
    """
    # Not strict: only then are strings such as "NaN" taken for floats.
    return msgspec.json.decode(data, type=record, strict=False)


def _plain(value: Any) -> Any:
    """A number of an array library as the Python number that it stands for.

    Raises:
        NotImplementedError: it is no such thing.
    """
    if hasattr(value, "item"):
        return value.item()
    raise NotImplementedError(f"{type(value).__name__} has no place in a record")


def _reads_back(data: bytes, record: Any) -> bool:
    try:
        return bool(decode(data, type(record)) == record)
    except msgspec.ValidationError:
        return False


def _spelled_out(value: Any) -> Any:
    """The same value with what is not finite as strings."""
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if math.isnan(value) else "Infinity" if value > 0.0 else "-Infinity"
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: _spelled_out(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, tuple):
        return [_spelled_out(item) for item in value]
    return value


_ENCODER = msgspec.json.Encoder(enc_hook=_plain)
