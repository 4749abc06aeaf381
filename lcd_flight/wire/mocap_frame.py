"""The motion capture frame: one ZeroMQ message part for one pose of one rigid body.

Bytes: `mocap/<rigid body>`, a zero byte, then a msgpack map whose keys are the fields of `MocapFrame`. The zero byte
ends the topic, so that a subscription to `cf1` does not take `cf10` too. One part, because subscribers match the
beginning of the first part only, and because parts of a message can then never be torn from one another.

Decoding judges form alone; whether a pose makes sense (finite, unit quaternion, no jump) is the filter's business.
"""

from __future__ import annotations

from typing import Annotated

import msgspec

from lcd_flight.model.types import MocapAxes, Quaternion, Vector3

VERSION = 1
"""Raised whenever a reader of the old format could misread the new one."""

MAX_BYTES = 2048
"""A frame with every field at its longest stays below."""

_PREFIX = b"mocap/"
_END_OF_TOPIC = b"\0"

_Name = Annotated[str, msgspec.Meta(min_length=1, max_length=64)]
_Count = Annotated[int, msgspec.Meta(ge=0, le=2**63 - 1)]
_Nanoseconds = Annotated[int, msgspec.Meta(ge=-(2**63), le=2**63 - 1)]


class MocapFrame(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One pose as the source has it, in the source's own axes."""

    version: int = VERSION
    body: _Name
    """The rigid body; without a zero byte."""
    sequence: _Count
    """Counts this publisher's messages of this body: gaps are losses."""
    frame_number: _Count
    """The camera system's own count."""
    source_time_ns: _Nanoseconds
    """When the pose was true, on the source's clock."""
    send_time_ns: _Nanoseconds
    """When it was sent, on the same clock."""
    clock_id: _Name
    """Which clock that is; a new one (another host, a reboot) begins a new time scale."""
    axes: MocapAxes = "enu"
    """What the numbers below are expressed in; see `MocapAxes`."""
    position: Vector3
    """m"""
    quaternion: Quaternion
    """Attitude xyzw, body to world of these axes."""
    velocity: Vector3 | None = None
    """m/s in the world, where the source has a twist."""
    body_rates: Vector3 | None = None
    """rad/s in the body, where the source has a twist."""
    occluded: bool = False
    """The body was not seen: the pose is the last one or a guess."""


class _Version(msgspec.Struct):
    """All that is asked of a frame which cannot be read."""

    version: int


_encoder = msgspec.msgpack.Encoder()
_frame_decoder = msgspec.msgpack.Decoder(MocapFrame)
_version_decoder = msgspec.msgpack.Decoder(_Version)


def topic(body: str) -> bytes:
    """What to subscribe to for the frames of one rigid body.

    Raises:
        ValueError: not a name for a rigid body.
    """
    name = body.encode()
    if not name or len(body) > 64 or _END_OF_TOPIC in name:
        raise ValueError(f"not a name for a rigid body: {body!r} (1 to 64 characters, no zero byte)")
    return _PREFIX + name + _END_OF_TOPIC


def encode(frame: MocapFrame) -> bytes:
    """The bytes of one frame.

    Raises:
        ValueError: the rigid body's name cannot be a topic.
    """
    return topic(frame.body) + _encoder.encode(frame)


def decode(data: bytes) -> MocapFrame:
    """Read one frame back.

    Raises:
        ValueError: not a frame, with what is wrong about it; also a frame of another version.
    """
    if len(data) > MAX_BYTES:
        raise ValueError(f"{len(data)} bytes are too many for a mocap frame (at most {MAX_BYTES})")
    head, _, payload = data.partition(_END_OF_TOPIC)
    try:
        frame = _frame_decoder.decode(payload)
    except (ValueError, RecursionError) as error:
        raise ValueError(_why_unreadable(payload, error)) from None
    if frame.version != VERSION:
        raise ValueError(_other_version(frame.version))
    if head != _PREFIX + frame.body.encode():
        raise ValueError(f"the topic {head!r} is not that of rigid body {frame.body!r}")
    return frame


def _why_unreadable(payload: bytes, error: Exception) -> str:
    """Another version is the better reason than the first field that it changed."""
    try:
        version = _version_decoder.decode(payload).version
    except (ValueError, RecursionError):
        return f"not a mocap frame: {error}"
    return f"not a mocap frame: {error}" if version == VERSION else _other_version(version)


def _other_version(version: int) -> str:
    age = "newer" if version > VERSION else "older"
    remedy = "update lcd-flight" if version > VERSION else "update the publisher"
    return f"mocap frame version {version} is {age} than version {VERSION}, which is read here: {remedy}"
