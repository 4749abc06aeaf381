"""What autopilot, commands and services say to each other."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from sim_bridge.mavlink.frames import Hamilton

NS_PER_S = 1e9
CRITICAL, WARNING, INFO = 2, 4, 6
"""MAV_SEVERITY"""


class Result(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5


@dataclass(frozen=True, slots=True)
class AttitudeTarget:
    """A SET_ATTITUDE_TARGET that was taken."""

    attitude: Hamilton
    thrust: float
    """0 to 1."""
    came_ns: int


@dataclass(frozen=True, slots=True)
class Setup:
    """How a vehicle of a flavour is to be."""

    hover_thrust: float
    """At which it truly hovers, 0 to 1."""
    boot_s: float
    """Until it can be armed."""
    rc: bool
    """Whether a remote control is on."""
