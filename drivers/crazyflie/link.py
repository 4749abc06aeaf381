"""The Crazyflie link: `radio://0/80/2M/E7E7E7E7E7`, `usb://0`, `udp://127.0.0.1:19850`.

cflib lives in threads. What it says is handed to the event loop; what is sent goes through one sender thread, by the
rules of `outbox`. Fallback, from 100 ms without a fresh setpoint: level, slightly below hover thrust; on the ground,
none.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import TracebackType
from typing import Self

from drivers.crazyflie import arming, crtp_wire, options
from drivers.crazyflie.connection import Connection
from drivers.crazyflie.outbox import FALLBACK_NS, MAX_AGE_NS, Mode
from drivers.crazyflie.sender import Sender
from drivers.crazyflie.session import Session
from drivers.crazyflie.status import Status
from drivers.crazyflie.thrust_map import FORCE_LINEAR_PROTOCOL, thrust_map
from lcd_flight.model import AttitudeThrust, LinkContext, LinkReport, Quaternion, RefusedError
from lcd_flight.model.frames import body_x_axis, from_yaw, yaw_of

FALLBACK_SHARE = 0.95
"""Of the weight: it comes down slowly."""
POSE_AGE_NS = 100_000_000
"""Up to here the heading is motion capture's, then the vehicle's own."""
UNLOCK_S = 0.1
"""Zero setpoints for so long before the control loop's: a lost one would leave the thrust locked."""
STOPS_S = 0.1
"""For so long `stop` is repeated before the vehicle is left alone."""
DESCENT_S = 15.0
"""So long is given to a vehicle that is still in the air when the link closes."""
GROUND_M = 0.05
"""Above where it stood: lower is on the ground."""


def open_radio(address: str, given: Mapping[str, str], context: LinkContext) -> CrazyflieLink:
    """The link behind `radio://DONGLE/CHANNEL/RATE/ADDRESS`.

    Raises:
        InputError: not an address, or a wrong option.
    """
    return CrazyflieLink("radio", address, given, context)


def open_usb(address: str, given: Mapping[str, str], context: LinkContext) -> CrazyflieLink:
    """The link behind `usb://NUMBER`.

    Raises:
        InputError: not a number, or a wrong option.
    """
    return CrazyflieLink("usb", address, given, context)


def open_udp(address: str, given: Mapping[str, str], context: LinkContext) -> CrazyflieLink:
    """The link behind `udp://HOST:PORT`.

    Raises:
        InputError: not an address, or a wrong option.
    """
    return CrazyflieLink("udp", address, given, context)


