"""MAVLink 2 signatures as the autopilot checks them. Time comes in as an argument.

Source: mavlink.io, "Message Signing": sha256 of key, packet, link and time stamp, cut to 6 bytes; time stamps count
10 us since 2015 and grow within each stream; a new stream may be no older than a minute. Nothing is remembered of a
packet whose signature is wrong.
"""

from __future__ import annotations

import hashlib
import hmac

from sim_bridge.mavlink.framing import SIGNATURE_BYTES, SIGNED, V2

KEY_BYTES = 32
MOST_STREAMS = 16
"""As in the reference implementation; a seventeenth is refused."""
EPOCH_2015_S = 1_420_070_400
TICKS_PER_S = 100_000
OLDEST_TICKS = 60 * TICKS_PER_S


class Signatures:
    """One channel's key and the streams that it has heard."""

    def __init__(self, key: bytes | None, accepts_unsigned: bool) -> None:
        self.key = key
        self.accepts_unsigned = accepts_unsigned
        self._newest: dict[tuple[int, int, int], int] = {}
        self._latest = 0

    def accepts(self, packet: bytes, now_ticks: int) -> bool:
        """Whether a packet is to be believed. now_ticks: 10 us since 2015."""
        if self.key is None:
            return True
        if packet[0] != V2 or not packet[2] & SIGNED:
            return self.accepts_unsigned
        if not hmac.compare_digest(packet[-6:], signature(self.key, packet[:-6])):
            return False
        return self._is_new((packet[-SIGNATURE_BYTES], packet[5], packet[6]), _time_of(packet), now_ticks)

    def next_ticks(self, now_ticks: int) -> int:
        """The time stamp of the next packet that goes out: it grows with each."""
        self._latest = max(self._latest + 1, now_ticks)
        return self._latest

    def _is_new(self, stream: tuple[int, int, int], ticks: int, now_ticks: int) -> bool:
        newest = self._newest.get(stream)
        if newest is None:
            if len(self._newest) >= MOST_STREAMS or ticks < max(now_ticks, self._latest) - OLDEST_TICKS:
                return False
        elif ticks <= newest:
            return False
        self._newest[stream] = ticks
        self._latest = max(self._latest, ticks)
        return True


def signature(key: bytes, packet: bytes) -> bytes:
    """Of a packet up to and with its time stamp."""
    return hashlib.sha256(key + packet).digest()[:6]


def signed(packet: bytes, key: bytes, link_id: int, ticks: int) -> bytes:
    """A packet whose flag says that it is signed, with its signature."""
    told = packet + bytes((link_id,)) + (ticks % 2**48).to_bytes(6, "little")
    return told + signature(key, told)


def _time_of(packet: bytes) -> int:
    return int.from_bytes(packet[-12:-6], "little")
