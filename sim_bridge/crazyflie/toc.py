"""Tables of contents: which parameters or log variables there are, asked for one at a time.

Source: crazyflie-firmware, src/modules/src/param_logic.c and log.c; the form is that of protocol 4 and later.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

from sim_bridge.crazyflie.crtp import Packet

CHANNEL = 0
ITEM = 2
INFO = 3
_MARK = b"lcd-flight simulated Crazyflie"
"""Goes into every checksum: a client caches tables by the checksum alone, and must never take ours for a real one's."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One line of a table."""

    group: str
    name: str
    type_byte: int

    @property
    def full_name(self) -> str:
        """As users write it."""
        return f"{self.group}.{self.name}"

    def described(self) -> bytes:
        """Type, group and name, as they are sent."""
        return bytes((self.type_byte,)) + self.group.encode() + b"\0" + self.name.encode() + b"\0"


class Toc:
    """One table. extra: what the information packet says after the checksum."""

    def __init__(self, entries: Sequence[Entry], extra: bytes = b"") -> None:
        self._items = [entry.described() for entry in entries]
        self._extra = extra
        self.index = {entry.full_name: number for number, entry in enumerate(entries)}
        self.checksum = zlib.crc32(_MARK + b"".join(self._items))

    def answer(self, packet: Packet) -> list[Packet]:
        """What is said to a request on the table's channel; nothing to what is no request."""
        command = packet.payload[:1]
        if command == bytes((INFO,)):
            head = struct.pack("<BHI", INFO, len(self._items), self.checksum)
            return [packet.answer(head + self._extra)]
        if command == bytes((ITEM,)) and len(packet.payload) >= 3:
            return [packet.answer(self._item(packet.payload[:3]))]
        return []

    def _item(self, request: bytes) -> bytes:
        """An entry after its request, or the bare command where there is none."""
        (number,) = struct.unpack_from("<H", request, 1)
        return request + self._items[number] if number < len(self._items) else request[:1]
