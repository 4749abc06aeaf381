"""The sides of the benchmark of the MAVLink link, and the vehicle that they all speak to."""

from __future__ import annotations

import asyncio
import contextlib
import math
import socket
import threading
import time
from collections.abc import Sequence
from typing import Protocol

from drivers.mavlink import setpoint_wire
from drivers.mavlink.codec import Codec
from drivers.mavlink.dialect import Message, mavlink
from drivers.mavlink.outbox import Outbox
from drivers.mavlink.picture import Picture
from drivers.mavlink.session import Session
from drivers.mavlink.thrust import ThrustMap
from drivers.mavlink.transport import Udp
from lcd_flight.flight.clock import RealClock
from lcd_flight.model import AttitudeThrust, Transmission
from lcd_flight.model.frames import from_yaw
from lcd_flight.worlds import load_vehicle

BURST = 100
"""Attitudes at once; a socket holds some 270 small datagrams."""
PATIENCE_S = 5.0

CLOCK = RealClock()
HERE = "127.0.0.1"
OURS, VEHICLE = (245, 191), (1, 1)
WANTED = AttitudeThrust(load_vehicle("hummingbird").weight_N, from_yaw(0.3))
HEADING_RAD = 0.5 * math.pi - 0.3
"""The same, clockwise from north."""
HOVER = ThrustMap(0.5, 1.0, WANTED.thrust_N)


class Side(Protocol):
    """One of the libraries."""

    name: str

    def send(self) -> object:
        """One setpoint."""
        ...

    port: int
    """Where it listens."""

    async def taken_in(self, number: int) -> int:
        """Wait until so many attitudes more are parsed; how many were."""
        ...

    def close(self) -> None:
        """Give everything back."""
        ...


class Sky:
    """The socket at the other end: hears setpoints, sends attitudes."""

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((HERE, 0))
        self.socket.setblocking(False)
        self.port = int(self.socket.getsockname()[1])
        self._voices: dict[int, Message] = {}
        """By port: each side hears a vehicle that loses nothing."""

    def heartbeat(self, port: int) -> None:
        """Of a PX4, to one side."""
        self.send([self.packet(port, mavlink.MAVLink_heartbeat_message(2, 12, 1, 6 << 16, 4, 3))], port)

    def burst(self, port: int) -> list[bytes]:
        """Attitudes for one side."""
        return [
            self.packet(port, mavlink.MAVLink_attitude_quaternion_message(time_ms, 1.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.3))
            for time_ms in range(BURST)
        ]

    def packet(self, port: int, message: Message) -> bytes:
        """With the number that is next for one side."""
        voice = self._voices.setdefault(port, mavlink.MAVLink(None, *VEHICLE))
        data = bytes(message.pack(voice))
        voice.seq = (voice.seq + 1) % 256
        return data

    def send(self, packets: Sequence[bytes], port: int) -> None:
        """To one side."""
        for packet in packets:
            self.socket.sendto(packet, (HERE, port))

    def setpoints(self) -> int:
        """SET_ATTITUDE_TARGETs that came since the last time."""
        count = 0
        with contextlib.suppress(BlockingIOError):
            while data := self.socket.recv(2048):
                count += data[7:10] == setpoint_number()
        return count


def setpoint_number() -> bytes:
    """As it stands in a packet."""
    return int(mavlink.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET).to_bytes(3, "little")