class CrazyflieLink:
    """`lcd_flight.model.Link` to a Crazyflie 2.x or 2.1 Brushless."""

    def __init__(self, scheme: str, address: str, given: Mapping[str, str], context: LinkContext) -> None:
        self._options = options.read(scheme, address, given)
        self._map = thrust_map(self._options.thrust_map, context.vehicle)
        self._context, self._clock = context, context.clock
        self._connection = Connection(f"{scheme}://{address}", self._options, context)
        self._armed = self._falling_back = False
        self._newest_stamp_ns = 0
        self._sent = self._stale = 0

    async def __aenter__(self) -> Self:
        """Connect; see `Connection.open`.

        Raises:
            RefusedError: nobody answers, a parameter does not hold, the estimate does not agree with motion capture, or
                the firmware needs another thrust map.
        """
        try:
            await self._connection.open(self._fallback, self._check_thrust_map)
        except BaseException:
            await self._connection.close()
            raise
        self._connection.picture.say(f"{self.description}; {self._map.source}")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Come down if it is still in the air, stop the motors, say so, close; no thread is left."""
        sender = self._connection.sender
        try:
            if sender is not None:
                await self._come_down(sender)
                await self._rest(sender)
        finally:
            self._armed = False
            if sender is not None:  # who cancels this too cuts the motors: silence would keep them turning
                sender.change(lambda box: box.rest())
            await self._connection.close()

    @property
    def description(self) -> str:
        """Platform, firmware, thrust map and what hovering takes."""
        session, thrust = self._connection.session, self._map.described(self._context.vehicle)
        if session is None:
            return f"Crazyflie, {thrust}"
        firmware = f"firmware {session.version or 'unknown'} ({session.revision}), CRTP protocol {session.protocol}"
        return f"{session.device or 'Crazyflie'}, {firmware}; {thrust}"

    async def arm(self) -> None:
        """Arm where the vehicle does not by itself, and unlock it with a zero setpoint.

        Raises:
            RefusedError: not connected, its motors were stopped, or the vehicle will not, with its reason.
        """
        sender, session = self._opened("the vehicle will not arm: the link is not open")
        if sender.latched:
            raise RefusedError("the vehicle will not arm: its motors were stopped; connect anew")
        await arming.arm(self._connection.picture, sender.request, session.protocol, self._clock)
        sender.change(lambda box: box.unlock(self._clock.now_ns()))
        await self._connection.pause(UNLOCK_S)
        await arming.ready_to_fly(self._connection.picture, self._clock)
        self._armed = True

    async def disarm(self) -> None:
        """Stop the motors on the ground, and disarm a vehicle that was armed on request.

        Raises:
            RefusedError: not connected, or the vehicle stays armed.
        """
        sender, session = self._opened("the vehicle cannot be disarmed: the link is not open")
        self._armed = False
        await self._rest(sender)
        await arming.disarm(self._connection.picture, sender.request, session.protocol, self._clock)

    def send(self, setpoint: AttitudeThrust, stamp_ns: int) -> None:
        """Hand over the setpoint of the tick that began at `stamp_ns`; the newest wins, an unfit one is refused."""
        sender = self._connection.sender
        if sender is None:
            return
        fresh = self._clock.now_ns() - stamp_ns <= MAX_AGE_NS and stamp_ns >= self._newest_stamp_ns
        if not (fresh and setpoint.is_finite()):
            self._stale += 1
            return
        self._newest_stamp_ns = stamp_ns
        self._sent += 1
        nose_W = body_x_axis(self._attitude() or setpoint.q_WB)
        packet = crtp_wire.setpoint(setpoint, nose_W, self._map.counts(setpoint.thrust_N))
        sender.change(lambda box: box.offer(packet, stamp_ns))

    def stop_motors(self) -> None:
        """Emergency stop, latched: `stop` is repeated, later setpoints are ignored and arming is refused."""
        self._armed = False
        if self._connection.sender is not None:
            self._connection.sender.change(lambda box: box.stop(self._clock.now_ns()))

    def report(self, now_ns: int) -> LinkReport:
        """What is known now. That it is asked for shows that the control loop lives."""
        session, sender, picture = self._connection.session, self._connection.sender, self._connection.picture
        if session is None or sender is None:
            return LinkReport(connected=False, age_ns=None, telemetry=picture.telemetry(armed=False))
        sender.alive(now_ns)
        self._tell(session, sender)
        newest_ns = session.newest_ns
        return LinkReport(
            connected=True,
            age_ns=None if newest_ns is None else max(now_ns - newest_ns, 0),
            sent=self._sent,
            received=session.received,
            lost=picture.lost,
            stale=self._stale + sender.stale,
            loss_share=picture.loss_share(now_ns),
            fallback_active=self._falling_back,
            quality=session.quality,
            transmitted=sender.transmitted(),
            telemetry=picture.telemetry(armed=self._armed and not sender.latched),
        )

    def _opened(self, refusal: str) -> tuple[Sender, Session]:
        sender, session = self._connection.sender, self._connection.session
        if sender is None or session is None:
            raise RefusedError(refusal)
        return sender, session

    def _check_thrust_map(self, session: Session) -> None:
        if self._map.force_linear and session.protocol < FORCE_LINEAR_PROTOCOL:
            raise RefusedError(
                f"firmware with CRTP protocol {session.protocol} is older than thrust that is linear in force: update "
                "it, or name a map that was identified for it (?thrust_map=FILE.yaml)"
            )

    def _attitude(self) -> Quaternion | None:
        """Motion capture's while it is fresh, else the vehicle's own: roll and pitch are seen from the true heading."""
        pose = self._connection.pose
        if pose is not None and self._clock.now_ns() - pose.arrival_ns <= POSE_AGE_NS:
            return pose.q_WB
        return self._connection.picture.q_WB

    def _fallback(self) -> bytes:
        """Level at the present heading; called in the sender's thread."""
        q_WB = self._connection.picture.q_WB
        level = from_yaw(0.0 if q_WB is None else yaw_of(q_WB))
        thrust_N = FALLBACK_SHARE * self._context.vehicle.weight_N if self._airborne() else 0.0
        return crtp_wire.setpoint(AttitudeThrust(thrust_N, level), body_x_axis(level), self._map.counts(thrust_N))

    def _airborne(self) -> bool:
        """By the vehicle's own word; while it has said nothing, yes."""
        status = self._connection.picture.status
        return status is None or Status.FLYING in status

    def _tell(self, session: Session, sender: Sender) -> None:
        """Put into the log what nobody asked for."""
        picture, was = self._connection.picture, self._falling_back
        self._falling_back = sender.mode is Mode.FALLBACK
        if self._falling_back and not was:
            picture.say(
                f"no fresh setpoint for {FALLBACK_NS / 1e6:.0f} ms: level at {FALLBACK_SHARE:.0%} of the weight"
            )
        for fault in session.take_faults():
            picture.say(f"radio or socket: {fault}")

    async def _come_down(self, sender: Sender) -> None:
        """The fallback, until the vehicle is down or its time is over; nothing where it does not fly."""
        if sender.mode not in (Mode.FLYING, Mode.FALLBACK) or not self._airborne():
            return
        sender.change(lambda box: box.descend(self._clock.now_ns()))
        await self._connection.until(self._down, DESCENT_S)

    def _down(self) -> bool:
        p_WB = self._connection.picture.p_WB
        low = p_WB is not None and p_WB[2] < self._context.initial_position_m[2] + GROUND_M
        return low or not self._airborne()

    async def _rest(self, sender: Sender) -> None:
        """Stop, repeatedly, and then say that no more will come: silence alone would lock the vehicle."""
        if sender.mode is Mode.SILENT:
            return
        sender.change(lambda box: box.end(self._clock.now_ns()))
        await self._connection.pause(STOPS_S)
        sender.change(lambda box: box.rest())
