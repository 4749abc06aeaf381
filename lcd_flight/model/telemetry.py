"""What comes back: from the vehicle over the link, and from motion capture."""

from __future__ import annotations

from dataclasses import dataclass

from lcd_flight.model.state import State
from lcd_flight.model.types import Quaternion, Vector3


@dataclass(frozen=True, slots=True)
class Telemetry:
    """The newest of what the vehicle reported; None where it never did."""

    stamp_ns: int
    """Host's monotonic time of arrival of the newest part."""
    battery_V: float | None = None
    armed: bool | None = None
    airborne: bool | None = None
    crashed: bool | None = None
    """Tumbled, locked or otherwise out of our hands."""
    status: int | None = None
    """Status word as the vehicle sent it; what its bits mean stands in the documentation of the link."""
    q_WB: Quaternion | None = None
    """Onboard attitude estimate."""
    p_WB: Vector3 | None = None
    """Onboard position estimate in m."""
    specific_force_B: Vector3 | None = None
    """What the accelerometers measure, m/s^2: at rest, gravity upwards."""
    motor_shares: tuple[float, ...] | None = None
    """Motor commands as shares of full scale, 0 to 1."""
    messages: tuple[str, ...] = ()
    """Text that arrived since the last report."""


@dataclass(frozen=True, slots=True)
class Transmission:
    """One packet that went to the vehicle."""

    stamp_ns: int
    """Host's monotonic time at which it was handed to the driver."""
    packet: str
    """Its bytes, hexadecimal."""


@dataclass(frozen=True, slots=True)
class LinkReport:
    """What a link knows of itself at a tick. Counters run from connecting."""

    connected: bool
    age_ns: int | None
    """Since the newest packet from the vehicle; None before the first."""
    sent: int = 0
    received: int = 0
    lost: int = 0
    stale: int = 0
    """Setpoints refused: older than 50 ms, older than one sent before, or not finite."""
    loss_share: float = 0.0
    """Lost packets as a share, over the last second."""
    fallback_active: bool = False
    """Whether the link is flying its own fallback for want of a fresh setpoint."""
    quality: float | None = None
    """Share of radio packets that were acknowledged without being repeated, where there is a radio."""
    taken_over: str = ""
    """Who flies in our place, e.g. `the pilot took over: mode POSCTL`; for good. Empty while nobody does."""
    flown_by_pilot: bool | None = None
    """Whether who took over is a person, and not the vehicle's own failsafe; None while nobody did."""
    transmitted: tuple[Transmission, ...] = ()
    """Setpoints that went out since the last report, byte for byte, where the link can tell."""
    telemetry: Telemetry | None = None


@dataclass(frozen=True, slots=True)
class RawPose:
    """One frame as motion capture sent it, in the world frame."""

    sequence: int
    source_stamp_ns: int
    """The source's own clock."""
    arrival_ns: int
    """Host's monotonic clock."""
    p_WB: Vector3
    q_WB: Quaternion
    v_WB_W: Vector3 | None = None
    """Twist, where the source has one."""
    w_WB_B: Vector3 | None = None


@dataclass(frozen=True, slots=True)
class PoseReport:
    """The filtered pose at a tick and the health of its source. Counters run from opening."""

    state: State | None
    """Filtered, brought forward to the tick; None while there is no valid pose."""
    age_ns: int | None
    """Since the newest accepted frame's arrival; None before the first."""
    raw: RawPose | None = None
    """The newest accepted frame."""
    rate_hz: float = 0.0
    """Accepted frames over the last second."""
    received: int = 0
    lost: int = 0
    """Gaps in the sequence."""
    late: int = 0
    rejected: int = 0
    """Failed the gate: jump, flip, not finite, not unit."""
    reject_reason: str = ""
    """Of the newest rejected frame."""
