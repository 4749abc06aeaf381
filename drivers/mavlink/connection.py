"""From an address to a vehicle that is set up, read back, and knows where it is."""

from __future__ import annotations

import contextlib

from drivers.mavlink import estimator, odometry_wire
from drivers.mavlink.autopilot import INTERVALS_HZ, flavour, kind_name
from drivers.mavlink.codec import Codec
from drivers.mavlink.commands import Commands
from drivers.mavlink.dialect import Message, mavlink
from drivers.mavlink.options import MavlinkOptions, allowed_hosts, origin_of
from drivers.mavlink.parameters import Parameters, require
from drivers.mavlink.picture import Picture
from drivers.mavlink.pose_stream import PoseStream
from drivers.mavlink.session import Session
from drivers.mavlink.signing import Timestamps, key_from
from drivers.mavlink.transport import Transport
from drivers.mavlink.waiting import POLL_NS, pause, until
from lcd_flight.model import LinkContext, RawPose, RefusedError

FIRST_POSE_S = 5.0
REPORTS_S = 1.0
"""For the first reports after they were asked for; they are asked for `REPORTS_ATTEMPTS` times."""
REPORTS_ATTEMPTS = 5
VERSION_S = 0.5
ORIGIN_S = 1.0
ORIGIN_ATTEMPTS = 5
CHECKS_S = 30.0
"""For the autopilot's own checks: ArduPilot's sensors settle for 15 to 25 s after a boot."""
CHECKS_PERIOD_S = 1.0
SILENT_REPORTS_NS = 1_000_000_000
"""Heartbeats without reports for so long: the autopilot was restarted and must be asked again."""


