"""A flight plan: what a mission becomes once its trajectories are planned."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from lcd_flight.model.trajectory import Trajectory
from lcd_flight.model.types import FloatArray, Vector3


class LegKind(StrEnum):
    """What a leg is for; it decides the phase while it is flown."""

    TAKEOFF = "takeoff"
    HOLD = "hold"
    TRANSFER = "transfer"
    """From a hover to the first waypoint, or from the last one to above the landing; ends when settled."""
    TRAJECTORY = "trajectory"
    LAND = "land"


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """One part of a flight plan."""

    kind: LegKind
    trajectory: Trajectory
    waypoints: FloatArray | None = None
    """(K, 4) x, y, z in m and yaw in rad, of a TRAJECTORY leg."""
    settle: bool = False
    """Whether the next leg waits at this one's end until the vehicle has settled."""
    baseline: Trajectory | None = None
    """The minimum-snap plan through the same waypoints, for comparison in the review."""
    item: int | None = None
    """Which item of the mission's plan it serves, from 0; None where it was not made from a mission."""

    @property
    def duration_s(self) -> float:
        """Without the wait to settle."""
        return self.trajectory.duration_s


@dataclass(frozen=True, slots=True, eq=False)
class FlightPlan:
    """The legs from take-off to touchdown, each beginning at rest where the one before ended."""

    legs: tuple[Leg, ...]

    @property
    def start_m(self) -> Vector3:
        """Where the vehicle must stand."""
        x, y, z, _ = self.legs[0].trajectory.waypoints()[0]
        return (float(x), float(y), float(z))

    @property
    def start_yaw_rad(self) -> float:
        """The heading it must stand with."""
        return float(self.legs[0].trajectory.waypoints()[0, 3])

    @property
    def duration_s(self) -> float:
        """Without waits to settle."""
        return sum(leg.duration_s for leg in self.legs)

    def joined(self) -> Trajectory:
        """All legs as one trajectory, without the waits."""
        return self.legs[0].trajectory.then(*(leg.trajectory for leg in self.legs[1:]))
