"""`lcd evaluate` and `lcd reproduce` as a user gives them: what they leave behind, and one line for what is wrong."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from known_simulator import KnownSimulator, tasks_with_errors

from lcd_flight import plugins
from lcd_flight.cli.main import app, run
from lcd_flight.learning.freshness import fresh_seed
from lcd_flight.learning.task_files import save_tasks

EVALUATE = ["evaluate", "--world", "crazyflie-saturated", "--methods", "minimum-snap"]


@pytest.fixture
def known(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> KnownSimulator:
    """A simulator whose answers are known in place of the real one, and a folder of its own to work in."""
    simulator = KnownSimulator()
    monkeypatch.setattr(plugins, "simulator", lambda: simulator)
    monkeypatch.chdir(tmp_path)
    return simulator


def said(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, dict[str, Any], str]:
    """Exit code, the JSON line, and what people read."""
    code = run(app, [*arguments, "--json"])
    captured = capsys.readouterr()
    return code, json.loads(captured.out.splitlines()[-1]), captured.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--seed", "newest"], "--seed newest: give a whole number"),
        (["--drag", "two"], "--drag two: give numbers"),
        (["--drag", "0"], "no drag configuration 0"),
        (["--drag", "3,3"], "each once"),
        (["--yaw", "long"], "--yaw long: choose as-sampled or short"),
        (["--timing", "later"], "--timing later: choose retimed or fixed"),
        (["--thrust-scale", "-1"], "thrust share -1"),
        (["--compare", "learned"], "--compare learned: give two methods"),
        (["--compare", "learned,learned"], "give two methods"),
        (["--compare", "minimum-snap,nothing"], "no method `nothing`"),
        (["--methods", ","], "holds no name"),
        (["--world", "crazyflie-saturated,moon"], "world 'moon' is not known"),
        (["--world", "hummingbird-paper", "--methods", "learned", "--model", "crazyflie-paper"], "another vehicle"),
        (["--methods", "learned", "--model", "none.safetensors"], "there is no such model file"),
    ],
)
def test_what_is_wrong_is_one_line(known: Any, capsys: Any, arguments: list[str], message: str) -> None:
    code, facts, people = said(capsys, *EVALUATE, "--count", "2", *arguments)
    assert (code, facts["outcome"]) == (2, "invalid_input")
    assert message in facts["error"]
    assert sum(line.startswith("error: ") for line in people.splitlines()) == 1
    assert not known.calls


def test_tasks_of_a_wrong_shape_are_named(known: Any, capsys: Any) -> None:
    np.savez("tasks.npz", waypoints=np.zeros((3, 4, 2)), yaws=np.zeros((3, 4)))
    code, facts, _ = said(capsys, *EVALUATE, "--tasks", "tasks.npz")
    assert code == 2
    assert "tasks.npz: waypoints has shape (3, 4, 2); give (N, K, 3)" in facts["error"]


def test_tasks_of_a_file_are_flown(known: Any, capsys: Any) -> None:
    save_tasks(Path("tasks.npz"), tasks_with_errors([0.1, 1.6, 1.7, 0.2]))
    code, facts, _ = said(capsys, *EVALUATE, "--tasks", "tasks.npz", "--noise-seeds", "2")
    assert code == 0
    assert facts["methods"]["minimum-snap"]["crash_rate"] == pytest.approx(50.0)
    assert facts["methods"]["minimum-snap"]["tasks"] == 4


def test_it_leaves_files_and_no_parts(known: Any, capsys: Any) -> None:
    arguments = ["--count", "3", "--drag", "all", "--out", "out", "--compare", "search,minimum-snap"]
    code, facts, _ = said(capsys, *EVALUATE, *arguments)
    assert code == 0
    assert set(facts["methods"]) == {"minimum-snap", "search"}
    assert set(facts["by_drag"]) == {"1", "2", "3", "4", "5"}
    assert {p.name for p in Path("out").iterdir()} == {
        "evaluation.json",
        "flights.parquet",
        "crash-rates-crazyflie-saturated.svg",
        "errors-crazyflie-saturated.svg",
    }
    assert not list(Path("data").rglob("*.npz"))


def test_interrupted_it_says_how_to_go_on_and_does(known: Any, capsys: Any) -> None:
    arguments = [*EVALUATE, "--count", "3", "--drag", "1,2"]
    known.interrupted_in = 2
    code, facts, _ = said(capsys, *arguments)
    assert (code, facts["outcome"]) == (130, "interrupted")
    assert "run the same command again to go on" in facts["error"]
    known.interrupted_in = None
    code, facts, _ = said(capsys, *arguments)
    assert code == 0
    assert len(known.calls) == 2


def test_several_worlds_and_a_fresh_seed(known: Any, capsys: Any) -> None:
    worlds = ["--world", "crazyflie-saturated,crazyflie-paper", "--seed", "fresh", "--count", "2"]
    code, facts, people = said(capsys, *EVALUATE, *worlds)
    assert code == 0
    assert set(facts["worlds"]) == {"crazyflie-saturated", "crazyflie-paper"}
    assert facts["worlds"]["crazyflie-paper"]["seed"] == fresh_seed()
    assert f"seed {fresh_seed()}: fresh" in people


def test_all_leaves_out_who_cannot_plan_and_says_so(known: Any, capsys: Any) -> None:
    code, facts, people = said(
        capsys,
        "evaluate",
        "--world",
        "hummingbird-paper",
        "--model",
        "crazyflie-paper",
        "--methods",
        "all",
        "--count",
        "2",
    )
    assert code == 0
    assert "minimum-snap" in facts["methods"]
    assert "learned" not in facts["methods"]
    assert "WARN learned is left out: model crazyflie-paper: trained for another vehicle" in people


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--models", "none"], "--models none: choose train or shipped"),
        (["--recipe", "convex"], "recipe convex: choose one of small, medium, full"),
        (["--models", "shipped", "--per-drag"], "leave out --per-drag"),
        (["--seed", "x"], "--seed x: give a whole number"),
    ],
)
def test_a_reproduction_that_makes_no_sense_is_refused(
    known: Any, capsys: Any, arguments: list[str], message: str
) -> None:
    code, facts, _ = said(capsys, "reproduce", *arguments)
    assert code == 2
    assert message in facts["error"]
    assert not known.calls
