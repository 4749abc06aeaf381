"""What is known of the vehicle: its newest messages put together, in our frames and units. Pure."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping

from drivers.mavlink import frames_wire
from drivers.mavlink.autopilot import ARMED
from drivers.mavlink.dialect import Message, mavlink
from drivers.mavlink.options import Frame
from drivers.mavlink.status_text import StatusTexts
from lcd_flight.model import GRAVITY_M_PER_S2, Quaternion, Telemetry, Vector3
from lcd_flight.model.frames import normalized

REBOOT_MS = 1_000
"""The vehicle's own clock goes back by more: it was restarted."""
MILLI_G = 1e-3 * GRAVITY_M_PER_S2
"""Of RAW_IMU as ArduPilot fills it in."""
MAX_MESSAGES = 100
"""Kept until they are asked for: a vehicle may talk without end."""
_NOT_SENT = 0xFFFF
_PREARM = mavlink.MAV_SYS_STATUS_PREARM_CHECK
_AIRBORNE = {
    mavlink.MAV_LANDED_STATE_ON_GROUND: False,
    mavlink.MAV_LANDED_STATE_IN_AIR: True,
    mavlink.MAV_LANDED_STATE_TAKEOFF: True,
    mavlink.MAV_LANDED_STATE_LANDING: True,
}
_OUT_OF_HANDS = (mavlink.MAV_STATE_EMERGENCY, mavlink.MAV_STATE_FLIGHT_TERMINATION)
_FAILSAFE = (mavlink.MAV_STATE_CRITICAL, *_OUT_OF_HANDS)


class Picture:
    """Takes messages as they come."""

    def __init__(self, frame: Frame) -> None:
        self.stamp_ns: int | None = None
        """Arrival of the newest message that counts here."""
        self.heartbeats = 0
        self.heartbeat_ns: int | None = None
        self.kind: int | None = None
        """HEARTBEAT.autopilot"""
        self.custom_mode: int | None = None
        self.armed: bool | None = None
        self.failsafe = False
        """Whether its state is critical or worse."""
        self.terminated = False
        self.airborne: bool | None = None
        self.heard_status = False
        """Whether SYS_STATUS has come."""
        self.battery_V: float | None = None
        self.q_WB: Quaternion | None = None
        self.q_ns: int | None = None
        """Arrival of the newest attitude."""
        self.p_WB: Vector3 | None = None
        self.p_ns: int | None = None
        self.estimator_flags: int | None = None
        self.specific_force_B: Vector3 | None = None
        self.prearm_ok: bool | None = None
        """Its own checks; None where it does not say."""
        self.boot_ms: int | None = None
        """Its own clock."""
        self.restarts = 0
        self.version = ""
        self.has_origin = False
        self.texts = StatusTexts()
        self._frame: Frame = frame
        self._messages: deque[str] = deque(maxlen=MAX_MESSAGES)
        self._takes: Mapping[str, Callable[[Message, int], None]] = {
            "HEARTBEAT": self._take_heartbeat,
            "SYS_STATUS": self._take_status,
            "EXTENDED_SYS_STATE": self._take_landed_state,
            "ATTITUDE_QUATERNION": self._take_attitude,
            "LOCAL_POSITION_NED": self._take_position,
            "ESTIMATOR_STATUS": self._take_flags,
            "EKF_STATUS_REPORT": self._take_flags,
            "HIGHRES_IMU": lambda message, _: self._take_force(message, 1.0),
            "RAW_IMU": lambda message, _: self._take_force(message, MILLI_G),
            "AUTOPILOT_VERSION": self._take_version,
            "GPS_GLOBAL_ORIGIN": self._take_origin,
            "STATUSTEXT": self._take_text,
        }

    def take(self, message: Message, arrival_ns: int) -> None:
        """One message of the vehicle."""
        take = self._takes.get(message.get_type())
        if take is not None:
            self.stamp_ns = arrival_ns
            take(message, arrival_ns)

    def say(self, text: str) -> None:
        """Something for the log."""
        self._messages.append(text)

    def telemetry(self, *, now_ns: int, lost: bool) -> Telemetry | None:
        """All of it, None before the first message; text is told once. lost: whether it went out of our hands."""
        for text in self.texts.overdue(now_ns):
            self.say(text)
        if self.stamp_ns is None:
            return None
        messages = tuple(self._messages)
        self._messages.clear()
        return Telemetry(
            stamp_ns=self.stamp_ns,
            battery_V=self.battery_V,
            armed=self.armed,
            airborne=self.airborne,
            crashed=lost or self.terminated,
            status=self.custom_mode,
            q_WB=self.q_WB,
            p_WB=self.p_WB,
            specific_force_B=self.specific_force_B,
            messages=messages,
        )

    def _take_heartbeat(self, message: Message, arrival_ns: int) -> None:
        self.heartbeats += 1
        self.heartbeat_ns = arrival_ns
        self.kind, self.custom_mode = int(message.autopilot), int(message.custom_mode)
        self.armed = bool(message.base_mode & ARMED)
        self.failsafe = message.system_status in _FAILSAFE
        self.terminated = message.system_status in _OUT_OF_HANDS

    def _take_status(self, message: Message, _arrival_ns: int) -> None:
        self.heard_status = True
        if 0 < message.voltage_battery < _NOT_SENT:
            self.battery_V = message.voltage_battery * 1e-3
        if message.onboard_control_sensors_present & _PREARM:
            self.prearm_ok = bool(message.onboard_control_sensors_health & _PREARM)

    def _take_landed_state(self, message: Message, _arrival_ns: int) -> None:
        self.airborne = _AIRBORNE.get(message.landed_state)

    def _take_attitude(self, message: Message, arrival_ns: int) -> None:
        q = (message.q1, message.q2, message.q3, message.q4)
        try:
            self.q_WB = frames_wire.attitude_from(_wxyz(q), self._frame)
        except ValueError:  # not begun yet
            self.q_WB = None
        self.q_ns = arrival_ns
        self._note_clock(message.time_boot_ms)

    def _take_position(self, message: Message, arrival_ns: int) -> None:
        p = (message.x, message.y, message.z)
        self.p_WB = frames_wire.vector(p, self._frame) if all(map(math.isfinite, p)) else None
        self.p_ns = arrival_ns

    def _take_flags(self, message: Message, _arrival_ns: int) -> None:
        self.estimator_flags = int(message.flags)

    def _take_force(self, message: Message, unit: float) -> None:
        """unit: m/s^2."""
        force = (message.xacc * unit, message.yacc * unit, message.zacc * unit)
        if all(abs(part) < 100.0 * GRAVITY_M_PER_S2 for part in force):
            self.specific_force_B = frames_wire.body(force)

    def _take_version(self, message: Message, _arrival_ns: int) -> None:
        number = int(message.flight_sw_version)
        self.version = ".".join(str(number >> shift & 0xFF) for shift in (24, 16, 8))

    def _take_origin(self, _message: Message, _arrival_ns: int) -> None:
        self.has_origin = True

    def _take_text(self, message: Message, arrival_ns: int) -> None:
        for text in self.texts.take(message, arrival_ns):
            self.say(text)

    def _note_clock(self, boot_ms: int) -> None:
        if self.boot_ms is not None and boot_ms < self.boot_ms - REBOOT_MS:
            self.restarts += 1
            self.has_origin = False
            self.say("the autopilot was restarted")
        self.boot_ms = boot_ms


def _wxyz(q: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    """At unit length.

    Raises:
        ValueError: it is no rotation.
    """
    w, x, y, z = q
    x, y, z, w = normalized((x, y, z, w))
    return (w, x, y, z)
