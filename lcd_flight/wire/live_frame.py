"""The live stream: what a flight tells whoever watches, ten times a second, one ZeroMQ message part each.

Bytes: `live/<version>/tick` or `live/<version>/flight`, a zero byte, then JSON (`json_records`) of `LiveReport` or
`LiveFlight`. The flight's description is repeated each second, so that a watcher may come late.
"""

from __future__ import annotations

from dataclasses import dataclass

import msgspec

from lcd_flight.model import Finding, Tick, TickInputs
from lcd_flight.wire import json_records

VERSION = 1
"""Raised whenever a watcher of the old format could misread the new one."""

TOPIC = b"live/"
_TICK, _FLIGHT = (TOPIC + f"{VERSION}/{kind}\0".encode() for kind in ("tick", "flight"))


@dataclass(frozen=True, slots=True)
class LiveReport:
    """The newest tick whole, and what passed since the report before."""

    inputs: TickInputs
    tick: Tick
    ticks: int
    """Since the report before, this one included."""
    missed: int
    """Ticks that were skipped since then."""
    max_lateness_ns: int
    """The latest of these ticks against its deadline."""
    max_error_m: float
    """Since take-off."""
    findings: tuple[Finding, ...] = ()
    """That began since then."""
    messages: tuple[str, ...] = ()
    """That the vehicle sent since then."""


@dataclass(frozen=True, slots=True)
class LiveFlight:
    """What the flight's log begins with: metadata records and attachments by name, all of them text."""

    metadata: dict[str, dict[str, str]]
    attachments: dict[str, str]


def encode(frame: LiveReport | LiveFlight) -> bytes:
    """One message part."""
    return (_TICK if isinstance(frame, LiveReport) else _FLIGHT) + json_records.encode(frame)


def decode(data: bytes) -> LiveReport | LiveFlight:
    """What `encode` was given.

    Raises:
        ValueError: it is something else, or of another version; says which.
    """
    topic, _, content = data.partition(b"\0")
    try:
        if data.startswith(_TICK):
            return json_records.decode(content, LiveReport)
        if data.startswith(_FLIGHT):
            return json_records.decode(content, LiveFlight)
    except msgspec.MsgspecError as error:
        raise ValueError(f"a live report is not as this version writes it: {error}") from error
    if topic.startswith(TOPIC):
        version = topic.split(b"/")[1].decode("ascii", "replace")
        raise ValueError(f"the flight sends version {version} of the live stream, this reads {VERSION}")
    raise ValueError("this is no live stream of a flight")
