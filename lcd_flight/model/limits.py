"""The limits that a flight is judged against; a mission sets them, the monitors read them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from lcd_flight.model.types import Vector3


@dataclass(frozen=True, slots=True)
class Geofence:
    """A box to stay inside, m, world frame."""

    low_m: Vector3
    high_m: Vector3

    def clearance_m(self, p_W: Vector3) -> float:
        """Distance to the nearest wall; negative outside. The floor counts only below `low_m`."""
        return min(min(p - low, high - p) for p, low, high in zip(p_W, self.low_m, self.high_m, strict=True))


@dataclass(frozen=True, slots=True)
class SafetyLimits:
    """What the monitors compare with."""

    geofence: Geofence
    max_position_error_m: float = 1.5
    """Tracking error at which the flight lands at once (the paper's crash bound)."""
    brake_position_error_m: float = 0.75
    pose_timeout_s: float = 0.3
    """Without a valid pose for so long: level descent."""
    pose_coast_s: float = 0.05
    """From here on without pose: brake."""
    on_mocap_lost: Literal["land", "cut"] = "land"
    on_battery_critical: Literal["land", "warn"] = "land"
    battery_takeoff_V: float = 3.8
    battery_warning_V: float = 3.2
    battery_critical_V: float = 3.0
    battery_debounce_s: float = 2.0
    link_timeout_s: float = 0.1
    expected_pose_rate_hz: float = 100.0
    initial_position_tolerance_m: float = 0.1
