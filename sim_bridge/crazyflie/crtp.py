"""The Crazyflie's packet protocol, CRTP: bytes to packets and back. Pure: no socket, no clock.

One datagram is one packet: a header byte (port in the high four bits, channel in the low two; the two between are set),
then up to 30 bytes. Source: crazyflie-firmware, src/modules/interface/crtp.h; cflib, crtp/crtpstack.py.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

MAX_PAYLOAD = 30
"""Bytes after the header."""
LINK_BITS = 0x0C
"""The two header bits that a sender sets and a receiver ignores."""


class Port(IntEnum):
    """Whom a packet is for."""

    CONSOLE = 0x0
    PARAMETERS = 0x2
    COMMANDER = 0x3
    MEMORY = 0x4
    LOG = 0x5
    LOCALIZATION = 0x6
    GENERIC_COMMANDER = 0x7
    HIGH_LEVEL_COMMANDER = 0x8
    SUPERVISOR = 0x9
    PLATFORM = 0xD
    LINK = 0xF


@dataclass(frozen=True, slots=True)
class Packet:
    """One packet, either way."""

    port: int
    channel: int
    payload: bytes = b""

    def answer(self, payload: bytes) -> Packet:
        """A packet back on the same port and channel."""
        return Packet(self.port, self.channel, payload)


def decode(datagram: bytes) -> Packet | None:
    """The packet in a datagram; None where it is empty or too long to be one."""
    if not 1 <= len(datagram) <= 1 + MAX_PAYLOAD:
        return None
    return Packet(datagram[0] >> 4, datagram[0] & 0x03, bytes(datagram[1:]))


def encode(packet: Packet) -> bytes:
    """The datagram of a packet.

    Raises:
        ValueError: no such port or channel, or too long.
    """
    if not (0 <= packet.port <= 15 and 0 <= packet.channel <= 3 and len(packet.payload) <= MAX_PAYLOAD):
        raise ValueError(f"not a packet: {packet}")
    return bytes((packet.port << 4 | LINK_BITS | packet.channel,)) + packet.payload
