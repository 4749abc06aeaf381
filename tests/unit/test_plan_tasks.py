"""Many tasks planned into one file, whole or not at all; after an interruption it goes on where it stopped."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from docs_pages import blocks

from lcd_flight import plugins
from lcd_flight.learning import plan_tasks as room
from lcd_flight.learning.methods import METHODS, Planned, Problem
from lcd_flight.learning.plan_files import PlannedTasks, load_plans, save_plans
from lcd_flight.learning.plan_tasks import TaskPlanning, plan_tasks
from lcd_flight.learning.progress import Progress
from lcd_flight.learning.sampling import first_tasks
from lcd_flight.mission.soundness import flaw
from lcd_flight.model import InputError, Tasks, Trajectories
from lcd_flight.planning.minimum_snap import minimum_snap_batch
from lcd_flight.worlds import load_world

WORLD = load_world("crazyflie-saturated")
TASKS = first_tasks(WORLD.sampler, 7, 10)
MINIMUM_SNAP = TaskPlanning(WORLD, "minimum-snap")


def plan(out: Path, planning: TaskPlanning = MINIMUM_SNAP, tasks: Tasks = TASKS) -> PlannedTasks:
    return plan_tasks(tasks, planning, out, plugins.simulator())


@pytest.fixture
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four tasks of three segments at a time."""
    monkeypatch.setattr(room, "_BLOCK_SEGMENTS", 12)


class Counting:
    """A method that keeps in mind which tasks it planned, and fails at one of them."""

    def __init__(self, fail_at: int | None = None) -> None:
        self.blocks: list[list[int]] = []
        self._fail_at = fail_at

    def __call__(self, problem: Problem) -> Planned:
        tasks = problem.indices.tolist()
        if self._fail_at in tasks:
            raise KeyboardInterrupt
        self.blocks += [tasks] if len(tasks) > 1 else []  # one task alone is the trial before all others
        return METHODS["minimum-snap"](problem)


def counted(monkeypatch: pytest.MonkeyPatch, fail_at: int | None = None) -> Counting:
    method = Counting(fail_at)
    monkeypatch.setattr(room, "find_method", lambda name: method)
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    return method


def test_what_is_written(tmp_path: Path) -> None:
    made = plan(tmp_path / "plans.npz")
    with np.load(tmp_path / "plans.npz", allow_pickle=False) as archive:
        assert sorted(archive.files) == ["about", "coefficients", "durations", "fell_back"]
        assert archive["durations"].shape == (10, 3)
        assert archive["coefficients"].shape == (10, 4, 3, 8)
        assert archive["fell_back"].dtype == bool
        about = json.loads(str(archive["about"]))
    assert (about["world"], about["method"], about["drag"]) == ("crazyflie-saturated v2", "minimum-snap", 3)
    assert about["controller"] == "geometric"
    expected = minimum_snap_batch(TASKS.poses, TASKS.durations_s(WORLD.speed))
    assert np.array_equal(made.trajectories.coefficients, expected.coefficients)
    assert [path.name for path in tmp_path.iterdir()] == ["plans.npz"]


@pytest.mark.parametrize("method", ["learned", "analytic", "minimum-snap", "learned-polished"])
@pytest.mark.parametrize("timing", ["fixed", "retimed"])
def test_every_plan_goes_through_its_waypoints(tmp_path: Path, method: str, timing: str) -> None:
    planning = TaskPlanning(WORLD, method, "fixed" if timing == "fixed" else "retimed", model="crazyflie-paper")
    made = plan(tmp_path / "plans.npz", planning, TASKS.take(np.arange(3)))
    asked_s = TASKS.take(np.arange(3)).durations_s(WORLD.speed)
    for n, trajectory in enumerate(made.trajectories):
        assert flaw(trajectory, TASKS.poses[n]) is None
        assert trajectory.duration_s == pytest.approx(asked_s[n].sum())
    moved = np.abs(made.trajectories.durations_s - asked_s).max() > 1e-3
    assert moved == (timing == "retimed" and method != "minimum-snap")


