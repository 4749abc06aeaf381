"""Messages to packets and back, on pymavlink's generated dialects; its transport, framing and signing stay outside.

`common` is spoken. What ArduPilot says beyond it (EKF_STATUS_REPORT) is packed with its own dialect by `messages`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import common

from sim_bridge.mavlink.framing import SIGNED, split
from sim_bridge.mavlink.signing import Signatures, signed

LINK_ID = 0
common.MAVLINK_IGNORE_CRC = 0  # pymavlink lets the environment switch checksums off: a vehicle does not


@dataclass(frozen=True, slots=True)
class Heard:
    """A message and who sent it."""

    message: Any
    """pymavlink's; fields as in the dialect."""
    kind: int
    """Its number."""
    system: int
    component: int


class Codec:
    """One vehicle's channel: numbers what goes out, believes what is well formed and, if it has a key, signed."""

    def __init__(self, system: int, component: int, signatures: Signatures) -> None:
        self._out = common.MAVLink(None, srcSystem=system, srcComponent=component)
        self._in = common.MAVLink(None)
        self.signatures = signatures

    def decode(self, data: bytes, now_ticks: int) -> list[Heard]:
        """What can be believed of the packets in some bytes."""
        packets, _ = split(data)
        heard = (self._decoded(packet) for packet in packets if self.signatures.accepts(packet, now_ticks))
        return [one for one in heard if one is not None]

    def encode(self, message: Any, now_ticks: int) -> bytes:
        """One packet; the next has the next number."""
        key = self.signatures.key
        packet: bytes = message.pack(self._out)
        if key is not None:
            packet = signed(_flagged(packet, message.crc_extra), key, LINK_ID, self.signatures.next_ticks(now_ticks))
        self._out.seq = (self._out.seq + 1) % 256
        return packet

    def _decoded(self, packet: bytes) -> Heard | None:
        if packet[0] == common.PROTOCOL_MARKER_V2 and packet[2] & ~SIGNED:
            return None  # flags that nobody knows change what the packet means
        try:
            message = self._in.decode(bytearray(packet))
        except common.MAVError:
            return None
        if message.get_msgId() < 0 or isinstance(message, common.MAVLink_unknown):
            return None
        return Heard(message, message.get_msgId(), message.get_srcSystem(), message.get_srcComponent())


def _flagged(packet: bytes, crc_extra: int) -> bytes:
    """The packet with the flag that a signature follows, and the checksum that this makes."""
    head = packet[:2] + bytes((packet[2] | SIGNED,)) + packet[3:-2]
    crc = common.x25crc(head[1:])
    crc.accumulate(bytes((crc_extra,)))
    checksum: int = crc.crc
    return head + checksum.to_bytes(2, "little")
