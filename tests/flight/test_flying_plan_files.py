"""A plan that was kept is flown as it was planned; one that does not fit is refused before anything connects."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcd_flight import FlightOptions, fly, plan, rehearse, save_plan
from lcd_flight.cli.main import app, flyer, run
from lcd_flight.learning.sampling import first_tasks
from lcd_flight.learning.task_files import save_tasks
from lcd_flight.record import read_log
from lcd_flight.worlds import load_world

ROOT = Path(__file__).parents[2]
FOUR = ROOT / "missions" / "four_waypoints.yaml"


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The plan of a mission, in a file."""
    path = tmp_path_factory.mktemp("plans") / "plan.json"
    save_plan(plan(FOUR, cache=False), path)
    return path


def test_a_kept_plan_flies_as_a_fresh_one(kept: Path, tmp_path: Path) -> None:
    fresh, read = plan(FOUR, cache=False), plan(FOUR, plan_file=kept)
    flown = [
        fly(flight, rehearse(flight, 5), FlightOptions(fast=True), log_folder=tmp_path / name)
        for name, flight in (("fresh", fresh), ("kept", read))
    ]
    assert flown[0].figures.to_json() == flown[1].figures.to_json()
    header = read_log(flown[1].log).header
    assert header.planner == "learned-polished"
    assert header.notes["plan"] == f"from {kept}"
    assert [p.method for p in header.predictions] == ["learned-polished"]


def test_the_command(kept: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--plan", str(kept), "--fast", "--log", str(tmp_path), "--json"]
    assert run(flyer, [str(FOUR), *options]) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out.splitlines()[-1])["outcome"] == "landed"
    assert f"PLAN       minimum snap -> learned-polished, from {kept}" in captured.err


def test_an_edited_mission_is_refused_before_anything_connects(
    kept: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    edited = tmp_path / "edited.yaml"
    edited.write_text(FOUR.read_text().replace("[1.5, 0.5, 1.2]", "[1.5, 0.6, 1.2]"))
    assert run(flyer, [str(edited), "--plan", str(kept), "--fast", "--log", str(tmp_path / "logs")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"error: {kept}: trajectories[0]: was planned for waypoint 2 at (1.500, 0.500, 1.200) m")
    assert not (tmp_path / "logs").exists()


@pytest.mark.slow
def test_the_example_flies_plans_in_rotorpy(tmp_path: Path) -> None:
    """One plan at half speed: two seconds of RotorPy; the page's hundred are a matter of minutes."""
    world = load_world("crazyflie-saturated")
    save_tasks(tmp_path / "tasks.npz", first_tasks(world.sampler, 2, 1).take(np.arange(1)))
    tasks = ["--tasks", str(tmp_path / "tasks.npz"), "--world", "crazyflie-saturated@1.2", "--method", "minimum-snap"]
    assert run(app, ["plan", *tasks, "--out", str(tmp_path / "plans.npz"), "--quiet"]) == 0
    example = [sys.executable, str(ROOT / "examples" / "fly_plans_in_rotorpy.py"), "plans.npz", "--out", "result.json"]
    done = subprocess.run(
        [*example, "--processes", "1"], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stderr
    result: dict[str, Any] = json.loads((tmp_path / "result.json").read_text())
    assert (result["flights"], result["rotorpy_crashes"], result["expected_crashes"]) == (1, 0, 0.0)
    assert result["planned"]["method"] == "minimum-snap"
    assert "RotorPy: 0 of 1 flights crashed" in done.stdout
