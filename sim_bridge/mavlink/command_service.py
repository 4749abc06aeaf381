"""COMMAND_LONG and COMMAND_INT in, COMMAND_ACK out; some commands may be made to take their time or to fail."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import common

from sim_bridge.mavlink.codec import Heard
from sim_bridge.mavlink.commands import Desk, Params, execute
from sim_bridge.mavlink.parameter_service import Answer
from sim_bridge.mavlink.vocabulary import Result

MOST_UNDONE = 10
"""Commands in progress."""
SLOW_NS = 1_000_000_000
"""How long they are."""


@dataclass(slots=True)
class Reluctance:
    """Commands that are not simply done: faults. 0: none."""

    rejected: int = 0
    """Denied whatever it asks for."""
    busy: int = 0
    """Temporarily rejected, once."""
    slow: int = 0
    """In progress for a second, then done."""


class CommandService:
    """One boot's."""

    def __init__(self, desk: Desk, answer: Answer, reluctance: Reluctance) -> None:
        self._desk, self._answer, self._reluctance = desk, answer, reluctance
        self._undone: list[tuple[int, Heard, Params]] = []

    def take_long(self, heard: Heard) -> None:
        """COMMAND_LONG."""
        m = heard.message
        self._take(heard, (m.param1, m.param2, m.param3, m.param4, m.param5, m.param6, m.param7))

    def take_int(self, heard: Heard) -> None:
        """COMMAND_INT."""
        m = heard.message
        self._take(heard, (m.param1, m.param2, m.param3, m.param4, float(m.x), float(m.y), m.z))

    def finish(self, now_ns: int) -> None:
        """Do what took its time."""
        while self._undone and self._undone[0][0] <= now_ns:
            _, heard, params = self._undone.pop(0)
            self._acknowledge(heard, execute(heard.message.command, params, self._desk))

    def _take(self, heard: Heard, params: Params) -> None:
        command, reluctance = heard.message.command, self._reluctance
        if not command or command not in (reluctance.rejected, reluctance.busy, reluctance.slow):
            self._acknowledge(heard, execute(command, params, self._desk))
        elif command == reluctance.rejected:
            self._acknowledge(heard, Result.DENIED)
        elif command == reluctance.busy:
            reluctance.busy = 0
            self._acknowledge(heard, Result.TEMPORARILY_REJECTED)
        elif len(self._undone) < MOST_UNDONE:
            self._undone.append((self._desk.pilot.now_ns + SLOW_NS, heard, params))
            self._acknowledge(heard, Result.IN_PROGRESS)

    def _acknowledge(self, heard: Heard, result: Result) -> None:
        self._answer(acknowledgement(heard.message.command, result, heard.system, heard.component))


def acknowledgement(command: int, result: Result, system: int, component: int) -> Any:
    """COMMAND_ACK to whoever commanded."""
    return common.MAVLink_command_ack_message(command, result, 0, 0, system, component)
