"""A mission file from a waypoint-following task, e.g. one of a world's sampled tasks."""

from __future__ import annotations

import numpy as np

from lcd_flight.model import FloatArray
from lcd_flight.planning.minimum_snap import minimum_snap
from lcd_flight.planning.times import allocate

LOWEST_M = 1.5
"""Where a task is lifted to: height of the lowest point of its minimum-snap path."""
ROOM_M = 4.0
"""Free space left around that path, for the learned path and for stopping."""
SAMPLES = 2000

_TEMPLATE = """\
# yaml-language-server: $schema=mission.schema.json
# {title}
version: 1
name: {name}
seed: {seed}

vehicle:
  type: {vehicle}
  initial_position: {start}
  initial_yaw_deg: {yaw_deg}

planner:
  type: {planner}
  speed: {speed:.10g}                          # m/s, mean over a segment
  transfer_speed: 1.0
  # no limits: the rehearsal alone decides
  limits: {{max_velocity: 20.0, max_thrust_ratio: 3.0, max_tilt_deg: 180, max_body_rate_deg: 7200}}

plan:
  - takeoff: {{height: 1.0, duration: 2.5}}
  - trajectory:
      waypoints:                      # m
{waypoints}
  - land: {{}}

safety:
  geofence: {{min: {low}, max: {high}}}   # m

rehearse: {{runs: 100, faults: [motor_noise, mocap_dropout]}}
"""


def task_mission(
    title: str,
    name: str,
    waypoints: FloatArray,
    speed: float,
    *,
    vehicle: str,
    planner: str = "learned-polished",
    seed: int = 0,
) -> str:
    """The text of a mission that flies one task, lifted clear of the ground, in a room that leaves space around it.

    waypoints: (K, 4) x, y, z in m and yaw in rad; written to 0.1 mm and 0.01 deg.
    speed: m/s, mean over a segment.
    """
    points = np.column_stack([waypoints[:, :3].round(4), waypoints[:, 3]])
    path = minimum_snap(points, allocate(points, speed))
    places = path.derivative(np.linspace(0.0, path.duration_s, SAMPLES), 0)[:, :3]
    lift = np.array([0.0, 0.0, np.ceil(10.0 * (LOWEST_M - places[:, 2].min())) / 10.0])
    low, high = np.floor(places.min(axis=0) + lift - ROOM_M), np.ceil(places.max(axis=0) + lift + ROOM_M)
    low[2] = 0.0
    return _TEMPLATE.format(
        title=title,
        name=name,
        seed=seed,
        vehicle=vehicle,
        planner=planner,
        speed=float(speed),
        start=_list([*points[0, :2], 0.0]),
        yaw_deg=_degrees(points[0, 3]),
        waypoints="\n".join(_waypoint(point + np.array([*lift, 0.0])) for point in points),
        low=_list(low),
        high=_list(high),
    )


def _waypoint(point: FloatArray) -> str:
    return f"        - {{position: {_list(point[:3])}, yaw_deg: {_degrees(point[3])}}}"


def _list(values: FloatArray | list[float]) -> str:
    return "[" + ", ".join(f"{float(value):.4f}" for value in values) + "]"


def _degrees(angle_rad: float) -> str:
    """In [-180, 180]."""
    return f"{np.degrees(np.arctan2(np.sin(angle_rad), np.cos(angle_rad))) + 0.0:.2f}"
