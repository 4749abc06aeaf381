"""PARAM_REQUEST_LIST, PARAM_REQUEST_READ and PARAM_SET, each flavour in its way.

Sources: PX4, src/modules/mavlink/mavlink_parameters.cpp; ArduPilot 4.6, libraries/GCS_MAVLink/GCS_Param.cpp, and how
long its answers took in flight experiments.
"""

from __future__ import annotations

from typing import Any, Protocol

from pymavlink.dialects.v20 import common

from sim_bridge.mavlink.autopilot import Autopilot
from sim_bridge.mavlink.codec import Heard
from sim_bridge.mavlink.parameters import Parameters
from sim_bridge.mavlink.px4 import Px4
from sim_bridge.mavlink.vocabulary import INFO

HASH = "_HASH_CHECK"
"""What PX4 begins its list with; writing it ends the list."""
LISTED_EACH = 5
"""Parameters of a list that are sent in a period."""
READ_NS, WRITE_NS = 100_000_000, 20_000_000
"""How long ArduPilot takes to answer."""


class Answer(Protocol):
    """Sends a message, now or after a while."""

    def __call__(self, message: Any, after_ns: int = 0) -> None:
        """Send it."""
        ...


class ParameterService:
    """One boot's."""

    def __init__(self, parameters: Parameters, pilot: Autopilot, answer: Answer, errors: bool) -> None:
        self._parameters, self._pilot, self._answer, self._errors = parameters, pilot, answer, errors
        self._px4 = isinstance(pilot, Px4)
        self._next: int | None = None

    def list_all(self, _: Heard) -> None:
        """From the first one on."""
        if self._px4:
            self._answer(self._parameters.hash_message(HASH))
        self._next = 0

    def listed(self) -> list[Any]:
        """What of the list is sent in this period."""
        if self._next is None:
            return []
        upto = min(self._next + LISTED_EACH, len(self._parameters))
        messages = [self._parameters.message(index) for index in range(self._next, upto)]
        self._next = upto if upto < len(self._parameters) else None
        return messages

    def read(self, heard: Heard) -> None:
        """An unknown name is answered with nothing, an unknown number by PX4 with a text."""
        name, index = heard.message.param_id, heard.message.param_index
        found = self._parameters.find(name, index)
        if found is not None:
            self._answer(self._parameters.message(found), 0 if self._px4 else READ_NS)
        elif self._px4 and name == HASH and index < 0:
            self._answer(self._parameters.hash_message(HASH))
        else:
            self._miss(heard, f"[pm] unknown param ID: {index}" if index >= 0 else "", index)

    def write(self, heard: Heard) -> None:
        """Answered with the value as it is then; an unknown name by PX4 with a text."""
        message = heard.message
        found = self._parameters.find(message.param_id, -1)
        if self._px4 and message.param_id == HASH:
            self._next = None
        elif found is None:
            self._miss(heard, f"[pm] unknown param: {_plain(message.param_id)}", -1)
        elif self._parameters.write(message.param_id, message.param_value, message.param_type):
            self._answer(self._parameters.echo(found, message.param_value), 0 if self._px4 else WRITE_NS)

    def _miss(self, heard: Heard, text: str, index: int) -> None:
        """There is no such parameter: say so as the firmware does."""
        if self._errors:
            name, error = heard.message.param_id.encode()[:16], common.MAV_PARAM_ERROR_DOES_NOT_EXIST
            self._answer(common.MAVLink_param_error_message(heard.system, heard.component, name, index, error))
        elif text and self._px4:
            self._pilot.say(INFO, text)


def _plain(name: str) -> str:
    """What can be shown of a name that somebody sent."""
    return "".join(letter if letter.isalnum() or letter == "_" else "?" for letter in name[:16])
