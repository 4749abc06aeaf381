"""What somebody else sends on the vehicle's way: another vehicle's heartbeats, forged packets, old ones again."""

from __future__ import annotations

from collections import deque

from pymavlink.dialects.v20 import common

from sim_bridge.mavlink.codec import Codec
from sim_bridge.mavlink.framing import SIGNED
from sim_bridge.mavlink.signing import Signatures

MOST_KEPT = 50
"""Packets that are kept to be sent again."""
EVERY_NS = 200_000_000
FUTURE_TICKS = 100_000 * 86_400 * 365
"""A year ahead: a receiver that believes a time stamp before its signature is locked out by it."""
WRONG_KEY = bytes(range(32))


class Intruder:
    """Between one vehicle and its client."""

    def __init__(self, system: int, foreign_system: int) -> None:
        self._forger = Codec(system, 1, Signatures(WRONG_KEY, accepts_unsigned=False))
        self._foreign = Codec(foreign_system, 1, Signatures(None, accepts_unsigned=True)) if foreign_system else None
        self._kept: deque[bytes] = deque(maxlen=MOST_KEPT)
        self._due_ns = 0

    def overhear(self, datagram: bytes) -> None:
        """Keep what is signed."""
        if len(datagram) > 2 and datagram[2] & SIGNED:
            self._kept.append(datagram)

    def sends(self, now_ns: int, now_ticks: int, *, forges: bool, replays: bool) -> list[bytes]:
        """What it puts in now: five times a second."""
        if now_ns < self._due_ns:
            return []
        self._due_ns = now_ns + EVERY_NS
        packets = []
        if self._foreign is not None:
            packets.append(self._foreign.encode(_heartbeat(0), now_ticks))
        if forges:
            packets.append(self._forger.encode(_heartbeat(0), now_ticks + FUTURE_TICKS))
        if replays and self._kept:
            packets.append(self._kept[0])
        return packets


def _heartbeat(mode: int) -> common.MAVLink_heartbeat_message:
    """Of a vehicle that is disarmed, in a mode that means nothing."""
    return common.MAVLink_heartbeat_message(
        common.MAV_TYPE_QUADROTOR, common.MAV_AUTOPILOT_PX4, 1, mode, common.MAV_STATE_STANDBY, 3
    )
