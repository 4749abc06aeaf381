"""The MAVLink link: `mavlink+udp://0.0.0.0:14540?autopilot=px4`, `mavlink+tcp://`, `mavlink+serial://`.

Everything happens in the event loop: a setpoint is encoded and handed to the socket in `send` itself, by the rules of
`outbox`. There is no fallback setpoint: from 100 ms without a fresh one there is silence, and the autopilot's failsafe
acts, whose parameters were read back before arming. Whoever changes the mode, the pilot first of all, has the vehicle.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from collections.abc import Mapping
from types import TracebackType
from typing import Self

from drivers.mavlink import arming, options, setpoint_wire
from drivers.mavlink.arming import Controls
from drivers.mavlink.connection import Connection
from drivers.mavlink.contact import Contact
from drivers.mavlink.custody import Custody
from drivers.mavlink.dialect import Message
from drivers.mavlink.outbox import FALLBACK_NS, Outbox
from drivers.mavlink.thrust import ThrustMap
from drivers.mavlink.transport import Transport, transport_to
from drivers.mavlink.waiting import pause, until
from lcd_flight.model import AttitudeThrust, LinkContext, LinkReport, Quaternion, RefusedError, Transmission
from lcd_flight.model.frames import from_yaw, yaw_of

STREAM_S = 1.2
"""Of setpoints before the autopilot is asked for its mode; it wants one second."""
ARMING_S = 9.0
"""For all of arming; the flight itself gives up after 10 s."""
POSES_S = 60.0
"""So long poses go on, while the link closes, to a vehicle that lands by itself."""
HEARTBEAT_LOST_NS = 3_500_000_000
"""Three heartbeats at the slowest: who has the vehicle cannot be seen any more, whatever else is heard."""
STOP_S = 1.0
"""So long closing goes on repeating an emergency stop that is not confirmed."""
RAMP_SHARE = 0.25
"""Of the thrust that hovers, while motors come up: it stays on the ground."""
FLYING_M = 0.15
"""Above where it stood: higher is in the air."""
HOVERS = (0.05, 0.9)
"""Shares of full thrust that a vehicle may hover at."""
LOG_CAPACITY = 1000
TEND_NS = 10_000_000


def open_udp(address: str, given: Mapping[str, str], context: LinkContext) -> MavlinkLink:
    """The link behind `mavlink+udp://HOST:PORT`.

    Raises:
        InputError: not an address, a wrong option, or no signing key where it should be.
        RefusedError: others may read the signing key.
    """
    return _opened("mavlink+udp", address, given, context)


def open_tcp(address: str, given: Mapping[str, str], context: LinkContext) -> MavlinkLink:
    """The link behind `mavlink+tcp://HOST:PORT`.

    Raises:
        InputError: as `open_udp`.
        RefusedError: as `open_udp`.
    """
    return _opened("mavlink+tcp", address, given, context)


def open_serial(address: str, given: Mapping[str, str], context: LinkContext) -> MavlinkLink:
    """The link behind `mavlink+serial://PATH`.

    Raises:
        InputError: as `open_udp`.
        RefusedError: as `open_udp`.
    """
    return _opened("mavlink+serial", address, given, context)


def _opened(scheme: str, address: str, given: Mapping[str, str], context: LinkContext) -> MavlinkLink:
    chosen = options.read(scheme, address, given)
    return MavlinkLink(f"{scheme}://{address}", chosen, context, transport_to(scheme, address, chosen))


class MavlinkLink:
    """`lcd_flight.model.Link` to PX4 or ArduPilot."""

    def __init__(self, uri: str, chosen: options.MavlinkOptions, context: LinkContext, transport: Transport) -> None:
        """See the openers above; `transport` may be anything that carries bytes."""
        self._options, self._context, self._clock = chosen, context, context.clock
        self._contact = contact = Contact(uri, chosen, context.clock, transport)
        self._connection = Connection(contact, context)
        self._controls = Controls(contact.autopilot, contact.commands, contact.picture, context.clock)
        self._outbox = Outbox()
        self._custody = Custody(contact, self._outbox, self._airborne)
        self._map: ThrustMap | None = None
        self._tending: asyncio.Task[None] | None = None
        self._arming: asyncio.Future[None] | None = None
        self._idle_thrust = 0.0
        """Of the setpoints between arming and the control loop's first."""
        self._fell_back = False
        self._restarts = self._sent = self._invalid = 0
        self._transmitted: deque[Transmission] = deque(maxlen=LOG_CAPACITY)

    async def __aenter__(self) -> Self:
        """Find the vehicle and set it up; see `Contact` and `Connection`.

        Raises:
            RefusedError: it is not there, not set up, or does not know where it is; with all that is wrong.
        """
        picture = self._contact.picture
        self._contact.session.listen(self._custody.watch)
        try:
            self._tending = asyncio.create_task(self._tend())
            await self._contact.find()
            await self._connection.set_up()
            self._map = self._thrust_map()
        except BaseException:
            await self._close()
            raise
        self._restarts = picture.restarts
        picture.say(self.description)
        for change in self._connection.changed:
            picture.say(f"parameter {change}")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave a vehicle in the air to its own LAND mode, and go on with its poses until it is down."""
        picture = self._contact.picture
        try:
            if self._outbox.latched:
                await until(self._clock, lambda: picture.armed is False, STOP_S)
            elif picture.armed and self._custody.is_ours():
                await self._leave()
        finally:
            await self._close()

    @property
    def description(self) -> str:
        """Autopilot, version, and what hovering takes."""
        version = self._contact.picture.version or "of unknown version"
        thrust = "" if self._map is None else f"; {self._map.described()}"
        return f"{self._contact.autopilot.name} {version}{thrust}"

    async def arm(self) -> None:
        """Stream, enter the autopilot's mode, arm, and wait until its motors take thrust. Takes 3 to 9 s.

        Raises:
            RefusedError: not connected, motors stopped or handed over before, or the vehicle will not, with its reason.
        """
        self._require_fit()
        mode = self._contact.autopilot.flight_mode
        self._custody.begin()
        self._idle_thrust = 0.0
        self._outbox.idle(self._clock.now_ns())
        self._arming = asyncio.ensure_future(self._brought_up(mode))
        try:
            async with asyncio.timeout(ARMING_S):
                await asyncio.wait({self._arming})
            if self._arming.cancelled():
                raise RefusedError("the vehicle was not armed: it was stopped or disarmed meanwhile")
            self._arming.result()
            self._custody.require_armed_in(mode, self._clock.now_ns())
        except BaseException as error:
            if self._contact.picture.armed and self._custody.may_be_cut():
                arming.disarm_once(self._controls)
            self._outbox.rest(self._clock.now_ns())
            if isinstance(error, TimeoutError):
                raise RefusedError(f"arming took longer than {ARMING_S:g} s{self._contact.said()}") from None
            raise
        finally:
            await self._end_arming()
        self._outbox.ready(self._clock.now_ns())

    async def disarm(self) -> None:
        """Make our vehicle on the ground disarm; one that flew, by its LAND mode. Somebody else's is left alone.

        Raises:
            RefusedError: not connected, or it stays armed.
        """
        if self._tending is None:
            raise RefusedError("the vehicle cannot be disarmed: the link is not open")
        await self._end_arming()
        if self._contact.picture.armed and self._custody.is_ours():
            self._custody.landing, self._idle_thrust = self._custody.flown, 0.0
            if self._airborne():  # it may stand on something
                self._outbox.land(self._clock.now_ns())
            else:
                self._outbox.idle(self._clock.now_ns())
            await arming.disarm(self._controls, self._custody)
        self._outbox.rest(self._clock.now_ns())

    def send(self, setpoint: AttitudeThrust, stamp_ns: int) -> None:
        """Send the setpoint of the tick that began at `stamp_ns`, at once; an unfit one is refused and counted."""
        if self._map is None or self._tending is None:
            return
        if not setpoint.is_finite():
            self._invalid += 1
            return
        message = self._message(setpoint.q_WB, self._map.share(setpoint.thrust_N))
        now_ns = self._clock.now_ns()
        if message is not None and self._outbox.admits(stamp_ns, now_ns) and self._transmit(message):
            self._outbox.sent(stamp_ns, now_ns)
            self._sent += 1
            self._custody.flown = True

    def stop_motors(self) -> None:
        """Emergency stop, latched: a forced disarm, repeated until the vehicle says that it is disarmed.

        Not of a vehicle that a pilot flies.
        """
        if self._tending is None or self._outbox.latched:
            return
        self._outbox.stop(self._clock.now_ns())
        if self._arming is not None:
            self._arming.cancel()
        self._due(self._clock.now_ns())

    def report(self, now_ns: int) -> LinkReport:
        """What is known now."""
        session, picture = self._contact.session, self._contact.picture
        falls_back = self._outbox.falls_back(now_ns)
        if falls_back and not self._fell_back:
            picture.say(f"no fresh setpoint for {FALLBACK_NS / 1e6:.0f} ms: silence, the autopilot's own failsafe acts")
        self._fell_back = falls_back
        transmitted = tuple(self._transmitted)
        self._transmitted.clear()
        return LinkReport(
            connected=self._tending is not None,
            age_ns=self._age_ns(now_ns),
            sent=self._sent,
            received=session.losses.received,
            lost=session.losses.lost,
            stale=self._outbox.stale + self._invalid,
            loss_share=session.losses.share(now_ns),
            fallback_active=falls_back,
            taken_over=self._custody.taken_over,
            flown_by_pilot=self._custody.flown_by_pilot,
            transmitted=transmitted,
            telemetry=picture.telemetry(now_ns=now_ns, lost=self._custody.lost),
        )

    def _age_ns(self, now_ns: int) -> int | None:
        """Since the vehicle's newest packet; since its newest heartbeat, where that is missing."""
        newest_ns, heartbeat_ns = self._contact.session.newest_ns, self._contact.picture.heartbeat_ns
        if newest_ns is None or heartbeat_ns is None:
            return None
        silent_ns = now_ns - heartbeat_ns
        return silent_ns if silent_ns > HEARTBEAT_LOST_NS else max(now_ns - newest_ns, 0)

    async def _brought_up(self, mode: int) -> None:
        """From a stream of setpoints to motors that take thrust."""
        await pause(self._clock, STREAM_S)
        await arming.enter_mode(self._controls, self._custody, mode)
        await arming.arm(self._controls)
        await self._bring_motors_up()

    async def _end_arming(self) -> None:
        """No order to arm goes out after this."""
        task, self._arming = self._arming, None
        if task is not None and task is not asyncio.current_task():
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    async def _bring_motors_up(self) -> None:
        """Wait until the motors take thrust; where they come up with the first one only, give a little of it."""
        autopilot = self._contact.autopilot
        await pause(self._clock, autopilot.motors_off_s)
        if autopilot.ramp_s > 0.0 and self._map is not None:
            self._idle_thrust = RAMP_SHARE * self._map.hover
            await pause(self._clock, autopilot.ramp_s)

    def _require_fit(self) -> None:
        """Refuse to arm what cannot be armed on this connection any more, or not now."""
        if self._tending is None:
            reason = "the link is not open"
        elif self._outbox.latched:
            reason = "its motors were stopped; connect anew"
        elif self._outbox.over:
            reason = f"{self._custody.taken_over or 'it was disarmed in the air'}; connect anew"
        elif self._contact.picture.armed:
            reason = "it is armed already, not by us"
        elif self._contact.picture.restarts != self._restarts:
            reason = "the autopilot was restarted since it was set up; connect anew"
        else:
            reason = self._connection.objection()
        if reason:
            raise RefusedError(f"the vehicle will not arm: {reason}")

    def _thrust_map(self) -> ThrustMap:
        autopilot, given = self._contact.autopilot, self._options
        hover = self._contact.parameters.values.get(autopilot.hover_parameter) if given.hover is None else given.hover
        if hover is None or not HOVERS[0] <= hover <= HOVERS[1]:
            raise RefusedError(
                f"{autopilot.hover_parameter} is {hover}, no share of thrust to hover at ({HOVERS[0]} to {HOVERS[1]}): "
                "set it, or give the option hover"
            )
        slope = autopilot.thrust_slope if given.thrust_slope is None else given.thrust_slope
        return ThrustMap(hover, slope, self._context.vehicle.weight_N)

    def _message(self, q_WB: Quaternion, thrust: float) -> Message | None:
        """A setpoint that has been validated; None, and counted, where it is unfit."""
        now_ns, vehicle = self._clock.now_ns(), self._contact.session.vehicle
        try:
            return setpoint_wire.attitude_target(q_WB, thrust, now_ns=now_ns, target=vehicle, frame=self._options.frame)
        except ValueError:
            self._invalid += 1
            return None

    def _transmit(self, message: Message) -> bool:
        """Encode and send one setpoint, and note its bytes; whether it went."""
        data = self._contact.session.send(message)
        if data is None:
            return False
        self._transmitted.append(Transmission(self._clock.now_ns(), data.hex()))
        return True

    async def _tend(self) -> None:
        """Everything that is due without being asked for, at the control rate."""
        while True:
            now_ns = self._clock.now_ns()
            self._contact.tend(now_ns)
            self._due(now_ns)
            await self._clock.sleep_until(now_ns + TEND_NS)

    def _due(self, now_ns: int) -> None:
        if self._outbox.idles(now_ns) and (message := self._message(self._level(), self._idle_thrust)) is not None:
            self._transmit(message)
        if self._outbox.stops(now_ns):
            arming.cut(self._controls)

    def _level(self) -> Quaternion:
        """At the heading that it has."""
        pose = self._connection.pose
        return from_yaw(0.0 if pose is None else yaw_of(pose.q_WB))

    def _airborne(self) -> bool:
        """By motion capture: the autopilot's own word comes late."""
        pose = self._connection.pose
        return pose is not None and pose.p_WB[2] > self._context.initial_position_m[2] + FLYING_M

    async def _leave(self) -> None:
        """Have a vehicle that is still armed land by itself, or disarm where it stands; its poses go on meanwhile."""
        picture = self._contact.picture
        if not self._airborne():
            with contextlib.suppress(RefusedError):
                await self.disarm()
            return
        self._custody.landing = True
        self._outbox.land(self._clock.now_ns())
        await arming.land(self._controls, self._custody)
        await until(self._clock, lambda: picture.armed is False, POSES_S)

    async def _close(self) -> None:
        """Stop tending and close; no task is left."""
        tending, self._tending = self._tending, None
        self._map = None
        if tending is not None:
            tending.cancel()
            await asyncio.gather(tending, return_exceptions=True)
        self._connection.close()
        self._contact.close()
