"""The parameter service: read, write, defaults, extended types and what is kept over a reboot.

Source: crazyflie-firmware, src/modules/src/param_logic.c; answers are those of protocol 11 and later, where a status
byte stands before every value.
"""

from __future__ import annotations

import errno
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from sim_bridge.crazyflie import toc
from sim_bridge.crazyflie.crtp import Packet, Port
from sim_bridge.crazyflie.kinds import BY_PARAMETER_CODE, Kind

READ, WRITE, MISC = 1, 2, 3
SET_BY_NAME, VALUE_UPDATED, EXTENDED_TYPE, STORE, STATE, CLEAR, DEFAULT, EXTENDED_TYPE_2, DEFAULT_2 = range(9)
_EXTENDED, _CORE, _READ_ONLY = 0x10, 0x20, 0x40
_PERSISTENT = 1


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter, as it is at the first switching on."""

    group: str
    name: str
    kind: Kind
    default: float
    read_only: bool = False
    persistent: bool = False

    def entry(self) -> toc.Entry:
        """Its line in the table of contents."""
        flags = _CORE | (_READ_ONLY if self.read_only else 0) | (_EXTENDED if self.persistent else 0)
        return toc.Entry(self.group, self.name, self.kind.parameter_code | flags)


class Parameters:
    """All parameters of one vehicle and their values."""

    def __init__(self, parameters: Sequence[Parameter]) -> None:
        self._parameters = tuple(parameters)
        self._toc = toc.Toc([parameter.entry() for parameter in parameters])
        self._values = [float(parameter.default) for parameter in parameters]
        self._stored: dict[int, float] = {}

    @property
    def checksum(self) -> int:
        """Of the table of contents."""
        return self._toc.checksum

    def __getitem__(self, name: str) -> float:
        """A value by its full name, e.g. `flightmode.stabModeYaw`."""
        return self._values[self._toc.index[name]]

    def updated(self, name: str, value: float) -> Packet:
        """Change a value from within; the packet tells the client of it."""
        number = self._toc.index[name]
        self._values[number] = value
        return Packet(Port.PARAMETERS, MISC, struct.pack("<BH", VALUE_UPDATED, number) + self._bytes(number))

    def reboot(self) -> None:
        """Fall back to what is stored, else to the defaults."""
        self._values = [self._stored.get(n, float(p.default)) for n, p in enumerate(self._parameters)]

    def answer(self, packet: Packet) -> list[Packet]:
        """What is said to a packet on this port."""
        if packet.channel == toc.CHANNEL:
            return self._toc.answer(packet)
        if packet.channel == MISC:
            return self._misc(packet)
        if len(packet.payload) < 2:
            return []
        (number,) = struct.unpack_from("<H", packet.payload)
        if number >= len(self._parameters):
            return [packet.answer(packet.payload[:2] + bytes((errno.ENOENT,)))]
        return self._read(packet, number) if packet.channel == READ else self._write(packet, number)

    def _read(self, packet: Packet, number: int) -> list[Packet]:
        return [packet.answer(packet.payload[:2] + b"\0" + self._bytes(number))]

    def _write(self, packet: Packet, number: int) -> list[Packet]:
        """The echo of what was written; silence, as in the firmware, where the parameter is read-only."""
        value = self._parameters[number].kind.unpack(packet.payload[2:])
        if value is None or self._parameters[number].read_only:
            return []
        self._values[number] = value
        return [packet]

    def _misc(self, packet: Packet) -> list[Packet]:
        command = packet.payload[0] if packet.payload else -1
        if command == SET_BY_NAME:
            return self._set_by_name(packet)
        if len(packet.payload) < 3 or command not in _MISC_WITH_NUMBER:
            return []
        (number,) = struct.unpack_from("<H", packet.payload, 1)
        known = number < len(self._parameters)
        said = self._about(command, number) if known else bytes((errno.ENOENT,))
        return [packet.answer(packet.payload[:3] + said)]

    def _about(self, command: int, number: int) -> bytes:
        """The answer of a command about one parameter, after command and number."""
        parameter = self._parameters[number]
        if command in (EXTENDED_TYPE, EXTENDED_TYPE_2):
            return self._with_status(command, EXTENDED_TYPE_2, bytes((_PERSISTENT,)), parameter.persistent)
        if command in (DEFAULT, DEFAULT_2):
            default = parameter.kind.pack(parameter.default)
            return self._with_status(command, DEFAULT_2, default, not parameter.read_only)
        if not parameter.persistent:
            return bytes((errno.ENOENT,))
        return self._persistence(command, number)

    @staticmethod
    def _with_status(command: int, newer: int, value: bytes, known: bool) -> bytes:
        """Newer commands put a status before the value; older ones send an error in its place."""
        if not known:
            return bytes((errno.ENOENT,))
        return b"\0" + value if command == newer else value

    def _persistence(self, command: int, number: int) -> bytes:
        kind = self._parameters[number].kind
        if command == STORE:
            self._stored[number] = self._values[number]
        elif command == CLEAR:
            self._stored.pop(number, None)
        else:
            default = kind.pack(self._parameters[number].default)
            stored = self._stored.get(number)
            return b"\0" + default if stored is None else b"\1" + default + kind.pack(stored)
        return b"\0"

    def _set_by_name(self, packet: Packet) -> list[Packet]:
        """`00 group 0 name 0 type value`; the answer has the error in the place of type and value."""
        group, _, rest = packet.payload[1:].partition(b"\0")
        name, end, typed = rest.partition(b"\0")
        if not end or not typed:
            return []
        number = self._toc.index.get(f"{group.decode('latin-1')}.{name.decode('latin-1')}")
        error = errno.ENOENT if number is None else self._error_of_setting(number, typed)
        head = packet.payload[: len(group) + len(name) + 3]
        return [packet.answer(head + bytes((error,)))]

    def _error_of_setting(self, number: int, typed: bytes) -> int:
        parameter = self._parameters[number]
        if BY_PARAMETER_CODE.get(typed[0] & 0x0F) is not parameter.kind:
            return errno.EINVAL
        if parameter.read_only:
            return errno.EACCES
        value = parameter.kind.unpack(typed[1:])
        if value is None:
            return errno.EINVAL
        self._values[number] = value
        return 0

    def _bytes(self, number: int) -> bytes:
        return self._parameters[number].kind.pack(self._values[number])


_MISC_WITH_NUMBER = frozenset({EXTENDED_TYPE, STORE, STATE, CLEAR, DEFAULT, EXTENDED_TYPE_2, DEFAULT_2})
