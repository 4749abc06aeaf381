"""The items of a mission's `plan`: take-off, hold, trajectory, landing."""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

from pydantic import Discriminator, Field, Tag

from lcd_flight.mission.keys import Keys, Point, Real

ITEM_KINDS = {
    "takeoff": "{height: 1.0}",
    "hold": "{duration: 2.0}",
    "trajectory": "{waypoints: [...]}",
    "land": "{}",
}
"""What an item of a plan may be, each with the least that can stand behind its colon."""


class Takeoff(Keys):
    """Straight up from where the vehicle stands, from rest to rest."""

    height_m: Annotated[Real, Field(ge=0.2, le=100.0, examples=[1.0])]
    """How far above `vehicle.initial_position` to hover."""
    duration_s: Annotated[Real, Field(gt=0.0, le=120.0)] = 2.5
    """How long the climb takes."""


class Hold(Keys):
    """Stay where it is."""

    duration_s: Annotated[Real, Field(gt=0.0, le=3600.0, examples=[2.0])]
    """For how long."""


class Waypoint(Keys):
    """A point that the trajectory goes through exactly."""

    position_m: Annotated[Point, Field(examples=[[1.5, 0.5, 1.2]])]
    """x, y, z in the world frame, z up."""
    yaw_deg: Annotated[Real, Field(ge=-360.0, le=360.0)] | None = None
    """Heading, counter-clockwise from +x; turned to by the short way. Left out: as at the waypoint before."""
    time_s: Annotated[Real, Field(gt=0.0, le=600.0)] | None = None
    """Time from the waypoint before to this one, in place of `planner.speed`. Not for the first waypoint."""


class TrajectoryAction(Keys):
    """Fly through waypoints, from rest at the first to rest at the last, as fast as `planner` says.

    The way to the first waypoint is planned too, gently; the trajectory begins once the vehicle has settled there.
    """

    waypoints: Annotated[
        tuple[Waypoint, ...],
        Field(min_length=2, max_length=1000, examples=[[{"position": [0.0, 0.0, 1.0]}, {"position": [1.0, 0.5, 1.2]}]]),
    ]
    """Two or more points, in order."""


class Land(Keys):
    """Come to `height` above the landing point, settle, descend straight down, stop the motors."""

    position_m: Point | None = None
    """Where the vehicle touches down. Left out: below where it is, at the height of `vehicle.initial_position`."""
    height_m: Annotated[Real, Field(ge=0.1, le=10.0)] = 0.5
    """How far above the landing point the descent begins."""
    duration_s: Annotated[Real, Field(gt=0.0, le=120.0)] | None = None
    """How long the descent takes. Left out: `height` at 0.25 m/s."""


class TakeoffItem(Keys):
    """The first item of a plan."""

    takeoff: Annotated[Takeoff, Field(examples=[{"height": 1.0}])]
    """Straight up from where the vehicle stands; the first item, once."""


class HoldItem(Keys):
    """An item between take-off and landing."""

    hold: Annotated[Hold, Field(examples=[{"duration": 2.0}])]
    """Stay for a while; anywhere between take-off and landing."""


class TrajectoryItem(Keys):
    """An item between take-off and landing."""

    trajectory: TrajectoryAction
    """Fly through waypoints; anywhere between take-off and landing, as often as wanted."""


class LandItem(Keys):
    """The last item of a plan."""

    land: Annotated[Land, Field(examples=[{}])]
    """Come down and stop the motors; the last item, once. `land: {}` takes every default."""


def kind_of(item: Any) -> str | None:
    """Which of `ITEM_KINDS` an item is: a mapping's first known key, or what a model of an item holds."""
    if isinstance(item, TakeoffItem | HoldItem | TrajectoryItem | LandItem):
        return next(iter(type(item).model_fields))
    return next((key for key in item if key in ITEM_KINDS), None) if isinstance(item, dict) else None


PlanItem: TypeAlias = Annotated[
    Annotated[TakeoffItem, Tag("takeoff")]
    | Annotated[HoldItem, Tag("hold")]
    | Annotated[TrajectoryItem, Tag("trajectory")]
    | Annotated[LandItem, Tag("land")],
    Discriminator(kind_of),
]
