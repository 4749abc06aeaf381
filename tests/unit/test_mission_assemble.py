"""From actions to legs: where each begins and ends, how long it takes, which way the vehicle turns."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from lcd_flight.mission import Mission
from lcd_flight.mission.assemble import Planned, flight_plan, trajectory_tasks
from lcd_flight.model import FlightPlan, LegKind
from lcd_flight.planning.minimum_snap import minimum_snap

GROUND = [0.5, -0.5, 0.1]


def mission(*items: dict[str, Any], **vehicle: Any) -> Mission:
    """A mission that stands at `GROUND` and climbs 1 m first."""
    return Mission.model_validate(
        {
            "version": 1,
            "name": "t",
            "vehicle": {"type": "crazyflie", "initial_position": GROUND, **vehicle},
            "planner": {"type": "minimum-snap", "speed": 1.0},
            "plan": [{"takeoff": {"height": 1.0, "duration": 2.0}}, *items],
            "safety": {"geofence": {"min": [-20, -20, 0], "max": [20, 20, 20]}},
        }
    )


def flown(described: Mission) -> FlightPlan:
    """Its flight with minimum snap everywhere."""
    plans = [minimum_snap(task.waypoints, task.durations_s) for task in trajectory_tasks(described)]
    return flight_plan(described, [Planned(plan, plan) for plan in plans])


def ends(plan: FlightPlan, leg: int) -> tuple[list[float], list[float]]:
    points = plan.legs[leg].trajectory.waypoints()
    return points[0].tolist(), points[-1].tolist()


SQUARE = {
    "trajectory": {
        "waypoints": [
            {"position": [2, 0, 2], "yaw_deg": 170},
            {"position": [2, 3, 2], "time": 2.5},
            {"position": [4, 3, 2], "yaw_deg": -170},
            {"position": [4, 0, 3]},
        ]
    }
}


def test_the_legs_of_a_whole_mission() -> None:
    plan = flown(mission({"hold": {"duration": 3.0}}, SQUARE, {"land": {"duration": 4.0}}))
    kinds = [leg.kind for leg in plan.legs]
    transfer, trajectory = LegKind.TRANSFER, LegKind.TRAJECTORY
    assert kinds == [LegKind.TAKEOFF, LegKind.HOLD, transfer, trajectory, transfer, LegKind.LAND]
    assert [leg.item for leg in plan.legs] == [0, 1, 2, 2, 3, 3]
    assert [leg.settle for leg in plan.legs] == [kind in (transfer, trajectory) for kind in kinds]
    assert plan.start_m == pytest.approx(GROUND)
    assert plan.legs[3].waypoints is not None
    assert plan.legs[3].baseline is not None
    assert all(leg.baseline is None and leg.waypoints is None for leg in plan.legs if leg.kind is not trajectory)


def test_where_each_leg_goes() -> None:
    plan = flown(mission({"hold": {"duration": 3.0}}, SQUARE, {"land": {"duration": 4.0}}))
    turned = math.radians(170.0)
    assert ends(plan, 0)[1] == pytest.approx([0.5, -0.5, 1.1, 0.0])
    assert ends(plan, 2)[1] == pytest.approx([2.0, 0.0, 2.0, turned])
    assert ends(plan, 3)[1] == pytest.approx([4.0, 0.0, 3.0, math.radians(190.0)])
    assert ends(plan, 4)[1] == pytest.approx([4.0, 0.0, 0.6, math.radians(190.0)])
    assert ends(plan, 5)[1] == pytest.approx([4.0, 0.0, 0.1, math.radians(190.0)])


def test_how_long_each_leg_takes() -> None:
    plan = flown(mission({"hold": {"duration": 3.0}}, SQUARE, {"land": {"duration": 4.0}}))
    way_m = math.dist((0.5, -0.5, 1.1), (2.0, 0.0, 2.0))
    turn_s = 170.0 / 45.0
    expected = [2.0, 3.0, max(way_m / 0.5, turn_s), 2.5 + 2.0 + math.sqrt(10.0), 2.4 / 0.5, 4.0]
    assert [leg.duration_s for leg in plan.legs] == pytest.approx(expected)


def test_times_of_waypoints_override_the_speed() -> None:
    (task,) = trajectory_tasks(mission(SQUARE, {"land": {}}))
    assert task.durations_s.tolist() == pytest.approx([2.5, 2.0, math.sqrt(10.0)])
    assert task.times_given
    plain = {"trajectory": {"waypoints": [{"position": [0, 0, 1]}, {"position": [0, 2, 1]}]}}
    assert not trajectory_tasks(mission(plain, {"land": {}}))[0].times_given


def test_yaw_turns_by_the_short_way_and_stays_where_none_is_given() -> None:
    (task,) = trajectory_tasks(mission(SQUARE, {"land": {}}))
    assert np.degrees(task.waypoints[:, 3]).tolist() == pytest.approx([170.0, 170.0, 190.0, 190.0])


def test_heading_is_carried_from_the_start_through_trajectories() -> None:
    plain = {"trajectory": {"waypoints": [{"position": [0, 0, 1]}, {"position": [0, 2, 1]}]}}
    tasks = trajectory_tasks(mission(plain, SQUARE, plain, {"land": {}}, initial_yaw_deg=-90))
    assert np.degrees(tasks[0].waypoints[:, 3]).tolist() == pytest.approx([-90.0, -90.0])
    assert np.degrees(tasks[1].waypoints[:, 3]).tolist() == pytest.approx([-190.0, -190.0, -170.0, -170.0])
    assert np.degrees(tasks[2].waypoints[:, 3]).tolist() == pytest.approx([-170.0, -170.0])
    assert [task.item for task in tasks] == [1, 2, 3]


def test_a_transfer_to_where_the_vehicle_is_still_waits() -> None:
    there = {"trajectory": {"waypoints": [{"position": [0.5, -0.5, 1.1]}, {"position": [1, 1, 1]}]}}
    leg = flown(mission(there, {"land": {}})).legs[1]
    assert (leg.kind, leg.settle, leg.duration_s) == (LegKind.TRANSFER, True, 1.0)
    assert np.ptp(leg.trajectory.derivative(np.linspace(0.0, 1.0, 50), 0), axis=0).max() == 0.0


@pytest.mark.parametrize(
    ("land", "above", "down", "descent_s"),
    [
        ({}, [0.5, -0.5, 0.6], [0.5, -0.5, 0.1], 2.0),
        ({"height": 1.0}, [0.5, -0.5, 1.1], [0.5, -0.5, 0.1], 4.0),
        ({"height": 1.0, "duration": 2.5}, [0.5, -0.5, 1.1], [0.5, -0.5, 0.1], 2.5),
        ({"position": [3, 2, 1]}, [3.0, 2.0, 1.5], [3.0, 2.0, 1.0], 2.0),
    ],
)
def test_landings(land: dict[str, Any], above: list[float], down: list[float], descent_s: float) -> None:
    plan = flown(mission({"land": land}))
    assert ends(plan, 1)[1][:3] == pytest.approx(above)
    assert ends(plan, 2)[0][:3] == pytest.approx(above)
    assert ends(plan, 2)[1][:3] == pytest.approx(down)
    assert plan.legs[2].duration_s == pytest.approx(descent_s)


def test_as_many_plans_as_trajectories() -> None:
    with pytest.raises(ValueError, match="shorter"):
        flight_plan(mission(SQUARE, {"land": {}}), [])
