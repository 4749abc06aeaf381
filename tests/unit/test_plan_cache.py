"""The plan cache: it gives back what it was given, under what it depends on, and damage to it never hurts."""

from __future__ import annotations

import os
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from plan_bench import VEHICLE, WAYPOINTS, mission, trajectory

from lcd_flight.mission import plan_cache
from lcd_flight.mission.assemble import trajectory_tasks
from lcd_flight.mission.plan_cache import PlanCache
from lcd_flight.mission.plan_key import model_hash, plan_key
from lcd_flight.mission.plan_mission import load_cost, plan_mission
from lcd_flight.mission.planned import PlannedMission
from lcd_flight.planning.cost.model_file import load_model
from lcd_flight.planning.planner import PlannerOptions

NEAR_THE_LAST = {"position": [1, 2.5, 1.01]}


def plan(folder: Path, **sections: object) -> PlannedMission:
    return plan_mission(mission(**sections), VEHICLE, cache=PlanCache(folder))


def kept(folder: Path) -> list[Path]:
    return sorted(folder.iterdir())


def test_the_second_time_it_comes_from_the_cache_and_is_the_same(tmp_path: Path) -> None:
    made, again = plan(tmp_path), plan(tmp_path)
    assert [made.summaries[0].cached, again.summaries[0].cached] == [False, True]
    assert made.summaries[0] == replace(again.summaries[0], cached=False)
    assert np.array_equal(made.plan.joined().coefficients, again.plan.joined().coefficients)
    assert made.card == again.card
    assert made.notes == again.notes == ()
    assert len(kept(tmp_path)) == 1


def test_each_trajectory_is_kept_by_itself(tmp_path: Path) -> None:
    plan_mission(mission(trajectory(), trajectory(WAYPOINTS[::-1])), VEHICLE, cache=PlanCache(tmp_path))
    assert len(kept(tmp_path)) == 2
    assert plan(tmp_path).summaries[0].cached


@pytest.mark.parametrize(
    "sections",
    [
        {"planner": {"speed": 1.4}},
        {"planner": {"speed": 1.5, "weight": 2.0}},
        {"plan": [{"takeoff": {"height": 1}}, trajectory(WAYPOINTS[:3]), {"land": {}}]},
        {"plan": [{"takeoff": {"height": 1}}, trajectory([*WAYPOINTS[:3], NEAR_THE_LAST]), {"land": {}}]},
    ],
)
def test_what_a_plan_depends_on_makes_another_one(tmp_path: Path, sections: dict[str, object]) -> None:
    plan(tmp_path)
    assert not plan(tmp_path, **sections).summaries[0].cached
    assert len(kept(tmp_path)) == 2


@pytest.mark.parametrize("name", ["another", "seed", "log"])
def test_what_a_plan_does_not_depend_on_does_not(tmp_path: Path, name: str) -> None:
    other = {"another": {"name": "other"}, "seed": {"seed": 5}, "log": {"log": {"dir": "elsewhere"}}}[name]
    plan(tmp_path)
    assert plan(tmp_path, **other).summaries[0].cached


def test_keys_tell_vehicles_methods_and_models_apart() -> None:
    (task,) = trajectory_tasks(mission())
    options = asdict(PlannerOptions())
    key = plan_key(task, VEHICLE, "learned", options, "m")
    others = [
        plan_key(task, replace(VEHICLE, parasitic_drag=(0.1, 0.1, 0.1)), "learned", options, "m"),
        plan_key(task, VEHICLE, "analytic", options, "m"),
        plan_key(task, VEHICLE, "learned", options | {"step": 0.07}, "m"),
        plan_key(task, VEHICLE, "learned", options, "n"),
    ]
    assert key == plan_key(task, VEHICLE, "learned", dict(reversed(options.items())), "m")
    assert len({key, *others}) == 5


