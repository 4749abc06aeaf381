"""The vehicle's parameters: read at once, compared with what flight needs, and set only where that was asked for."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from drivers.mavlink.autopilot import Autopilot, Requirement
from drivers.mavlink.dialect import Message, mavlink
from drivers.mavlink.session import Session
from drivers.mavlink.waiting import until
from lcd_flight.model import Clock, RefusedError

ANSWER_S = 1.0
"""For all that were asked for at once."""
ATTEMPTS = 5
"""A parameter that does not exist gets no answer at all."""


@dataclass(frozen=True, slots=True)
class Difference:
    """A parameter that is not as flight needs it."""

    requirement: Requirement
    found: float | None
    """None: no answer; it does not exist."""

    def described(self) -> str:
        """One line: what is found, what is needed, why, and whether a restart is."""
        needed = self.requirement
        found = "does not answer" if self.found is None else f"is {self.found:g}"
        after = ", then restart the autopilot" if needed.restart else ""
        rule = "" if needed.rule == f"{needed.value:g}" else f" ({needed.rule})"
        return f"{needed.name} {found}, set it to {needed.value:g}{rule}{after}: {needed.why}"


class Parameters:
    """Reads and writes."""

    def __init__(self, session: Session, autopilot: Autopilot, clock: Clock) -> None:
        self.values: dict[str, float] = {}
        """As they came last."""
        self._kinds: dict[str, int] = {}
        self._session, self._autopilot, self._clock = session, autopilot, clock
        self._wanted: set[str] = set()
        session.listen(self.take)

    def take(self, message: Message, _now_ns: int) -> None:
        """A message of the vehicle; values that nobody asked for are left, or a flood would fill the memory."""
        if message.get_msgId() != mavlink.MAVLINK_MSG_ID_PARAM_VALUE or message.param_id not in self._wanted:
            return
        self._kinds[message.param_id] = int(message.param_type)
        self.values[message.param_id] = self._autopilot.value_from(message.param_value, int(message.param_type))

    async def read(self, names: Iterable[str]) -> Mapping[str, float]:
        """The present values; a name that has none does not exist."""
        wanted = tuple(dict.fromkeys(names))
        self._wanted.update(wanted)
        for name in wanted:
            self.values.pop(name, None)
        for _ in range(ATTEMPTS):
            for name in wanted:
                if name not in self.values:
                    self._session.send(
                        mavlink.MAVLink_param_request_read_message(*self._session.vehicle, name.encode(), -1)
                    )
            if await until(self._clock, lambda: all(name in self.values for name in wanted), ANSWER_S):
                break
        return {name: self.values[name] for name in wanted if name in self.values}

    async def differences(self, requirements: Iterable[Requirement]) -> tuple[Difference, ...]:
        """What is not as it must be."""
        required = tuple(requirements)
        found = await self.read(r.name for r in required)
        values = ((r, found.get(r.name)) for r in required)
        return tuple(Difference(r, value) for r, value in values if value is None or not _fits(r, value))

    async def write(self, name: str, value: float) -> None:
        """Set a parameter that has been read before, and read it back.

        Raises:
            RefusedError: it does not hold the value.
        """
        kind = self._kinds[name]
        wire = self._autopilot.value_to(value, kind)
        self.values.pop(name, None)
        self._session.send(mavlink.MAVLink_param_set_message(*self._session.vehicle, name.encode(), wire, kind))
        # Its echo may tell what was sent instead of what is kept: it is waited for and then asked again.
        await until(self._clock, lambda: name in self.values, ANSWER_S)
        found = (await self.read([name])).get(name)
        if found is None or not math.isclose(found, value, rel_tol=1e-5, abs_tol=1e-9):
            told = "does not answer" if found is None else f"reads {found:g}"
            raise RefusedError(f"parameter {name} was set to {value:g} but {told}: set it by hand")


async def require(parameters: Parameters, requirements: Iterable[Requirement], *, may_set: bool) -> tuple[str, ...]:
    """Make sure that parameters are as flight needs them; returns what was changed, in words.

    may_set: set what needs no restart; otherwise, and for the rest, refuse.

    Raises:
        RefusedError: a list of all that is wrong, a line each.
    """
    wrong = await parameters.differences(requirements)
    mine = [d for d in wrong if may_set and d.found is not None and not d.requirement.restart]
    others = [d for d in wrong if d not in mine]
    if others:
        hint = (
            "" if may_set or all(d.requirement.restart for d in others) else " (or add set_parameters=true to the link)"
        )
        head = f"the autopilot is not set up for this flight; nothing was changed{hint}:"
        raise RefusedError("\n".join([head, *(f"  {d.described()}" for d in wrong)]))
    for difference in mine:
        await parameters.write(difference.requirement.name, difference.requirement.value)
    return tuple(f"{d.requirement.name} {d.found:g} -> {d.requirement.value:g}" for d in mine)


def _fits(requirement: Requirement, value: float) -> bool:
    return math.isfinite(value) and requirement.fits(value)
