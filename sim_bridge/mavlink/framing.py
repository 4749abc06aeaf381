"""Cutting bytes into MAVLink packets; nothing of their content is believed here."""

from __future__ import annotations

V1, V2 = 0xFE, 0xFD
SIGNED = 0x01
SIGNATURE_BYTES = 13
LONGEST = 280
"""Bytes of the longest packet, signature included."""


def split(data: bytes) -> tuple[list[bytes], bytes]:
    """The whole packets in some bytes, and the beginning of one at their end; what is between packets is left out."""
    packets: list[bytes] = []
    at = 0
    while (at := _next_start(data, at)) < len(data):
        size = _size(data, at)
        if size is None or at + size > len(data):
            break
        packets.append(data[at : at + size])
        at += size
    return packets, data[at:]


def _next_start(data: bytes, at: int) -> int:
    while at < len(data) and data[at] not in (V1, V2):
        at += 1
    return at


def _size(data: bytes, at: int) -> int | None:
    """Length of the packet that begins here; None: too few bytes to tell."""
    if data[at] == V1:
        return None if at + 2 > len(data) else 8 + data[at + 1]
    if at + 3 > len(data):
        return None
    return 12 + data[at + 1] + (SIGNATURE_BYTES if data[at + 2] & SIGNED else 0)
