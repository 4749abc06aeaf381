"""A conversation with one vehicle: what it says is taken from it alone, counted, and handed on.

The vehicle is pinned: its system and component id by configuration, its address by its first valid heartbeat (or by an
allow-list before that). Whatever anybody else sends is counted and has no effect.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from drivers.mavlink.codec import TOO_OLD, Codec
from drivers.mavlink.dialect import Message, mavlink
from drivers.mavlink.peer import Peer
from drivers.mavlink.sequence import LossCounter
from drivers.mavlink.transport import Transport
from lcd_flight.model import Clock

HEARTBEAT_NS = 1_000_000_000
MOVED_NS = 2_000_000_000
"""A pinned address that has been silent for so long may be another port of the same host: the autopilot restarted."""
MAX_STRANGERS = 16
"""Others whose names are kept."""

Listener = Callable[[Message, int], None]
"""Told of every message of the vehicle, with its arrival."""


class Session:
    """Sends to the vehicle, hears it, answers its TIMESYNC."""

    def __init__(
        self,
        transport: Transport,
        codec: Codec,
        clock: Clock,
        vehicle: tuple[int, int],
        hosts: frozenset[str] = frozenset(),
    ) -> None:
        """vehicle: its system and component id. hosts: addresses it may have; empty: any."""
        self.vehicle = vehicle
        self.newest_ns: int | None = None
        """Arrival of the vehicle's newest packet."""
        self.losses = LossCounter()
        self.strangers: Counter[str] = Counter()
        """Packets of others, by who they were."""
        self.rejected = codec.rejected
        self._transport, self._codec, self._clock, self._hosts = transport, codec, clock, hosts
        self._peer: Peer | None = None
        self._buffer = bytearray()
        self._listeners: list[Listener] = []
        self._heartbeat_ns = self._told_ns = -HEARTBEAT_NS

    async def open(self) -> None:
        """Begin to listen.

        Raises:
            RefusedError: the transport is not to be had.
        """
        await self._transport.open(self._receive)

    def close(self) -> None:
        """Close the transport."""
        self._transport.close()

    @property
    def peer(self) -> Peer | None:
        """Where the vehicle is; None before its first heartbeat."""
        return self._peer

    @property
    def faults(self) -> int:
        """Packets that could not be sent."""
        return self._transport.faults

    @property
    def newest_stamp(self) -> int:
        """The signing timestamp below which no packet may be from now on."""
        return self._codec.newest_stamp(self._clock.now_ns())

    def listen(self, listener: Listener) -> None:
        """Tell `listener` of every message of the vehicle from now on."""
        self._listeners.append(listener)

    def send(self, message: Message) -> bytes | None:
        """Send one message; its bytes, or None where it did not go out. A setpoint never waits behind older bytes."""
        data = self._codec.encode(message, self._clock.now_ns())
        perishes = message.get_msgId() == mavlink.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET
        hand_over = self._transport.send_now if perishes else self._transport.send
        return data if hand_over(data, self._peer) else None

    def beat(self, now_ns: int) -> None:
        """Our heartbeat, once a second."""
        if now_ns - self._heartbeat_ns >= HEARTBEAT_NS:
            self._heartbeat_ns = now_ns
            self.send(_heartbeat())

    def _receive(self, data: bytes, peer: Peer) -> None:
        if not self._admits(peer):
            self._strange(f"the address {peer[0]}")
            return
        now_ns = self._clock.now_ns()
        self._buffer += data
        too_old = self.rejected[TOO_OLD]
        for message in self._codec.decode(self._buffer):
            self._take(message, peer, now_ns)
        if not self._transport.stream:  # a datagram holds whole packets
            self._buffer.clear()
        if peer != self._peer and self.rejected[TOO_OLD] > too_old:
            self._tell_time(peer, now_ns)

    def _admits(self, peer: Peer) -> bool:
        if self._transport.called not in (None, peer[0]):
            return False
        if self._peer is None:
            return not self._hosts or peer[0] in self._hosts
        return peer == self._peer or (peer[0] == self._peer[0] and self._is_silent())

    def _is_silent(self) -> bool:
        return self.newest_ns is None or self._clock.now_ns() - self.newest_ns > MOVED_NS

    def _take(self, message: Message, peer: Peer, now_ns: int) -> None:
        if (message.get_srcSystem(), message.get_srcComponent()) != self.vehicle:
            if message.get_msgId() == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                self._strange(f"system {message.get_srcSystem()}, component {message.get_srcComponent()}")
            return
        if peer != self._peer:
            if message.get_msgId() != mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                return
            self._peer = peer
        self.newest_ns = now_ns
        if not self.losses.take(message.get_seq(), now_ns):
            return
        if message.get_msgId() == mavlink.MAVLINK_MSG_ID_TIMESYNC:
            self._answer_time(message, now_ns)
        for listener in self._listeners:
            listener(message, now_ns)

    def _answer_time(self, message: Message, now_ns: int) -> None:
        """tc1 is 0 in a question; its answer holds our clock, the one that poses are stamped with."""
        if message.tc1 == 0:
            self.send(mavlink.MAVLink_timesync_message(now_ns, message.ts1))

    def _tell_time(self, peer: Peer, now_ns: int) -> None:
        """Our signed heartbeat to one that has the key and an old clock, as boards without a battery have."""
        if now_ns - self._told_ns >= HEARTBEAT_NS:
            self._told_ns = now_ns
            self._transport.send(self._codec.encode(_heartbeat(), now_ns), peer)

    def _strange(self, who: str) -> None:
        if who in self.strangers or len(self.strangers) < MAX_STRANGERS:
            self.strangers[who] += 1


def _heartbeat() -> Message:
    """An onboard computer that is at work."""
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, 3
    )
