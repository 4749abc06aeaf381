"""A sampled task as a mission file: it loads, and it is the same task, lifted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lcd_flight.learning.sampling import first_tasks
from lcd_flight.mission import load_mission
from lcd_flight.mission.airframe import vehicle_of
from lcd_flight.mission.assemble import trajectory_tasks
from lcd_flight.mission.plan_mission import plan_mission
from lcd_flight.mission.task_mission import LOWEST_M, task_mission
from lcd_flight.model import LegKind
from lcd_flight.worlds import load_world

WORLD = load_world("crazyflie-saturated")
TASKS = first_tasks(WORLD.sampler, 0, 20).poses


@pytest.mark.parametrize("index", range(20))
def test_a_task_becomes_a_mission_that_can_be_planned(index: int, tmp_path: Path) -> None:
    path = tmp_path / "task.yaml"
    title = f"Task {index} of seed 0 of the world {WORLD.name}."
    text = task_mission(title, f"task-{index}", TASKS[index], WORLD.speed, vehicle="crazyflie", planner="minimum-snap")
    path.write_text(text, encoding="utf-8")
    mission = load_mission(path)
    (task,) = trajectory_tasks(mission)
    shift = task.waypoints - TASKS[index]
    assert np.abs(shift[:, :2]).max() < 1e-4
    assert np.ptp(shift[:, 2]) < 2e-4
    assert np.abs(np.sin(0.5 * shift[:, 3])).max() < 1e-4
    assert task.durations_s == pytest.approx(
        np.linalg.norm(np.diff(TASKS[index][:, :3], axis=0), axis=1) / WORLD.speed, rel=1e-3
    )
    flight = plan_mission(mission, vehicle_of(mission)).plan
    (leg,) = [leg for leg in flight.legs if leg.kind is LegKind.TRAJECTORY]
    heights = leg.trajectory.derivative(np.linspace(0.0, leg.duration_s, 500), 0)[:, 2]
    assert LOWEST_M - 0.01 <= heights.min() < LOWEST_M + 0.2


def test_headings_go_the_short_way_in_missions(tmp_path: Path) -> None:
    waypoints = np.array([[0, 0, 1, 3.0], [1, 0, 1, -3.0], [2, 0, 1, 3.0]], dtype=float)
    path = tmp_path / "task.yaml"
    path.write_text(task_mission("t", "t", waypoints, 1.0, vehicle="crazyflie"), encoding="utf-8")
    (task,) = trajectory_tasks(load_mission(path))
    assert np.abs(np.diff(task.waypoints[:, 3])).max() < 0.3
