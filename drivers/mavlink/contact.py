"""From an address to a vehicle that is heard and reports: what flying it and looking at it have in common."""

from __future__ import annotations

import threading

from drivers.mavlink.autopilot import INTERVALS_HZ, flavour, kind_name
from drivers.mavlink.codec import Codec
from drivers.mavlink.commands import Commands
from drivers.mavlink.dialect import mavlink
from drivers.mavlink.options import MavlinkOptions, allowed_hosts
from drivers.mavlink.parameters import Parameters
from drivers.mavlink.picture import Picture
from drivers.mavlink.session import Session
from drivers.mavlink.signing import Timestamps, key_from
from drivers.mavlink.transport import Transport
from drivers.mavlink.waiting import until
from lcd_flight.model import Clock, RefusedError

REPORTS_S = 1.0
"""For the first reports after they were asked for; they are asked for `REPORTS_ATTEMPTS` times."""
REPORTS_ATTEMPTS = 5
VERSION_S = 0.5
KEEP_NS = 15_000_000_000
RESERVE = 45 * 100_000
"""Signing timestamps are noted so often, so far ahead (45 s, in tens of microseconds): a crash comes unannounced."""
SILENT_REPORTS_NS = 1_000_000_000
"""Heartbeats without reports for so long: the autopilot was restarted and must be asked again."""


class Contact:
    """One vehicle that is listened to; nothing of it is changed here."""

    def __init__(self, uri: str, options: MavlinkOptions, clock: Clock, transport: Transport) -> None:
        """Prepare.

        Raises:
            InputError: there is no signing key where the options say.
            RefusedError: others may read it.
        """
        self.uri, self.options, self.clock = uri, options, clock
        self.autopilot = flavour(options)
        self.picture = Picture(options.frame)
        key = key_from(options.signing)
        self.signed = key is not None
        self._stamps = None if key is None else Timestamps(key)
        ours, vehicle = (options.our_system, options.our_component), (options.system, options.component)
        codec = Codec(*ours, key, self._stamps)
        self.session = Session(transport, codec, clock, vehicle, allowed_hosts(options))
        self.commands = Commands(self.session, clock, ours)
        self.parameters = Parameters(self.session, self.autopilot, clock)
        self.session.listen(self.picture.take)
        self._asked_ns = self._kept_ns = 0

    async def find(self) -> None:
        """Open the transport, wait for the vehicle's heartbeat, have it report.

        Raises:
            RefusedError: the transport is not to be had, nobody or somebody else is there, or it does not report.
        """
        await self.session.open()
        self._kept_ns = self.clock.now_ns()
        self._keep(self.session.newest_stamp + RESERVE)
        if not await until(self.clock, lambda: self.picture.heartbeats > 0, self.options.connect_s):
            raise RefusedError(self._unheard())
        if self.picture.kind != self.autopilot.kind:
            is_kind = kind_name(self.picture.kind or 0)
            raise RefusedError(f"the vehicle at {self.uri} is {is_kind}, not {self.autopilot.name}: correct autopilot=")
        await self._have_it_report()
        self.commands.tell(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        await until(self.clock, lambda: bool(self.picture.version), VERSION_S)

    def close(self) -> None:
        """Close the transport; may be called at any time."""
        self.session.close()
        self._keep(self.session.newest_stamp)

    def tend(self, now_ns: int) -> None:
        """What is due from time to time: our heartbeat, and reports from an autopilot that was restarted."""
        self.session.beat(now_ns)
        if self._stamps is not None and now_ns - self._kept_ns >= KEEP_NS:
            self._kept_ns = now_ns
            newest = self.session.newest_stamp + RESERVE
            threading.Thread(target=self._keep, args=(newest,), daemon=True).start()  # a disk may be slow
        picture = self.picture
        heard = picture.heartbeat_ns is not None and now_ns - picture.heartbeat_ns < 2 * SILENT_REPORTS_NS
        silent = picture.q_ns is None or now_ns - picture.q_ns > SILENT_REPORTS_NS
        if heard and silent and now_ns - self._asked_ns > SILENT_REPORTS_NS:
            self._ask_for_reports()

    def said(self) -> str:
        """The autopilot's latest complaints as the end of a sentence; empty where there are none."""
        texts = self.picture.texts.recent(self.clock.now_ns())
        return f"; the autopilot says {texts}" if texts else ""

    def _ask_for_reports(self) -> None:
        """Every message that is needed, at its rate (511)."""
        self._asked_ns = self.clock.now_ns()
        for number, rate_hz in (*INTERVALS_HZ.items(), *self.autopilot.intervals_hz.items()):
            self.commands.tell(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, float(number), 1e6 / rate_hz)

    async def _have_it_report(self) -> None:
        """Ask for reports until attitude and status come."""
        for _ in range(REPORTS_ATTEMPTS):
            self._ask_for_reports()
            if await until(self.clock, self._reports, REPORTS_S):
                return
        raise RefusedError(f"the autopilot at {self.uri} does not report its attitude and status: restart it")

    def _reports(self) -> bool:
        return self.picture.q_ns is not None and self.picture.heard_status

    def _keep(self, newest: int) -> None:
        """Note for the next start that signing timestamps up to `newest` are or will be used. May wait for the disk."""
        if self._stamps is not None:
            try:
                self._stamps.keep(newest)
            except OSError as error:
                self.picture.say(f"the signing timestamp could not be kept: {error}")

    def _unheard(self) -> str:
        """Why there is no vehicle."""
        limit = f"no heartbeat from system {self.options.system} at {self.uri} within {self.options.connect_s:g} s"
        if self.session.strangers:
            others = ", ".join(sorted(self.session.strangers))
            return f"{limit}, but from {others}: name the right one with the options system, component, allow"
        if self.session.rejected:
            reasons = ", ".join(f"{count} {reason}" for reason, count in self.session.rejected.items())
            return f"{limit}; packets were left out ({reasons}): check the option signing and the autopilot's key"
        return f"{limit}: is the autopilot on, and does it send to this address?"
