"""The phases of a flight. What leads from one to another stands in one table: `lcd_flight.flight.phases`."""

from __future__ import annotations

from enum import StrEnum


class Phase(StrEnum):
    """Where a flight stands. The order of the abnormal ones is their severity."""

    IDLE = "idle"
    PREFLIGHT = "preflight"
    READY = "ready"
    ARMED = "armed"
    TAKEOFF = "takeoff"
    HOLD = "hold"
    TRACK = "track"
    LAND = "land"
    LANDED = "landed"
    BRAKE_HOLD = "brake_hold"
    """A soft fault, pose and link good: stop where it is; too long leads to LAND_NOW."""
    LAND_NOW = "land_now"
    """Descend from where it is, under position control."""
    DESCEND_BLIND = "descend_blind"
    """No valid pose: level, slightly below hover thrust, for a stated time."""
    HANDED_OVER = "handed_over"
    """The pilot, or the vehicle by itself, flies from here on: nothing is sent any more."""
    KILL = "kill"
    """Motors stopped; latched."""
    CRASHED = "crashed"
    """Reported by the vehicle (tumbled, locked): adopted, never re-armed by itself."""

    @property
    def airborne(self) -> bool:
        """Whether motors are expected to carry the vehicle."""
        return self in _AIRBORNE

    @property
    def over(self) -> bool:
        """Whether the flight is finished."""
        return self in (Phase.LANDED, Phase.HANDED_OVER, Phase.KILL, Phase.CRASHED)


_AIRBORNE = frozenset(
    {
        Phase.TAKEOFF,
        Phase.HOLD,
        Phase.TRACK,
        Phase.LAND,
        Phase.BRAKE_HOLD,
        Phase.LAND_NOW,
        Phase.DESCEND_BLIND,
    }
)
