"""The log service: blocks of variables that are sent at a period. Time comes in as milliseconds since switching on.

Source: crazyflie-firmware, src/modules/src/log.c.
"""

from __future__ import annotations

import errno
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from sim_bridge.crazyflie import toc
from sim_bridge.crazyflie.crtp import Packet, Port
from sim_bridge.crazyflie.kinds import BY_LOG_CODE, Kind

CONTROL, DATA = 1, 2
DELETE, START, STOP, RESET, CREATE_2, APPEND_2, START_2 = 2, 3, 4, 5, 6, 7, 8
MAX_BLOCKS, MAX_VARIABLES, MAX_BYTES = 16, 128, 26
_RAW_MEMORY = 0xFFFF
"""Stands for an address in place of a variable's number."""

Seen = TypeVar("Seen")


@dataclass(frozen=True, slots=True)
class LogVariable(Generic[Seen]):
    """One variable and where its value comes from."""

    group: str
    name: str
    kind: Kind
    value: Callable[[Seen], float]

    def entry(self) -> toc.Entry:
        """Its line in the table of contents."""
        return toc.Entry(self.group, self.name, self.kind.log_code)


@dataclass(slots=True)
class _Block:
    """What a client asked for: variables by number, each as the type it wants, and when they are next due."""

    variables: list[tuple[int, Kind]] = field(default_factory=list)
    period_ms: int = 0
    due_ms: int | None = None

    @property
    def size(self) -> int:
        return sum(kind.size for _, kind in self.variables)


class Logs(Generic[Seen]):
    """All log variables of one vehicle and the blocks that run."""

    def __init__(self, variables: Sequence[LogVariable[Seen]]) -> None:
        self._variables = tuple(variables)
        limits = bytes((MAX_BLOCKS, MAX_VARIABLES))
        self._toc = toc.Toc([variable.entry() for variable in variables], extra=limits)
        self._blocks: dict[int, _Block] = {}

    @property
    def checksum(self) -> int:
        """Of the table of contents."""
        return self._toc.checksum

    @property
    def size(self) -> int:
        """Variables in all blocks."""
        return sum(len(block.variables) for block in self._blocks.values())

    def reboot(self) -> None:
        """Forget all blocks."""
        self._blocks.clear()

    def answer(self, packet: Packet, now_ms: int) -> list[Packet]:
        """What is said to a packet on this port."""
        if packet.channel == toc.CHANNEL:
            return self._toc.answer(packet)
        if packet.channel != CONTROL or not packet.payload:
            return []
        command, block, rest = packet.payload[0], *_first(packet.payload[1:])
        return [packet.answer(bytes((command, block, self._control(command, block, rest, now_ms))))]

    def due(self, now_ms: int, seen: Callable[[], Seen]) -> list[Packet]:
        """The data packets that fall due by `now_ms`, at most one a block; `seen` is asked only where there are any."""
        due = [(number, b) for number, b in self._blocks.items() if b.due_ms is not None and b.due_ms <= now_ms]
        if not due:
            return []
        values = seen()
        return [self._sent(number, block, now_ms, values) for number, block in due]

    def _sent(self, number: int, block: _Block, now_ms: int, seen: Seen) -> Packet:
        block.due_ms = now_ms + block.period_ms if block.period_ms else None
        head = bytes((number,)) + (now_ms & 0xFFFFFF).to_bytes(3, "little")
        values = b"".join(kind.pack(self._variables[n].value(seen)) for n, kind in block.variables)
        return Packet(Port.LOG, DATA, head + values)

    def _control(self, command: int, number: int, rest: bytes, now_ms: int) -> int:
        """Do as asked; the error, 0 for none."""
        if command == RESET:
            self._blocks.clear()
            return 0
        if command == CREATE_2:
            return self._create(number, rest)
        block = self._blocks.get(number)
        if command not in (DELETE, START, STOP, APPEND_2, START_2):
            return errno.ENOEXEC
        if block is None:
            return errno.ENOENT
        if command == APPEND_2:
            return self._append(block, rest)
        if command == DELETE:
            del self._blocks[number]
        elif command == STOP:
            block.due_ms = None
        else:
            block.period_ms = _period_ms(command, rest)
            block.due_ms = now_ms + block.period_ms
        return 0

    def _create(self, number: int, rest: bytes) -> int:
        if number in self._blocks:
            return errno.EEXIST
        if len(self._blocks) >= MAX_BLOCKS:
            return errno.ENOMEM
        self._blocks[number] = _Block()
        return self._append(self._blocks[number], rest)

    def _append(self, block: _Block, rest: bytes) -> int:
        """Add variables, three bytes each: type wanted, number. Raw memory is refused: there is none here."""
        for start in range(0, len(rest) - 2, 3):
            code, number = struct.unpack_from("<BH", rest, start)
            kind = BY_LOG_CODE.get(code & 0x0F)
            if number == _RAW_MEMORY or number >= len(self._variables) or kind is None:
                return errno.ENOENT
            if block.size + kind.size > MAX_BYTES:
                return errno.E2BIG
            if self.size >= MAX_VARIABLES:
                return errno.ENOMEM
            block.variables.append((number, kind))
        return 0


def _first(data: bytes) -> tuple[int, bytes]:
    """The first byte, 0 where there is none, and what follows it."""
    return (data[0], data[1:]) if data else (0, b"")


def _period_ms(command: int, rest: bytes) -> int:
    """The older command counts in tens of milliseconds, the newer one in milliseconds; 0 asks for one packet."""
    return 10 * _first(rest)[0] if command == START else int.from_bytes(rest[:2], "little")
