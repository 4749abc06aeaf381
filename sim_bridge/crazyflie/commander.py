"""Setpoints as the firmware takes them: who may set them, the thrust lock, and what the fields mean.

Source: crazyflie-firmware 2026.08, src/modules/src/commander.c (priorities), crtp_commander_rpyt.c (thrust lock and
limits), crtp_commander_generic.c (stop, manual), crtp_commander.c (notify). Angles here are the firmware's: degrees,
roll right-hand about x, PITCH POSITIVE NOSE UP, yaw counter-clockwise.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

from sim_bridge.crazyflie.crtp import Packet, Port

SMALLEST_THRUST = 1000
LARGEST_THRUST = 60000
STOP, MANUAL = 0, 11
_RPYT = struct.Struct("<fffH")
_MANUAL = struct.Struct("<BfffHB")
_SETPOINT, _META = 0, 1
_PID_CONTROLLERS = (0, 1)
"""Automatic choice, and by name."""


class Modes(Protocol):
    """Parameters by full name."""

    def __getitem__(self, name: str) -> float:
        """A value."""
        ...


class Priority(IntEnum):
    """Who set the setpoint that holds; a lower one cannot replace it."""

    DISABLED = 0
    LOWEST = 1
    GUIDANCE = 2
    """The onboard high-level commander."""
    CRTP = 3


@dataclass(frozen=True, slots=True)
class Setpoint:
    """What the controller is asked for."""

    thrust: int = 0
    """Counts; 0 stops the motors."""
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    """Nose up."""
    yaw_deg: float | None = None
    """Absolute; None: yaw is a rate."""
    yaw_rate_deg_s: float = 0.0
    """Counter-clockwise."""


NOTHING = Setpoint()


class Commander:
    """One vehicle's; `said` collects what it prints."""

    def __init__(self) -> None:
        self._priority = Priority.DISABLED
        self._thrust_locked = True
        self._guidance_stopped = False
        self._complained = False
        self.setpoint = NOTHING
        self.stamp_ms = 0
        """When the setpoint came."""
        self.said: list[str] = []

    def take(self, packet: Packet, parameters: Modes, now_ms: int) -> None:
        """A packet on one of the two commander ports."""
        if parameters["stabilizer.controller"] not in _PID_CONTROLLERS:
            self._complain("setpoints while stabilizer.controller is not the PID")
        elif packet.port == Port.COMMANDER:
            if packet.channel == _SETPOINT and len(packet.payload) >= _RPYT.size:
                self._rpyt(packet.payload, parameters, now_ms)
        elif packet.channel == _META:
            if packet.payload[:1] == b"\0":
                self._notify()
        elif packet.channel == _SETPOINT and packet.payload:
            self._generic(packet.payload, now_ms)

    def guide(self, now_ms: int) -> None:
        """The onboard high-level commander, at 100 Hz: stopped by the first low-level setpoint, it wants motors off."""
        if self._guidance_stopped and self._priority <= Priority.GUIDANCE:
            self._set(NOTHING, Priority.GUIDANCE, now_ms)

    def _rpyt(self, payload: bytes, parameters: Modes, now_ms: int) -> None:
        roll, pitch, yaw, thrust = _RPYT.unpack_from(payload)
        if self._priority is Priority.DISABLED:
            self._thrust_locked = True
        if thrust == 0:
            self._thrust_locked = False
        angles = parameters["flightmode.stabModeRoll"] and parameters["flightmode.stabModePitch"]
        if not (angles and all(map(math.isfinite, (roll, pitch, yaw)))):
            self._complain("a setpoint that is not finite, or rates of roll and pitch")
            return
        counts = 0 if self._thrust_locked or thrust < SMALLEST_THRUST else min(thrust, LARGEST_THRUST)
        if parameters["flightmode.stabModeYaw"]:
            setpoint = Setpoint(counts, roll, pitch, yaw_deg=yaw)
        else:
            setpoint = Setpoint(counts, roll, pitch, yaw_rate_deg_s=-yaw)
        self._set(setpoint, Priority.CRTP, now_ms)

    def _generic(self, payload: bytes, now_ms: int) -> None:
        if payload[0] == STOP:
            self._set(NOTHING, Priority.CRTP, now_ms)
        elif payload[0] == MANUAL and len(payload) >= _MANUAL.size:
            self._manual(payload, now_ms)
        else:
            self._complain(f"generic setpoints of type {payload[0]}")

    def _manual(self, payload: bytes, now_ms: int) -> None:
        _, roll, pitch, yaw_rate, thrust, rates = _MANUAL.unpack_from(payload)
        if rates or not all(map(math.isfinite, (roll, pitch, yaw_rate))):
            self._complain("a manual setpoint that is not finite, or rates of roll and pitch")
            return
        self._set(Setpoint(thrust, roll, pitch, None, yaw_rate), Priority.CRTP, now_ms)

    def _notify(self) -> None:
        """Low-level setpoints are over: whoever comes next may set one, the high-level commander too."""
        self._priority = Priority.LOWEST

    def _set(self, setpoint: Setpoint, priority: Priority, now_ms: int) -> None:
        if priority < self._priority:
            return
        self.setpoint, self.stamp_ms, self._priority = setpoint, now_ms, priority
        if priority > Priority.GUIDANCE:
            self._guidance_stopped = True

    def _complain(self, what: str) -> None:
        """Once: what is ignored here would be flown by a real vehicle."""
        if not self._complained:
            self._complained = True
            self.said.append(f"SIM: not simulated, ignored: {what}\n")
