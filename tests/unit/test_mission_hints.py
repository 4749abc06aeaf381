"""What looks like a mistake and may be none: hints, and where they keep quiet."""

from __future__ import annotations

import pytest
from plan_bench import WAYPOINTS, mission, trajectory

from lcd_flight.mission.hints import hints


def told(*yaws_deg: float | None, initial: float = 0.0) -> list[str]:
    waypoints = [
        point | ({} if yaw is None else {"yaw_deg": yaw}) for point, yaw in zip(WAYPOINTS, yaws_deg, strict=False)
    ]
    vehicle = {"type": "crazyflie", "initial_yaw_deg": initial}
    return list(hints(mission(trajectory(waypoints), vehicle=vehicle)))


@pytest.mark.parametrize(
    ("yaw", "degrees"),
    [(1.5708, 90), (1.57, 90), (3.14159, 180), (-0.785, -45), (0.5236, 30), (6.283185307, 360), (0.26, 15)],
)
def test_radians_are_told(yaw: float, degrees: int) -> None:
    (hint,) = told(0.0, None, yaw)
    place = "plan[1].trajectory.waypoints[2].yaw_deg"
    assert hint == f"{place}: {yaw:g} looks like radians; it is read as degrees, {degrees} was meant?"


def test_the_start_is_looked_at_too() -> None:
    (hint,) = told(0.0, 0.0, initial=1.5708)
    assert hint.startswith("vehicle.initial_yaw_deg: 1.5708 looks like radians")


@pytest.mark.parametrize("yaws", [(0.0, 0.0), (0.0, 45.0, 90.0), (1.57, 90.0), (0.0, 1.0, 2.0), (0.4, 0.9), (5.0, 3.0)])
def test_degrees_are_left_alone(yaws: tuple[float, ...]) -> None:
    assert told(*yaws) == []


def test_none_given() -> None:
    assert told(None, None, None) == []
