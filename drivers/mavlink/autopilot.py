"""What PX4 and ArduPilot do not have in common, as one interface; `px4.py` and `ardupilot.py` fill it in."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from drivers.mavlink.dialect import mavlink
from drivers.mavlink.options import MavlinkOptions
from lcd_flight.model import LinkLossPolicy, RefusedError

ARMED = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
INTERVALS_HZ: Mapping[int, float] = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: 10.0,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 50.0,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 50.0,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: 5.0,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 10.0,
}
"""What every autopilot is asked for. The heartbeat shows a pilot's change of mode: where it may not come faster, within
a second."""


@dataclass(frozen=True, slots=True)
class Requirement:
    """One parameter, and what it must be."""

    name: str
    value: float
    """What to set it to."""
    fits: Callable[[float], bool]
    rule: str
    """`fits` in words, e.g. `at most 0.5`."""
    why: str
    restart: bool = False
    """Whether a change counts after a restart only."""


def is_value(name: str, value: float, why: str, *, restart: bool = False) -> Requirement:
    """A parameter that must be just this."""
    return Requirement(name, value, lambda found: abs(found - value) < 1e-6, f"{value:g}", why, restart)


def at_most(name: str, value: float, why: str) -> Requirement:
    """A parameter that must be above zero and no more than this."""
    return Requirement(name, value, lambda found: 0.0 < found <= value + 1e-6, f"at most {value:g}", why)


def has_bits(name: str, bits: int, value: int, why: str) -> Requirement:
    """A parameter in which bits must be set."""
    return Requirement(name, value, lambda found: int(found) & bits == bits, f"with the bits of {bits}", why)


class Autopilot(Protocol):
    """One flavour."""

    @property
    def name(self) -> str:
        """For a person."""
        ...

    @property
    def kind(self) -> int:
        """HEARTBEAT.autopilot."""
        ...

    @property
    def flight_mode(self) -> int:
        """custom_mode of the mode that takes our setpoints."""
        ...

    @property
    def land_mode(self) -> int:
        """custom_mode of the mode that lands by itself."""
        ...

    @property
    def intervals_hz(self) -> Mapping[int, float]:
        """Message ids to ask for, beside `INTERVALS_HZ`."""
        ...

    @property
    def hover_parameter(self) -> str:
        """Name of the parameter that says at what thrust it hovers."""
        ...

    @property
    def thrust_slope(self) -> float:
        """`ThrustMap.slope` where nobody says otherwise."""
        ...

    @property
    def motors_off_s(self) -> float:
        """So long after arming the motors take no thrust."""
        ...

    @property
    def ramp_s(self) -> float:
        """So long they then come up, from the first thrust on; 0 where they come at once."""
        ...

    @property
    def settles_s(self) -> float:
        """So long after a boot its sensors settle and it will not arm."""
        ...

    @property
    def wants_origin(self) -> bool:
        """Whether its estimate needs to be told where on earth it is."""
        ...

    def flies_alone_in(self, custom_mode: int) -> bool:
        """Whether a mode is one of those in which its failsafes fly, and not a pilot's sticks."""
        ...

    def requirements(self, on_link_lost: LinkLossPolicy) -> tuple[Requirement, ...]:
        """Parameters without which it is not flown.

        Raises:
            RefusedError: it cannot do what is asked for when the link is lost.
        """
        ...

    def mode_name(self, custom_mode: int) -> str:
        """For a person, e.g. `OFFBOARD`."""
        ...

    def mode_command(self, custom_mode: int) -> tuple[float, float, float]:
        """The first three parameters of DO_SET_MODE (176)."""
        ...

    def estimate_objection(self, flags: int | None) -> str:
        """What its estimator's own flags say against flying; empty where nothing. flags: None before the first."""
        ...

    def value_from(self, wire: float, kind: int, /) -> float:
        """A parameter's value as PARAM_VALUE brought it, by its MAV_PARAM_TYPE."""
        ...

    def value_to(self, value: float, kind: int, /) -> float:
        """The same for PARAM_SET."""
        ...


def missing_flags(flags: int, wanted: int, unwanted: int) -> str:
    """The estimator's flags that are not as they should be, by name; empty where all are."""
    names = mavlink.enums["EKF_STATUS_FLAGS"]
    absent = [_flag(names[bit].name) for bit in sorted(names) if bit & wanted & ~flags]
    present = [_flag(names[bit].name) for bit in sorted(names) if bit & unwanted & flags]
    parts = [f"no {', '.join(absent)}"] if absent else []
    parts += [", ".join(present)] if present else []
    return "; ".join(parts)


def _flag(name: str) -> str:
    return str(name).removeprefix("EKF_").lower().replace("_", " ")


def flavour(options: MavlinkOptions) -> Autopilot:
    """The autopilot that the options name."""
    from drivers.mavlink.ardupilot import ArduPilot
    from drivers.mavlink.px4 import Px4

    return Px4() if options.autopilot == "px4" else ArduPilot(options.mode)


def kind_name(kind: int) -> str:
    """Which autopilot HEARTBEAT.autopilot names, for a person."""
    names = {mavlink.MAV_AUTOPILOT_PX4: "PX4", mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA: "ArduPilot"}
    return names.get(kind, f"autopilot {kind}")


def cannot_cut(name: str) -> RefusedError:
    """Motors off at a lost link is not to be had."""
    return RefusedError(f"{name} cannot cut its motors when the link is lost: leave safety.on_link_lost at vehicle")
