"""PX4 1.14 and later: OFFBOARD. Sources: PX4's parameter reference, commander and mavlink_receiver."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field

from drivers.mavlink.autopilot import Requirement, at_most, has_bits, is_value, missing_flags
from drivers.mavlink.dialect import mavlink
from lcd_flight.model import LinkLossPolicy

_MAIN = {1: "MANUAL", 2: "ALTCTL", 3: "POSCTL", 4: "AUTO", 5: "ACRO", 6: "OFFBOARD", 7: "STABILIZED", 8: "RATTITUDE"}
_AUTO = {1: "READY", 2: "TAKEOFF", 3: "LOITER", 4: "MISSION", 5: "RTL", 6: "LAND", 8: "FOLLOW", 9: "PRECLAND"}
_AUTO_MAIN = 4
_OFFBOARD, _LAND = 6 << 16, _AUTO_MAIN << 16 | 6 << 24

READY_FLAGS = 0x2F
"""Attitude, horizontal and vertical velocity, relative horizontal and absolute vertical position (ESTIMATOR_STATUS)."""
BAD_FLAGS = 0x80
"""Constant position mode: it is not aided."""
LANDS, TERMINATES = 4, 6
"""Values of COM_OBL_RC_ACT."""

_ALWAYS = (
    at_most("COM_OF_LOSS_T", 0.5, "s; so long it goes on with the last setpoint after the stream has stopped"),
    is_value("MAV_FWDEXTSP", 1, "setpoints from outside are passed on"),
    has_bits("EKF2_EV_CTRL", 0b1011, 15, "external position, height and heading are fused"),
    is_value("EKF2_HGT_REF", 3, "the height is motion capture's", restart=True),
    is_value("EKF2_GPS_CTRL", 0, "no GPS beside motion capture"),
)


@dataclass(frozen=True, slots=True)
class Px4:
    """`drivers.mavlink.autopilot.Autopilot`."""

    name: str = "PX4"
    kind: int = mavlink.MAV_AUTOPILOT_PX4
    flight_mode: int = _OFFBOARD
    land_mode: int = _LAND
    intervals_hz: Mapping[int, float] = field(
        default_factory=lambda: {mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS: 5.0, mavlink.MAVLINK_MSG_ID_HIGHRES_IMU: 10.0}
    )
    hover_parameter: str = "MPC_THR_HOVER"
    thrust_slope: float = 1.0
    motors_off_s: float = 1.0
    """COM_SPOOLUP_TIME as it comes."""
    ramp_s: float = 0.0
    settles_s: float = 5.0
    wants_origin: bool = False

    def requirements(self, on_link_lost: LinkLossPolicy) -> tuple[Requirement, ...]:
        """What it does when the stream stops depends on `on_link_lost`: it lands, or stops the motors."""
        value, does = (TERMINATES, "cuts its motors") if on_link_lost == "cut" else (LANDS, "lands")
        return (*_ALWAYS, is_value("COM_OBL_RC_ACT", value, f"it {does} when the stream has stopped"))

    def flies_alone_in(self, custom_mode: int) -> bool:
        """Any AUTO mode."""
        return custom_mode >> 16 & 0xFF == _AUTO_MAIN

    def mode_name(self, custom_mode: int) -> str:
        """By main and sub mode (px4_custom_mode.h)."""
        main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF
        name = _MAIN.get(main, f"{main}")
        return f"{name}.{_AUTO.get(sub, sub)}" if main == _AUTO_MAIN else name

    def mode_command(self, custom_mode: int) -> tuple[float, float, float]:
        """Custom mode enabled, main, sub."""
        return (1.0, float(custom_mode >> 16 & 0xFF), float(custom_mode >> 24 & 0xFF))

    def estimate_objection(self, flags: int | None) -> str:
        """By ESTIMATOR_STATUS."""
        if flags is None:
            return "it does not report its estimator (ESTIMATOR_STATUS)"
        return missing_flags(flags, READY_FLAGS, BAD_FLAGS)

    def value_from(self, wire: float, kind: int) -> float:
        """PX4 puts the bytes of an integer into the float."""
        if kind == mavlink.MAV_PARAM_TYPE_REAL32:
            return wire
        return float(struct.unpack("<i", struct.pack("<f", wire))[0])

    def value_to(self, value: float, kind: int) -> float:
        """And takes them so."""
        if kind == mavlink.MAV_PARAM_TYPE_REAL32:
            return value
        return float(struct.unpack("<f", struct.pack("<i", round(value)))[0])
