"""What is right in a mission and yet looks like a mistake: hints, which a check shows and which stop nothing."""

from __future__ import annotations

import math
from collections.abc import Iterator

from lcd_flight.mission.actions import TrajectoryAction
from lcd_flight.mission.mission import Mission
from lcd_flight.mission.problems import Key

_TURN_SHARES = 12
"""Radians are told by a heading at a multiple of pi / 12, 15 degrees."""
_DIGITS_RAD = 0.005
"""How far from it two decimals may be."""


def hints(mission: Mission) -> Iterator[str]:
    """A line for each thing that looks like a mistake, with its place."""
    headings = list(_headings(mission))
    if any(abs(yaw_deg) > 2.0 * math.pi + _DIGITS_RAD for _, yaw_deg in headings):
        return  # degrees for sure
    for key, yaw_deg in headings:
        share = yaw_deg / (math.pi / _TURN_SHARES)
        near = round(share) != 0 and abs(share - round(share)) * math.pi / _TURN_SHARES < _DIGITS_RAD
        if near and not yaw_deg.is_integer():
            degrees = 180 // _TURN_SHARES * round(share)
            yield f"{mission.place(*key)}: {yaw_deg:g} looks like radians; it is read as degrees, {degrees} was meant?"


def _headings(mission: Mission) -> Iterator[tuple[Key, float]]:
    """Every heading that the mission gives, in degrees, with its key."""
    yield ("vehicle", "initial_yaw_deg"), mission.vehicle.initial_yaw_deg
    for item, action in enumerate(mission.actions()):
        if isinstance(action, TrajectoryAction):
            for n, waypoint in enumerate(action.waypoints):
                if waypoint.yaw_deg is not None:
                    yield ("plan", item, "trajectory", "waypoints", n, "yaw_deg"), waypoint.yaw_deg
