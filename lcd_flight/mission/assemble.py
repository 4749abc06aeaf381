"""From a mission to the tasks that a planner solves, and from planned trajectories to the whole flight."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from lcd_flight.mission import legs
from lcd_flight.mission.actions import Hold, Land, Takeoff, TrajectoryAction, Waypoint
from lcd_flight.mission.mission import Mission
from lcd_flight.model import FlightPlan, FloatArray, Leg, LegKind, Trajectory, Vector3
from lcd_flight.planning.times import allocate, shortest_yaw


@dataclass(frozen=True, slots=True, eq=False)
class TrajectoryTask:
    """One trajectory of a mission, as a planner takes it."""

    item: int
    """Which item of the mission's plan."""
    waypoints: FloatArray
    """(K, 4) x, y, z in m, yaw in rad, unwrapped as it is to be flown."""
    durations_s: FloatArray
    """(K - 1,) by the waypoints' `time`, else by the mean speed."""
    times_given: bool
    """Whether the mission gives any of the times; a planner then keeps all of them."""


@dataclass(frozen=True, slots=True, eq=False)
class Planned:
    """What a planner made of one task."""

    trajectory: Trajectory
    baseline: Trajectory
    """Minimum snap through the same waypoints in the same durations."""


def trajectory_tasks(mission: Mission) -> tuple[TrajectoryTask, ...]:
    """The trajectories of the mission, in order; heading is carried from one to the next."""
    yaw_rad = mission.initial_yaw_rad
    tasks = []
    for item, action in enumerate(mission.actions()):
        if isinstance(action, TrajectoryAction):
            tasks.append(_task(item, action, yaw_rad, mission.planner.speed_m_per_s))
            yaw_rad = float(tasks[-1].waypoints[-1, 3])
    return tuple(tasks)


def _task(item: int, action: TrajectoryAction, yaw_rad: float, speed: float) -> TrajectoryTask:
    positions = np.array([waypoint.position_m for waypoint in action.waypoints])
    times = [waypoint.time_s for waypoint in action.waypoints[1:]]
    return TrajectoryTask(
        item=item,
        waypoints=np.column_stack([positions, headings(action.waypoints, yaw_rad)]),
        durations_s=_durations_s(positions, times, speed),
        times_given=any(time is not None for time in times),
    )


def headings(waypoints: Sequence[Waypoint], arriving_rad: float) -> FloatArray:
    """(K,) yaw in rad, each within half a turn of the one before; where none is given, the one before stays."""
    yaws = [arriving_rad]
    for waypoint in waypoints:
        yaws.append(yaws[-1] if waypoint.yaw_deg is None else math.radians(waypoint.yaw_deg))
    return shortest_yaw(np.array(yaws))[1:]


def _durations_s(positions_m: FloatArray, times_s: Sequence[float | None], speed: float) -> FloatArray:
    """(K - 1,) the given times, else what `speed` gives for the segment."""
    return np.array(
        [
            float(allocate(positions_m[i : i + 2], speed)[0]) if time_s is None else time_s
            for i, time_s in enumerate(times_s)
        ]
    )


def flight_plan(mission: Mission, planned: Sequence[Planned]) -> FlightPlan:
    """All legs from take-off to touchdown, each beginning at rest where the one before ended.

    planned: one for each of `trajectory_tasks(mission)`, in order.
    """
    tasks = {task.item: (task, result) for task, result in zip(trajectory_tasks(mission), planned, strict=True)}
    pose = np.array([*mission.vehicle.initial_position_m, mission.initial_yaw_rad])
    flight: list[Leg] = []
    for item, action in enumerate(mission.actions()):
        match action:
            case Takeoff():
                flight.append(legs.takeoff(pose, action.height_m, action.duration_s, item))
            case Hold():
                flight.append(legs.hold(pose, action.duration_s, item))
            case TrajectoryAction():
                flight.extend(_trajectory_legs(mission, pose, *tasks[item]))
            case Land():
                flight.extend(_landing_legs(mission, pose, action, item))
        pose = _end(flight[-1])
    return FlightPlan(tuple(flight))


def _trajectory_legs(mission: Mission, pose: FloatArray, task: TrajectoryTask, planned: Planned) -> Iterator[Leg]:
    yield legs.transfer(pose, task.waypoints[0], mission.planner.transfer_speed_m_per_s, task.item)
    yield Leg(
        LegKind.TRAJECTORY,
        planned.trajectory,
        waypoints=task.waypoints,
        settle=True,
        baseline=planned.baseline,
        item=task.item,
    )


def _landing_legs(mission: Mission, pose: FloatArray, action: Land, item: int) -> Iterator[Leg]:
    x, y, z = touchdown_m(mission, action, pose)
    above = np.array([x, y, z + action.height_m, pose[3]])
    yield legs.transfer(pose, above, mission.planner.transfer_speed_m_per_s, item)
    yield legs.land(above, action.height_m, action.duration_s, item)


def touchdown_m(mission: Mission, action: Land, pose: FloatArray) -> Vector3:
    """Where the flight ends: the point given, else on the start's ground below `pose` (4,)."""
    if action.position_m is not None:
        return action.position_m
    return (float(pose[0]), float(pose[1]), mission.vehicle.initial_position_m[2])


def _end(leg: Leg) -> FloatArray:
    """(4,) the pose at which a leg ends."""
    return np.asarray(leg.trajectory.waypoints()[-1])