class Ours:
    """The link's own parts, put together as `MavlinkLink` has them."""

    name = "ours"

    def __init__(self, transport: Udp) -> None:
        self._transport = transport
        self._session = Session(transport, Codec(*OURS), CLOCK, VEHICLE)
        self._picture = Picture("enu")
        self._session.listen(self._take)
        self._taken = 0
        self._outbox = Outbox()
        self._log: list[Transmission] = []

    async def open(self, sky: Sky) -> None:
        """Find the vehicle, and be ready to fly it."""
        await self._session.open()
        self.port = self._transport.port
        sky.heartbeat(self.port)
        while self._session.peer is None:
            await asyncio.sleep(0.01)
        self._outbox.ready(CLOCK.now_ns())

    def send(self) -> None:
        """What `MavlinkLink.send` does."""
        now_ns = CLOCK.now_ns()
        if not (WANTED.is_finite() and self._outbox.admits(now_ns, now_ns)):
            raise RuntimeError("a setpoint was not admitted")
        target = setpoint_wire.attitude_target(
            WANTED.q_WB, HOVER.share(WANTED.thrust_N), now_ns=now_ns, target=self._session.vehicle, frame="enu"
        )
        data = self._session.send(target)
        if data is not None:
            self._log.append(Transmission(now_ns, data.hex()))
            self._outbox.sent(now_ns, now_ns)

    async def taken_in(self, number: int) -> int:
        """By the event loop."""
        before, end_s = self._taken, time.monotonic() + PATIENCE_S
        while self._taken < before + number and time.monotonic() < end_s:
            await asyncio.sleep(0)
        return self._taken - before

    def close(self) -> None:
        """Close the socket."""
        self._session.close()

    def _take(self, message: Message, now_ns: int) -> None:
        self._picture.take(message, now_ns)
        self._taken += message.get_msgId() == mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION


class Mavutil:
    """pymavlink's connections: one that sends, one that listens."""

    name = "pymavlink mavutil"

    def __init__(self, sky: Sky) -> None:
        from pymavlink import mavutil

        self._to = mavutil.mavlink_connection(f"udpout:{HERE}:{sky.port}", source_system=245, source_component=191)
        self._from = mavutil.mavlink_connection(f"udpin:{HERE}:0", source_system=245, source_component=191)
        self.port = int(self._from.port.getsockname()[1])
        self._q = [math.cos(0.5 * HEADING_RAD), 0.0, 0.0, math.sin(0.5 * HEADING_RAD)]

    def send(self) -> None:
        """`set_attitude_target_send`."""
        now_ms = CLOCK.now_ns() // 1_000_000 % 2**32
        self._to.mav.set_attitude_target_send(now_ms, 1, 1, 7, self._q, 0.0, 0.0, 0.0, 0.5)

    async def taken_in(self, number: int) -> int:
        """`recv_match`, one by one."""
        heard = (self._from.recv_match(blocking=True, timeout=PATIENCE_S) for _ in range(number))
        return sum(one is not None and one.get_type() == "ATTITUDE_QUATERNION" for one in heard)

    def close(self) -> None:
        """Close both."""
        self._to.close()
        self._from.close()


class Mavsdk:
    """MAVSDK as a client of the vehicle."""

    name = "MAVSDK"

    def __init__(self, sky: Sky) -> None:
        import mavsdk
        from mavsdk.plugins.offboard import Attitude, Offboard
        from mavsdk.plugins.telemetry import Telemetry

        mavsdk.log_subscribe(lambda *_: True)
        kind = mavsdk.Configuration.create_with_component_type(mavsdk.ComponentType.COMPANION_COMPUTER)
        self._sdk = mavsdk.Mavsdk(kind)
        self.port = free_port()
        self._sdk.add_any_connection(f"udpin://{HERE}:{self.port}")
        sky.heartbeat(self.port)
        system = self._sdk.first_autopilot(PATIENCE_S)
        if system is None:
            raise RuntimeError("MAVSDK did not discover the vehicle")
        self._offboard, self._telemetry = Offboard(system), Telemetry(system)
        self._attitude = Attitude(0.0, 0.0, math.degrees(HEADING_RAD), 0.5)
        self._count, self._told = 0, threading.Condition()
        self._telemetry.subscribe_attitude_quaternion(self._take)

    def send(self) -> None:
        """`Offboard.set_attitude`."""
        self._offboard.set_attitude(self._attitude)

    async def taken_in(self, number: int) -> int:
        """Until the subscriber was told of the last one; it may have been told already."""
        with self._told:
            self._told.wait_for(lambda: self._count >= number, PATIENCE_S)
            count, self._count = self._count, 0
        return count

    def close(self) -> None:
        """End its threads."""
        self._sdk.destroy()

    def _take(self, _attitude: object, _data: object) -> None:
        with self._told:
            self._count += 1
            self._told.notify()


def free_port() -> int:
    """Of UDP, on this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind((HERE, 0))
        return int(probe.getsockname()[1])
