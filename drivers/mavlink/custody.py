"""Who has the vehicle: we do from the moment it is armed in our mode, until a heartbeat shows that somebody else does.

A pilot's remote control wins always. Who changes the mode is the pilot, a ground station or the autopilot's failsafe:
from then on nothing is sent, and the mode is never entered again on this connection.
"""

from __future__ import annotations

from collections.abc import Callable

from drivers.mavlink.contact import Contact
from drivers.mavlink.dialect import Message, mavlink
from drivers.mavlink.outbox import Mode, Outbox
from lcd_flight.model import RefusedError


class Custody:
    """Watches the heartbeats."""

    def __init__(self, contact: Contact, outbox: Outbox, airborne: Callable[[], bool]) -> None:
        """airborne: whether motion capture sees it above the ground."""
        self.taken_over = ""
        """Who flies in our place, and in which mode; empty while nobody does."""
        self.flown_by_pilot: bool | None = None
        """Whether that is a person, and not the autopilot's own failsafe."""
        self.lost = False
        """Whether it was disarmed in the air, not by us."""
        self.ours = False
        """Whether it was armed by us, and has not been disarmed since."""
        self.flown = self.landing = False
        """Whether a setpoint has gone out since arming; whether it was told to land by itself."""
        self._contact, self._outbox, self._airborne = contact, outbox, airborne

    def begin(self) -> None:
        """It is going to be armed."""
        self.ours, self.lost, self.flown, self.landing = True, False, False, False

    def watch(self, message: Message, now_ns: int) -> None:
        """Look at each heartbeat."""
        if message.get_msgId() != mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            return
        armed = bool(self._contact.picture.armed)
        if self._outbox.latched:
            self._outbox.confirm(armed=armed)
        elif not armed:
            self._note_disarmed(now_ns)
        elif self.flown_by_pilot is False:
            self._note_pilot(now_ns)
        elif not self._is_in_expected_mode():
            self._hand_over(now_ns)

    def is_ours(self) -> bool:
        """Whether we armed it, and nobody else has it since."""
        return self.ours and not self._outbox.over

    def may_be_cut(self) -> bool:
        """Whether its motors may be stopped by force: ours, and on the ground."""
        return self.is_ours() and not self._airborne()

    def require_armed_in(self, mode: int, now_ns: int) -> None:
        """Refuse to go on where the mode was changed, or it was disarmed, while the motors came up.

        Raises:
            RefusedError: so it is.
        """
        picture, said = self._contact.picture, self._contact.said()
        if picture.armed and picture.custom_mode != mode:
            self._hand_over(now_ns)
            raise RefusedError(f"{self.taken_over}{said}")
        if not picture.armed or self._outbox.mode is not Mode.IDLING:
            raise RefusedError(f"the vehicle was armed and is not any more{said}")

    def _is_in_expected_mode(self) -> bool:
        """Whether the mode is one that we asked for; before anything flies it may be any."""
        autopilot, mode = self._contact.autopilot, self._contact.picture.custom_mode
        if self.landing and not self._outbox.over:
            return mode in (autopilot.flight_mode, autopilot.land_mode)
        return mode == autopilot.flight_mode or self._outbox.mode not in (Mode.READY, Mode.FLYING)

    def _note_disarmed(self, now_ns: int) -> None:
        self.ours = self.ours and self._outbox.mode is Mode.IDLING and not self.landing
        if self._outbox.mode not in (Mode.READY, Mode.FLYING):
            return
        if not self._airborne():  # it has landed, or somebody has disarmed it: who arms it again has it
            self._outbox.rest(now_ns)
            return
        self.lost = True
        self._outbox.hand_over(now_ns, to_pilot=True)
        self._contact.picture.say(f"the vehicle was disarmed in the air, not by us{self._contact.said()}")

    def _hand_over(self, now_ns: int) -> None:
        picture = self._contact.picture
        failing = picture.failsafe or self._outbox.falls_back(now_ns)
        self._taken_by(now_ns, pilot=not (failing and self._flies_alone()))
        picture.say(f"{self.taken_over}; its poses go on until it is disarmed{self._contact.said()}")

    def _note_pilot(self, now_ns: int) -> None:
        """After a failsafe the pilot may take over: from then on it is not stopped either."""
        if not self._flies_alone() and self._contact.picture.custom_mode != self._contact.autopilot.flight_mode:
            self._taken_by(now_ns, pilot=True)
            self._contact.picture.say(self.taken_over)

    def _taken_by(self, now_ns: int, *, pilot: bool) -> None:
        picture, autopilot = self._contact.picture, self._contact.autopilot
        mode = "unknown" if picture.custom_mode is None else autopilot.mode_name(picture.custom_mode)
        self.flown_by_pilot = pilot
        self.taken_over = f"{'the pilot' if pilot else 'the autopilot by itself'} took over: mode {mode}"
        self._outbox.hand_over(now_ns, to_pilot=pilot)

    def _flies_alone(self) -> bool:
        mode = self._contact.picture.custom_mode
        return mode is not None and self._contact.autopilot.flies_alone_in(mode)
