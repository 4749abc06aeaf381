"""COMMAND_LONG and its acknowledgement: asked again where one is lost, waited for where it takes longer.

An acknowledgement counts where command and target are those that were sent. It says that a command was taken, not that
what it asks for has happened: that is seen in the heartbeat.
"""

from __future__ import annotations

from collections.abc import Callable

from drivers.mavlink.dialect import Message, mavlink
from drivers.mavlink.session import Session
from drivers.mavlink.waiting import until
from lcd_flight.model import Clock

ANSWER_S = 0.4
"""For one attempt."""
ATTEMPTS = 5
PROGRESS_S = 5.0
"""More time for a command that is IN_PROGRESS, from each such word on."""
PROGRESS_LIMIT_S = 10.0
"""For all such words together."""

ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
IN_PROGRESS = mavlink.MAV_RESULT_IN_PROGRESS
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
        self._answers[message.command] = int(message.result)
        if message.result == IN_PROGRESS:
            self._progress_ns[message.command] = now_ns

    async def ask(self, command: int, *parameters: float, wanted: Callable[[], bool] = lambda: True) -> int:
        """Send a command until it is acknowledged; the result, `NO_ANSWER` where there is none.

        parameters: the first of the seven; the rest is 0. wanted: asked all the time before it is acknowledged; what
        has happened without, or is no longer ours to ask for, is not sent again.
        """
        self._answers[command] = NO_ANSWER
        try:
            for confirmation in range(ATTEMPTS):
                self.tell(command, *parameters, confirmation=confirmation)
                if await until(self._clock, lambda: self._known(command) or not wanted(), ANSWER_S):
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
        """Wait for the result of a command that is IN_PROGRESS, as long as it says so, up to a limit."""
        await until(self._clock, lambda: not self._progresses(command), PROGRESS_LIMIT_S)

    def _known(self, command: int) -> bool:
        return self._answers[command] != NO_ANSWER

    def _progresses(self, command: int) -> bool:
        if self._answers[command] != IN_PROGRESS:
            return False
        return self._clock.now_ns() - self._progress_ns[command] < PROGRESS_S * 1e9
