"""A mission to plan in tests, and its plan by the learned cost that ships."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from lcd_flight.mission import Mission
from lcd_flight.mission.plan_file import write_plan
from lcd_flight.mission.plan_mission import plan_mission
from lcd_flight.mission.planned import PlannedMission
from lcd_flight.worlds import load_vehicle

VEHICLE = load_vehicle("crazyflie")
WAYPOINTS: list[dict[str, Any]] = [
    {"position": [0, 0, 1]},
    {"position": [1.5, 0.5, 1.2]},
    {"position": [2.5, 2, 1.8], "yaw_deg": 90},
    {"position": [1, 2.5, 1]},
]


def trajectory(waypoints: list[dict[str, Any]] = WAYPOINTS) -> dict[str, Any]:
    """An item of a mission's plan."""
    return {"trajectory": {"waypoints": waypoints}}


def mission(*trajectories: dict[str, Any], **sections: Any) -> Mission:
    """Four waypoints, or the given trajectories, in a large room, by `learned` where no other planner is told."""
    items = trajectories or (trajectory(),)
    planner = {"type": "learned", "speed": 1.5} | sections.pop("planner", {})
    data: dict[str, Any] = {
        "version": 1,
        "name": "bench",
        "vehicle": {"type": "crazyflie"},
        "planner": planner,
        "plan": [{"takeoff": {"height": 1}}, *items, {"land": {}}],
        "safety": {"geofence": {"min": [-4, -4, 0], "max": [6, 6, 4]}},
    }
    return Mission.model_validate(data | sections)


def planned(of: Mission | None = None) -> PlannedMission:
    """The mission's plan."""
    return plan_mission(of or mission(), VEHICLE)


def plan_file(folder: Path, of: Mission | None = None) -> Path:
    """The mission's plan in a file."""
    path = folder / "plan.json"
    write_plan(path, planned(of), of or mission(), VEHICLE)
    return path


def edited(path: Path, edit: Callable[[dict[str, Any]], Any]) -> Path:
    """The same file, its JSON changed."""
    data = json.loads(path.read_text())
    edit(data)
    path.write_text(json.dumps(data))
    return path