class Connection:
    """One vehicle, with all that is known of it. `open` it once, `close` it whatever happened."""

    def __init__(self, uri: str, options: MavlinkOptions, context: LinkContext, transport: Transport) -> None:
        """Prepare.

        Raises:
            InputError: there is no signing key where the options say.
            RefusedError: others may read it.
        """
        self.uri, self.options = uri, options
        self.autopilot = flavour(options)
        self.picture = Picture(options.frame)
        self.pose: RawPose | None = None
        """The newest of motion capture."""
        self.changed: tuple[str, ...] = ()
        """Parameters that were set."""
        key = key_from(options.signing)
        self._stamps = None if key is None else Timestamps(key)
        ours, vehicle = (options.our_system, options.our_component), (options.system, options.component)
        self.session = Session(
            transport, Codec(*ours, key, self._stamps), context.clock, vehicle, allowed_hosts(options)
        )
        self.commands = Commands(self.session, context.clock, ours)
        self.parameters = Parameters(self.session, self.autopilot, context.clock)
        self.session.listen(self._take)
        self._context, self._clock = context, context.clock
        self._poses = PoseStream(options.pose_rate_hz)
        self._streams_poses = False
        self._asked_ns = 0

    @property
    def kept_stamp(self) -> int:
        """The newest signing timestamp."""
        return self.session.newest_stamp

    async def find(self) -> None:
        """Open the transport and wait for the vehicle's heartbeat; then have it report.

        Raises:
            RefusedError: the transport is not to be had, nobody or somebody else is there, or it does not report.
        """
        await self.session.open()
        self.keep_stamps()
        if not await until(self._clock, lambda: self.picture.heartbeats > 0, self.options.connect_s):
            raise RefusedError(self._unheard())
        if self.picture.kind != self.autopilot.kind:
            is_kind = kind_name(self.picture.kind or 0)
            raise RefusedError(f"the vehicle at {self.uri} is {is_kind}, not {self.autopilot.name}: correct autopilot=")
        await self._have_it_report()
        self.commands.tell(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        await until(self._clock, lambda: bool(self.picture.version), VERSION_S)

    async def set_up(self) -> None:
        """Parameters, origin, poses, estimate, its own checks, in this order.

        Raises:
            RefusedError: something is not as flight needs it, with all that is wrong.
        """
        if self._context.listen_poses is None:
            raise RefusedError(f"{self.uri} needs poses from motion capture to tell its vehicle, and there are none")
        requirements = self.autopilot.requirements(self._context.on_link_lost)
        self.changed = await require(self.parameters, requirements, may_set=self.options.set_parameters)
        await self.parameters.read([self.autopilot.hover_parameter])
        await self._place_origin()
        self._context.listen_poses(self._take_pose)
        self._streams_poses = True
        if not await until(self._clock, lambda: self.pose is not None, FIRST_POSE_S):
            raise RefusedError(self.objection())
        await self._settle()
        await self._checks()

    def close(self) -> None:
        """Stop sending poses and close the transport."""
        self._streams_poses = False
        self.session.close()
        self.keep_stamps()

    def keep_stamps(self) -> None:
        """Note the newest signing timestamp for the next start."""
        if self._stamps is not None:
            try:
                self._stamps.keep(self.kept_stamp)
            except OSError as error:
                self.picture.say(f"the signing timestamp could not be kept: {error}")

    def tend(self, now_ns: int) -> None:
        """What is due from time to time: our heartbeat, and reports from an autopilot that was restarted."""
        self.session.beat(now_ns)
        picture = self.picture
        heard = picture.heartbeat_ns is not None and now_ns - picture.heartbeat_ns < 2 * SILENT_REPORTS_NS
        silent = picture.q_ns is None or now_ns - picture.q_ns > SILENT_REPORTS_NS
        if heard and silent and now_ns - self._asked_ns > SILENT_REPORTS_NS:
            self.ask_for_reports()

    def ask_for_reports(self) -> None:
        """Every message that is needed, at its rate (511)."""
        self._asked_ns = self._clock.now_ns()
        for number, rate_hz in (*INTERVALS_HZ.items(), *self.autopilot.intervals_hz.items()):
            self.commands.tell(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, float(number), 1e6 / rate_hz)

    def objection(self) -> str:
        """What speaks against the onboard estimate now; empty where nothing does."""
        return estimator.objection(self.autopilot, self.picture, self.pose, self._clock.now_ns())

    def _take(self, message: Message, now_ns: int) -> None:
        self.picture.take(message, now_ns)

    def _take_pose(self, raw: RawPose) -> None:
        """Pass a pose on, as it comes."""
        self.pose = raw
        due = self._poses.take(raw) if self._streams_poses else None
        if due is not None:
            with contextlib.suppress(ValueError):  # not finite: the pose source's own gate counts it
                self.session.send(odometry_wire.message(due, self.options.frame))

    async def _have_it_report(self) -> None:
        """Ask for reports until attitude and status come."""
        for _ in range(REPORTS_ATTEMPTS):
            self.ask_for_reports()
            if await until(self._clock, self._reports, REPORTS_S):
                return
        raise RefusedError(f"the autopilot at {self.uri} does not report its attitude and status: restart it")

    def _reports(self) -> bool:
        return self.picture.q_ns is not None and self.picture.battery_V is not None

    async def _place_origin(self) -> None:
        """Before the first pose: the other way round leaves ArduPilot's height off by centimetres."""
        if not self.autopilot.wants_origin:
            return
        origin = origin_of(self.options)
        for attempt in range(ORIGIN_ATTEMPTS):
            self.commands.tell(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN)
            if await until(self._clock, lambda: self.picture.has_origin, ORIGIN_S if attempt else VERSION_S):
                return
            self.session.send(
                mavlink.MAVLink_set_gps_global_origin_message(
                    self.session.vehicle[0],
                    round(origin.latitude_deg * 1e7),
                    round(origin.longitude_deg * 1e7),
                    round(origin.height_m * 1e3),
                )
            )
        raise RefusedError(f"the autopilot does not take an origin (SET_GPS_GLOBAL_ORIGIN){self._said()}: restart it")

    async def _settle(self) -> None:
        """Wait until its estimate has been right for a while."""
        wrong_ns = began_ns = self._clock.now_ns()
        while (now_ns := self._clock.now_ns()) - wrong_ns < estimator.SETTLED_NS:
            objection = self.objection()
            if objection:
                wrong_ns = now_ns
                if now_ns - began_ns > estimator.LIMIT_NS:
                    raise RefusedError(f"the vehicle's estimate cannot be flown with: {objection}{self._said()}")
            await self._clock.sleep_until(now_ns + POLL_NS)

    async def _checks(self) -> None:
        """Wait for the autopilot's own checks; arming asks again in any case."""
        deadline_ns = self._clock.now_ns() + round(CHECKS_S * 1e9)
        while not self._has_passed_checks() and self._clock.now_ns() < deadline_ns:
            self.commands.tell(mavlink.MAV_CMD_RUN_PREARM_CHECKS)
            await pause(self._clock, CHECKS_PERIOD_S)

    def _has_passed_checks(self) -> bool:
        """By its own word, or by the time since its boot where it says nothing."""
        if self.picture.prearm_ok is not None:
            return self.picture.prearm_ok
        return self.picture.boot_ms is None or self.picture.boot_ms >= 1e3 * self.autopilot.settles_s

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

    def _said(self) -> str:
        texts = self.picture.texts.recent(self._clock.now_ns())
        return f"; the autopilot says {texts}" if texts else ""