def test_a_model_is_known_by_its_numbers() -> None:
    model = load_cost(mission(), VEHICLE)
    assert model_hash(model) == model_hash(load_model("crazyflie-flight"))
    shifted = model.feature_mean.copy()
    shifted[-1] = np.nextafter(shifted[-1], np.inf)
    assert model_hash(replace(model, feature_mean=shifted)) != model_hash(model)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "EOF"),
        (b"{}", "Field required"),
        (b"\x00\xff" * 100, "expected value"),
        (None, "misses waypoint 1"),
    ],
)
def test_damage_is_removed_told_and_planned_anew(tmp_path: Path, content: bytes | None, reason: str) -> None:
    plan(tmp_path)
    (path,) = kept(tmp_path)
    whole = path.read_bytes()
    path.write_bytes(whole.replace(b"[[0.0,0.0,1.0", b"[[0.0,0.0,1.1") if content is None else content)
    again = plan(tmp_path)
    (note,) = again.notes
    assert str(path) in note
    assert reason in note
    assert note.endswith("planned anew")
    assert not again.summaries[0].cached
    assert path.read_bytes() == whole
    assert plan(tmp_path).summaries[0].cached


def test_a_plan_under_a_wrong_name_is_not_believed(tmp_path: Path) -> None:
    plan(tmp_path)
    (one,) = kept(tmp_path)
    plan(tmp_path, planner={"speed": 1.4})
    (other,) = set(kept(tmp_path)) - {one}
    one.write_bytes(other.read_bytes())
    again = plan(tmp_path)
    assert "was planned for" in again.notes[0]
    assert again.summaries[0].duration_s == pytest.approx(3.51, abs=0.01)


def test_a_folder_that_cannot_be_written_to_is_told_and_hurts_nothing(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.touch()
    made = plan_mission(mission(), VEHICLE, cache=PlanCache(blocked / "plans"))
    assert made.summaries[0].method == "learned"
    assert made.notes
    assert all("file" in note for note in made.notes)


def test_what_was_used_longest_ago_goes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan_cache, "MOST_PLANS", 2)
    plan(tmp_path)
    (first,) = kept(tmp_path)
    plan(tmp_path, planner={"speed": 1.4})
    (second,) = set(kept(tmp_path)) - {first}
    for age_s, path in ((200, first), (100, second)):
        os.utime(path, (path.stat().st_mtime - age_s,) * 2)
    assert plan(tmp_path).summaries[0].cached  # used again: the second is the oldest now
    plan(tmp_path, planner={"speed": 1.3})
    assert len(kept(tmp_path)) == 2
    assert first.exists()
    assert not second.exists()


def test_bytes_are_bounded_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan_cache, "MOST_BYTES", 5000)
    for speed in (1.1, 1.2, 1.3, 1.4):
        plan(tmp_path, planner={"speed": speed})
    assert 1 <= len(kept(tmp_path)) <= 2
    assert sum(path.stat().st_size for path in kept(tmp_path)) <= 5000


def test_polished_plans_are_kept_with_the_seed_of_their_noise(tmp_path: Path) -> None:
    polished = {"type": "learned-polished", "speed": 1.5}
    made = plan(tmp_path, planner=polished)
    again, other = plan(tmp_path, planner=polished), plan(tmp_path, planner=polished, seed=1)
    assert made.summaries[0].method == "learned-polished"
    assert [p.summaries[0].cached for p in (made, again, other)] == [False, True, False]
    assert np.array_equal(made.plan.joined().coefficients, again.plan.joined().coefficients)
    assert not plan(tmp_path).summaries[0].cached  # the same without the polish is another plan


def test_minimum_snap_is_not_kept(tmp_path: Path) -> None:
    plan(tmp_path, planner={"type": "minimum-snap"})
    assert not (tmp_path / "plans").exists()
    assert kept(tmp_path) == []


def test_it_lives_where_compiled_kernels_do(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("LCD_CACHE_DIR", str(tmp_path))
    assert PlanCache().folder == tmp_path / "plans"
