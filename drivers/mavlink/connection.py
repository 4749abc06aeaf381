"""From a vehicle that is heard to one that is set up, read back, and knows where it is."""

from __future__ import annotations

import contextlib

from drivers.mavlink import estimator, odometry_wire
from drivers.mavlink.contact import Contact
from drivers.mavlink.dialect import mavlink
from drivers.mavlink.options import origin_of
from drivers.mavlink.parameters import require
from drivers.mavlink.pose_stream import PoseStream
from drivers.mavlink.waiting import POLL_NS, pause, until
from lcd_flight.model import LinkContext, RawPose, RefusedError

FIRST_POSE_S = 5.0
ORIGIN_S = 1.0
ORIGIN_ATTEMPTS = 20
"""After a boot its estimator takes none yet."""
CHECKS_S = 30.0
"""ArduPilot's sensors settle for 15 to 25 s after a boot."""
CHECKS_PERIOD_S = 1.0


class Connection:
    """Sets a vehicle up and tells it its pose from then on."""

    def __init__(self, contact: Contact, context: LinkContext) -> None:
        self.contact = contact
        self.pose: RawPose | None = None
        """The newest of motion capture."""
        self.changed: tuple[str, ...] = ()
        """Parameters that were set."""
        self._context, self._clock = context, context.clock
        self._poses = PoseStream(contact.options.pose_rate_hz)
        self._streams = False

    async def set_up(self) -> None:
        """Parameters, origin, poses, estimate, settled sensors, in this order.

        Raises:
            RefusedError: something is not as flight needs it, with all that is wrong.
        """
        contact = self.contact
        if self._context.listen_poses is None:
            raise RefusedError(f"{contact.uri} needs poses from motion capture to tell its vehicle, and there are none")
        self._require_disarmed()
        requirements = contact.autopilot.requirements(self._context.on_link_lost)
        self.changed = await require(contact.parameters, requirements, may_set=contact.options.set_parameters)
        await contact.parameters.read([contact.autopilot.hover_parameter])
        self._require_disarmed()  # reading may take seconds
        await self._place_origin()
        self._context.listen_poses(self._take_pose)
        self._streams = True
        if not await until(self._clock, lambda: self.pose is not None, FIRST_POSE_S):
            raise RefusedError(self.objection())
        await self._settle()
        await self._checks()

    def close(self) -> None:
        """Tell no more poses."""
        self._streams = False

    def objection(self) -> str:
        """What speaks against the onboard estimate now; empty where nothing does."""
        return estimator.objection(self.contact.autopilot, self.contact.picture, self.pose, self._clock.now_ns())

    def _require_disarmed(self) -> None:
        """Nothing of a vehicle is changed, and no pose told, that somebody else may be flying.

        Raises:
            RefusedError: it is armed.
        """
        if self.contact.picture.armed:
            raise RefusedError(f"the vehicle at {self.contact.uri} is armed, not by us: have it disarmed first")

    def _take_pose(self, raw: RawPose) -> None:
        """Pass a pose on, as it comes."""
        self.pose = raw
        due = self._poses.take(raw) if self._streams else None
        if due is not None:
            with contextlib.suppress(ValueError):  # not finite: the pose source's own gate counts it
                self.contact.session.send(odometry_wire.message(due, self.contact.options.frame))

    async def _place_origin(self) -> None:
        """Before the first pose: the other way round leaves ArduPilot's height off by centimetres."""
        contact = self.contact
        if not contact.autopilot.wants_origin:
            return
        origin = origin_of(contact.options)
        for _ in range(ORIGIN_ATTEMPTS):
            contact.commands.tell(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN)
            if await until(self._clock, lambda: contact.picture.has_origin, ORIGIN_S):
                return
            contact.session.send(
                mavlink.MAVLink_set_gps_global_origin_message(
                    contact.session.vehicle[0],
                    round(origin.latitude_deg * 1e7),
                    round(origin.longitude_deg * 1e7),
                    round(origin.height_m * 1e3),
                )
            )
        raise RefusedError(f"the autopilot takes no origin (SET_GPS_GLOBAL_ORIGIN){contact.said()}: restart it")

    async def _settle(self) -> None:
        """Wait until its estimate has been right for a while."""
        wrong_ns = began_ns = self._clock.now_ns()
        while (now_ns := self._clock.now_ns()) - wrong_ns < estimator.SETTLED_NS:
            objection = self.objection()
            if objection:
                wrong_ns = now_ns
                if now_ns - began_ns > estimator.LIMIT_NS:
                    raise RefusedError(f"the vehicle's estimate cannot be flown with: {objection}{self.contact.said()}")
            await self._clock.sleep_until(now_ns + POLL_NS)

    async def _checks(self) -> None:
        """Wait for sensors that settle after a boot; arming asks again in any case."""
        deadline_ns = self._clock.now_ns() + round(CHECKS_S * 1e9)
        while not self._has_settled() and self._clock.now_ns() < deadline_ns:
            self.contact.commands.tell(mavlink.MAV_CMD_RUN_PREARM_CHECKS)
            await pause(self._clock, CHECKS_PERIOD_S)

    def _has_settled(self) -> bool:
        """By its own checks, or the time since its boot: what they find later has other reasons, and arming tells."""
        picture = self.contact.picture
        settled = picture.boot_ms is None or picture.boot_ms >= 1e3 * self.contact.autopilot.settles_s
        return settled or picture.prearm_ok is True
