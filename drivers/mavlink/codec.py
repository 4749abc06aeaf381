"""Messages to bytes and bytes to messages; what is damaged, unsigned, replayed or forged is counted and left out.

pymavlink's own parser takes a damaged packet's length on trust and swallows what follows it, and its signature check
keeps the timestamp of a packet before it has verified it, so that one forged packet from the far future makes every
later good one fail. Here a damaged packet costs its first byte, and a failed check leaves no trace.
"""

from __future__ import annotations

import hashlib
from collections import Counter

from drivers.mavlink.dialect import Message, mavlink
from drivers.mavlink.signing import Key, Timestamps

_V1, _V2 = 0xFE, 0xFD
_SIGNED = 0x01
"""incompat_flags"""
_SIGNATURE = 13
_OVERHEAD = {_V1: 8, _V2: 12}
_NOT_ACCEPTED = "Invalid signature"
"""What pymavlink says of a packet that is whole, and unsigned or wrongly signed."""
MAX_STREAMS = 64
"""Senders whose signing timestamps are remembered."""
MINUTE = 60 * 100_000
"""So far, in tens of microseconds, a sender may be behind our time."""
TOO_OLD = "too old"
"""Signed with our key, but over a minute behind our time: a replay, or somebody whose clock must be told."""


class _Checked(mavlink.MAVLink):  # type: ignore[misc]  # pymavlink is untyped
    """pymavlink's codec, whose check of a signature changes nothing where it fails."""

    def __init__(self, system: int, component: int) -> None:
        super().__init__(None, srcSystem=system, srcComponent=component)
        self.refusal = ""
        """Why the newest signature was not accepted."""

    def check_signature(self, msgbuf: bytearray, srcSystem: int, srcComponent: int) -> bool:
        stamps = self.signing.stream_timestamps
        stream = (msgbuf[-13], srcSystem, srcComponent)
        before = stamps.get(stream)
        if before is None and len(stamps) >= MAX_STREAMS:
            self.refusal = "from one sender too many"
            return False
        if super().check_signature(msgbuf, srcSystem, srcComponent):
            return True
        stamp = int.from_bytes(msgbuf[-12:-6], "little")
        genuine = hashlib.sha256(self.signing.secret_key + msgbuf[:-6]).digest()[:6] == msgbuf[-6:]
        old = stamp + MINUTE < self.signing.timestamp
        self.refusal = "forged" if not genuine else TOO_OLD if old else "replayed"
        if before is None:
            stamps.pop(stream, None)
        else:
            stamps[stream] = before
        return False


class Codec:
    """One end of a MAVLink connection."""

    def __init__(self, system: int, component: int, key: Key | None = None, stamps: Timestamps | None = None) -> None:
        """system, component: ours. key, stamps: sign what goes out and accept nothing unsigned."""
        self.rejected: Counter[str] = Counter()
        """Packets that were left out, by reason."""
        self._mav = _Checked(system, component)
        self._signing, self._stamps = self._mav.signing, stamps
        self._signing.secret_key = None if key is None else key.secret
        self._signing.sign_outgoing = key is not None
        if stamps is not None:  # what is heard before we have sent anything may be a replay too
            self._signing.timestamp = stamps.first

    def newest_stamp(self, now_ns: int) -> int:
        """The signing timestamp below which no packet may be from now on; 0 without signing."""
        return 0 if self._stamps is None else max(int(self._signing.timestamp), self._stamps.at(now_ns))

    def encode(self, message: Message, now_ns: int) -> bytes:
        """The bytes of a message with the next sequence number, signed where there is a key."""
        if self._stamps is not None:
            self._signing.timestamp = max(self._signing.timestamp, self._stamps.at(now_ns))
        data = message.pack(self._mav)
        self._mav.seq = (self._mav.seq + 1) % 256
        return bytes(data)

    def decode(self, buffer: bytearray) -> list[Message]:
        """Take every whole message off a buffer; what is left is the beginning of one, under 280 bytes."""
        messages: list[Message] = []
        start, end = 0, len(buffer)
        while start < end:
            length = _length(buffer, start)
            if length is None:
                start += 1
                continue
            if start + length > end:
                break
            message = self._decoded(buffer[start : start + length])
            if message is None:
                start += 1
                continue
            start += length
            if message is not _LEFT_OUT:
                messages.append(message)
        del buffer[:start]
        return messages

    def _decoded(self, frame: bytearray) -> Message | None:
        """The message; `_LEFT_OUT` where it is whole but not wanted, None where it is damaged or none at all."""
        self._mav.refusal = ""
        try:
            message = self._mav.decode(frame)
        except mavlink.MAVError as error:
            if error.message == _NOT_ACCEPTED:
                self.rejected[self._mav.refusal or "unsigned"] += 1
                return _LEFT_OUT
            self.rejected["damaged"] += 1
            return None
        if isinstance(message, mavlink.MAVLink_unknown):
            self.rejected["of an unknown kind"] += 1
            return _LEFT_OUT
        return message


_LEFT_OUT = object()


def _length(buffer: bytearray, start: int) -> int | None:
    """Bytes of the packet that begins at `start`; 3 where that is not known yet, None for junk."""
    magic = buffer[start]
    if magic not in _OVERHEAD:
        return None
    if start + 3 > len(buffer):
        return 3
    length = _OVERHEAD[magic] + buffer[start + 1]
    if magic == _V2:
        flags = buffer[start + 2]
        if flags & ~_SIGNED:
            return None
        length += _SIGNATURE if flags & _SIGNED else 0
    return length
