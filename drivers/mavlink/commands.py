"""COMMAND_LONG and its acknowledgement: asked again where one is lost, waited for where it takes longer.

An acknowledgement counts where command and target are those that were sent. It says that a command was taken, not that
what it asks for has happened: that is seen in the heartbeat.
"""

from __future__ import annotations

import functools

from drivers.mavlink.dialect import Message, mavlink
from drivers.mavlink.session import Session
from drivers.mavlink.waiting import until
from lcd_flight.model import Clock

ANSWER_S = 0.4
"""For one attempt."""
ATTEMPTS = 5
PROGRESS_S = 5.0
"""More time for a command that is IN_PROGRESS, from each such word on."""

ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
NO_ANSWER = -1


def result_name(result: int) -> str:
    """For a person."""
    if result == NO_ANSWER:
        return f"no acknowledgement after {ATTEMPTS} attempts in {ATTEMPTS * ANSWER_S:.0f} s"
    entry = mavlink.enums["MAV_RESULT"].get(result)
    return f"result {result}" if entry is None else str(entry.name).removeprefix("MAV_RESULT_")


class Commands:
    """Asks the vehicle for things."""

    def __init__(self, session: Session, clock: Clock, ours: tuple[int, int]) -> None:
        """ours: our system and component id."""
        self._session, self._clock, self._ours = session, clock, ours
        self._answers: dict[int, int] = {}
        """The newest result of each command that is being waited for."""
        self._progress_ns: dict[int, int] = {}
        session.listen(self.take)

    def take(self, message: Message, now_ns: int) -> None:
        """A message of the vehicle."""
        if message.get_msgId() != mavlink.MAVLINK_MSG_ID_COMMAND_ACK or message.command not in self._answers:
            return
        target = (message.target_system, message.target_component)
        if target not in (self._ours, (0, 0)):  # older firmware leaves the target out
            return
        if message.result == mavlink.MAV_RESULT_IN_PROGRESS:
            self._progress_ns[message.command] = now_ns
        else:
            self._answers[message.command] = int(message.result)

    async def ask(self, command: int, *parameters: float) -> int:
        """Send a command until it is acknowledged; the result, `NO_ANSWER` where there is none.

        parameters: the first of the seven; the rest is 0.
        """
        self._answers[command] = NO_ANSWER
        self._progress_ns.pop(command, None)
        try:
            for confirmation in range(ATTEMPTS):
                self.tell(command, *parameters, confirmation=confirmation)
                if await until(self._clock, lambda: self._known(command), ANSWER_S):
                    break
            await self._finished(command)
            return self._answers[command]
        finally:
            self._answers.pop(command, None)

    def tell(self, command: int, *parameters: float, confirmation: int = 0) -> None:
        """Send a command once, without waiting."""
        seven = (*parameters, *(0.0,) * (7 - len(parameters)))
        self._session.send(
            mavlink.MAVLink_command_long_message(*self._session.vehicle, command, confirmation % 256, *seven)
        )

    async def _finished(self, command: int) -> None:
        """Wait for the result of a command that is IN_PROGRESS, as long as it says so."""
        while command in self._progress_ns and self._answers[command] == NO_ANSWER:
            heard_ns = self._progress_ns[command]
            if not await until(self._clock, functools.partial(self._moved, command, heard_ns), PROGRESS_S):
                return

    def _known(self, command: int) -> bool:
        return self._answers.get(command, NO_ANSWER) != NO_ANSWER or command in self._progress_ns

    def _moved(self, command: int, heard_ns: int) -> bool:
        return self._answers[command] != NO_ANSWER or self._progress_ns[command] != heard_ns