def test_two_hundred_waypoints(tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    steps = random.uniform(0.5, 1.5, size=(2, 200, 3)) * random.choice([-1.0, 1.0], size=(2, 200, 3))
    long = Tasks(steps.cumsum(axis=1), random.uniform(-1.0, 1.0, size=(2, 200)))
    made = plan(tmp_path / "plans.npz", TaskPlanning(WORLD, "learned", model="crazyflie-paper"), long)
    assert made.trajectories.coefficients.shape == (2, 4, 199, 8)
    assert all(flaw(trajectory, long.poses[n]) is None for n, trajectory in enumerate(made.trajectories))


def test_blocks_make_no_difference(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    learned = TaskPlanning(WORLD, "learned", model="crazyflie-paper")
    whole = plan(tmp_path / "whole.npz", learned)
    monkeypatch.setattr(room, "_BLOCK_SEGMENTS", 12)
    parts = plan(tmp_path / "parts.npz", learned)
    assert np.array_equal(whole.trajectories.coefficients, parts.trajectories.coefficients)
    assert (tmp_path / "whole.npz").read_bytes() == (tmp_path / "parts.npz").read_bytes()


@pytest.mark.usefixtures("small_blocks")
def test_it_goes_on_where_it_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "plans.npz"
    first = counted(monkeypatch, fail_at=8)
    with pytest.raises(KeyboardInterrupt):
        plan(out)
    assert first.blocks == [[0, 1, 2, 3], [4, 5, 6, 7]]
    assert not out.exists()
    second = counted(monkeypatch)
    made = plan(out)
    assert second.blocks == [[8, 9]]
    assert len(made) == 10
    assert [path.name for path in tmp_path.iterdir()] == ["plans.npz"]


@pytest.mark.usefixtures("small_blocks")
@pytest.mark.parametrize(
    "change",
    [
        lambda p: replace(p, drag=2),
        lambda p: replace(p, timing="fixed"),
        lambda p: replace(p, seed=1),
        lambda p: replace(p, model="hummingbird-paper"),
        lambda p: replace(p, world=load_world("crazyflie-paper")),
    ],
)
def test_it_never_goes_on_from_something_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: Callable[[TaskPlanning], TaskPlanning]
) -> None:
    counted(monkeypatch, fail_at=8)
    with pytest.raises(KeyboardInterrupt):
        plan(tmp_path / "plans.npz")
    other = counted(monkeypatch)
    plan(tmp_path / "plans.npz", change(MINIMUM_SNAP))
    assert len(other.blocks) == 3


@pytest.mark.usefixtures("small_blocks")
def test_it_never_goes_on_with_another_model_in_the_same_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "mine.safetensors"
    planning = replace(MINIMUM_SNAP, model=str(file))
    planned = []
    for content, fail_at in ((b"one", 8), (b"other", None)):
        file.write_bytes(content)
        method = counted(monkeypatch, fail_at)
        with nullcontext() if fail_at is None else pytest.raises(KeyboardInterrupt):
            plan(tmp_path / "plans.npz", planning)
        planned.append(len(method.blocks))
    assert planned == [2, 3]


@pytest.mark.usefixtures("small_blocks")
def test_progress_is_told(tmp_path: Path) -> None:
    seen: list[Progress] = []
    plan_tasks(TASKS, MINIMUM_SNAP, tmp_path / "plans.npz", plugins.simulator(), seen.append)
    assert [(p.done, p.total, p.unit) for p in seen] == [(4, 10, "tasks"), (8, 10, "tasks"), (10, 10, "tasks")]


@pytest.mark.parametrize(
    ("planning", "message"),
    [
        (TaskPlanning(WORLD, "magic"), "no method `magic`; there are minimum-snap, "),
        (TaskPlanning(WORLD, "learned", drag=6), "no drag configuration 6: world crazyflie-saturated has"),
        (TaskPlanning(WORLD, "learned", model="none-such"), "no model `none-such`; shipped: "),
        (TaskPlanning(WORLD, "learned", model="crazyflie-flight"), "model crazyflie-flight: trained for another"),
        (
            TaskPlanning(load_world("hummingbird-paper"), "learned", model="crazyflie-paper"),
            "model crazyflie-paper: trained for another vehicle",
        ),
        (
            TaskPlanning(load_world("crazyflie-saturated@50"), "minimum-snap"),
            "world crazyflie-saturated@50: 50 m/s is above 9.0 m/s, the fastest that a crazyflie can fly level",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_planned_is_one_line(tmp_path: Path, planning: TaskPlanning, message: str) -> None:
    with pytest.raises(InputError) as caught:
        plan(tmp_path / "plans.npz", planning)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(message)
    assert not (tmp_path / "plans.npz").exists()


def saved(folder: Path, **arrays: object) -> Path:
    path = folder / "plans.npz"
    np.savez(path, **arrays)  # type: ignore[arg-type] # whatever a user may have written
    return path


D, C = np.ones((2, 3)), np.zeros((2, 4, 3, 8))


def test_plans_of_other_programs_are_read(tmp_path: Path) -> None:
    found = load_plans(saved(tmp_path, durations=D, coefficients=C))
    assert len(found) == 2
    assert found.about == {}
    assert not found.fell_back.any()


def test_round_trip(tmp_path: Path) -> None:
    plans = PlannedTasks(Trajectories(D, C + np.pi), np.array([True, False]), {"world": "w", "n": 1})
    save_plans(tmp_path / "p.npz", plans)
    found = load_plans(tmp_path / "p.npz")
    assert np.array_equal(found.trajectories.coefficients, plans.trajectories.coefficients)
    assert found.fell_back.tolist() == [True, False]
    assert found.about == plans.about


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"durations": D}, "has no array `coefficients`"),
        ({"coefficients": C}, "has no array `durations`"),
        ({"durations": D, "coefficients": C[:, :3]}, "coefficients has shape (2, 3, 3, 8); give (2, 4, 3, 8)"),
        ({"durations": D[0], "coefficients": C}, "durations is float64 of shape (3,); give numbers, (N, S) in s"),
        ({"durations": D - 1.0, "coefficients": C}, "durations must be above 0"),
        ({"durations": D, "coefficients": C * np.nan}, "coefficients[0, 0, 0, 0] is nan"),
        ({"durations": D, "coefficients": C, "fell_back": [True]}, "fell_back has shape (1,); give (2,)"),
        ({"durations": D, "coefficients": C, "about": np.array("{")}, "`about` is no JSON text"),
    ],
)
def test_wrong_plans_are_named(tmp_path: Path, arrays: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as caught:
        load_plans(saved(tmp_path, **arrays))
    assert message in str(caught.value)


def test_the_code_of_the_page_reads_a_file(tmp_path: Path) -> None:
    (block,) = blocks("plans.md", "python")
    namespace: dict[str, Any] = {}
    exec(compile(block.text, "docs/plans.md", "exec"), namespace)  # noqa: S102 - our own page
    trajectory = plan(tmp_path / "plans.npz").trajectories[3]
    times = np.linspace(0.0, trajectory.duration_s, 50)
    with np.load(tmp_path / "plans.npz") as plans:
        for order in (0, 1, 2):
            read = [namespace["reference"](plans, 3, time_s, order) for time_s in times]
            assert np.allclose(read, trajectory.derivative(times, order), atol=1e-9)
