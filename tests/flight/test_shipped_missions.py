"""The missions that ship: planned by the shipped model, rehearsed in the real simulator."""

from __future__ import annotations

from pathlib import Path

import pytest

from lcd_flight import api
from lcd_flight.learning.sampling import first_tasks
from lcd_flight.mission import load_mission
from lcd_flight.mission.task_mission import task_mission
from lcd_flight.model import RefusedError
from lcd_flight.worlds import load_world

MISSIONS = Path(__file__).parents[2] / "missions"
SATURATING = MISSIONS / "saturating_task.yaml"


def test_there_are_at_least_four() -> None:
    assert len(LEARNED) >= 4


LEARNED = [path for path in sorted(MISSIONS.glob("*.yaml")) if load_mission(path).planner.type.startswith("learned")]


@pytest.mark.parametrize("path", LEARNED, ids=lambda path: path.stem)
def test_the_shipped_model_plans_them_and_they_pass_the_rehearsal(path: Path) -> None:
    flight = api.plan(path)
    for summary in flight.planned.summaries:
        assert summary.fallback is None
        assert summary.method == "learned-polished"
        assert summary.predicted_max_error_m < summary.minimum_snap_predicted_max_error_m
    rehearsal = api.rehearse(flight)
    assert rehearsal.passed, rehearsal.text
    assert rehearsal.max_error_m < 0.75


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_the_benches_of_the_autopilots_fly_a_vehicle_of_their_size_and_pass_the_rehearsal(autopilot: str) -> None:
    flight = api.plan(MISSIONS / f"bench_{autopilot}.yaml")
    assert flight.vehicle.name == "x500"
    rehearsal = api.rehearse(flight)
    assert rehearsal.passed, rehearsal.text
    assert rehearsal.max_error_m < 0.05


def test_minimum_snap_saturates_on_the_saturating_task_and_is_refused(tmp_path: Path) -> None:
    text = SATURATING.read_text().replace("type: learned-polished", "type: minimum-snap")
    mission = tmp_path / "minimum_snap.yaml"
    mission.write_text(text)
    rehearsal = api.rehearse(api.plan(mission))
    assert not rehearsal.passed
    assert not rehearsal.completed.all()
    assert rehearsal.longest_saturation_s > 0.1
    with pytest.raises(RefusedError, match="trouble begins in"):
        rehearsal.require()


def test_the_saturating_task_is_a_sampled_one() -> None:
    world = load_world("crazyflie-flight")
    task = first_tasks(world.sampler, 1, 5).poses[4]
    mission = load_mission(SATURATING)
    title = SATURATING.read_text().splitlines()[1].removeprefix("# ")
    assert SATURATING.read_text() == task_mission(
        title, mission.name, task, world.speed, vehicle="crazyflie", planner="learned-polished"
    )


def test_the_demo_is_the_first_mission() -> None:
    assert load_mission("demo") == load_mission(MISSIONS / "four_waypoints.yaml")
