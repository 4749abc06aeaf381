"""ArduCopter 4.5 and later: GUIDED, GUIDED_NOGPS. Sources: its parameter list, and flights of 4.6."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivers.mavlink.autopilot import Requirement, at_most, cannot_cut, has_bits, is_value, missing_flags
from drivers.mavlink.dialect import mavlink
from lcd_flight.model import LinkLossPolicy

_MODES = {
    0: "STABILIZE", 1: "ACRO", 2: "ALT_HOLD", 3: "AUTO", 4: "GUIDED", 5: "LOITER", 6: "RTL", 7: "CIRCLE", 9: "LAND",
    11: "DRIFT", 13: "SPORT", 15: "AUTOTUNE", 16: "POSHOLD", 17: "BRAKE", 18: "THROW", 20: "GUIDED_NOGPS",
    21: "SMART_RTL", 22: "FLOWHOLD", 23: "FOLLOW",
}  # fmt: skip
_GUIDED, _LAND, _GUIDED_NOGPS = 4, 9, 20
_ALONE = frozenset({3, 6, 9, 17, 21})
"""AUTO, RTL, LAND, BRAKE, SMART_RTL: what its failsafes enter."""
_FLIGHT = {"guided": _GUIDED, "guided_nogps": _GUIDED_NOGPS}

READY_FLAGS = 0x33F
"""Attitude, velocities, positions relative and absolute, and predicted (EKF_STATUS_REPORT)."""
BAD_FLAGS = 0x80
"""Constant position mode: it is not aided."""
EXTERNAL = 6
"""Value of the EK3_SRC1 parameters."""

_REQUIRED = (
    has_bits("GUID_OPTIONS", 8, 8, "thrust is thrust; without it 0.5 holds the height and more climbs"),
    at_most("GUID_TIMEOUT", 0.5, "s; so long it goes on with the last setpoint after the stream has stopped"),
    is_value("VISO_TYPE", 1, "external poses by MAVLink", restart=True),
    is_value("EK3_SRC1_POSXY", EXTERNAL, "the position is motion capture's", restart=True),
    is_value("EK3_SRC1_VELXY", EXTERNAL, "the velocity is motion capture's", restart=True),
    is_value("EK3_SRC1_POSZ", EXTERNAL, "the height is motion capture's", restart=True),
    is_value("EK3_SRC1_VELZ", EXTERNAL, "the vertical velocity is motion capture's", restart=True),
    is_value("EK3_SRC1_YAW", EXTERNAL, "the heading is motion capture's", restart=True),
)


@dataclass(frozen=True, slots=True)
class ArduPilot:
    """`drivers.mavlink.autopilot.Autopilot`."""

    mode: str = "guided"
    name: str = "ArduPilot"
    kind: int = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
    land_mode: int = _LAND
    intervals_hz: Mapping[int, float] = field(
        default_factory=lambda: {mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT: 5.0, mavlink.MAVLINK_MSG_ID_RAW_IMU: 10.0}
    )
    hover_parameter: str = "MOT_THST_HOVER"
    thrust_slope: float = 0.87
    motors_off_s: float = 2.1
    """2.0 s, as seen in flight."""
    ramp_s: float = 0.6
    """0.5 s (MOT_SPOOL_TIME); at no thrust its motors would stay at ground idle."""
    settles_s: float = 25.0
    wants_origin: bool = True

    @property
    def flight_mode(self) -> int:
        """Of the mode that the options name."""
        return _FLIGHT[self.mode]

    def requirements(self, on_link_lost: LinkLossPolicy) -> tuple[Requirement, ...]:
        """The same for every flight.

        Raises:
            RefusedError: its motors are to be cut when the link is lost, which it cannot do.
        """
        if on_link_lost == "cut":
            raise cannot_cut(self.name)
        return _REQUIRED

    def flies_alone_in(self, custom_mode: int) -> bool:
        """As its failsafes choose."""
        return custom_mode in _ALONE

    def mode_name(self, custom_mode: int) -> str:
        """By number (ArduCopter's mode.h)."""
        return _MODES.get(custom_mode, f"{custom_mode}")

    def mode_command(self, custom_mode: int) -> tuple[float, float, float]:
        """Custom mode enabled, mode."""
        return (1.0, float(custom_mode), 0.0)

    def estimate_objection(self, flags: int | None) -> str:
        """By EKF_STATUS_REPORT."""
        if flags is None:
            return "it does not report its estimator (EKF_STATUS_REPORT)"
        return missing_flags(flags, READY_FLAGS, BAD_FLAGS)

    def value_from(self, wire: float, _kind: int) -> float:
        """ArduPilot sends the number itself, whatever its type."""
        return wire

    def value_to(self, value: float, _kind: int) -> float:
        """And takes it so."""
        return value
