"""`lcd plan` as a user gives it: what it writes, takes back, and refuses with one line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcd_flight.cli.main import app, run
from lcd_flight.learning.plan_files import load_plans


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In an empty folder; the user's own cache of plans is left alone."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("lcd_flight.mission.plan_cache.cache_folder", lambda: tmp_path / "cache")


def lcd(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    """The JSON object of a command that does its work, with what people saw."""
    assert run(app, [*arguments, "--json"]) == 0
    captured = capsys.readouterr()
    return json.loads(captured.out.splitlines()[-1]) | {"told": captured.err}


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line of a command that is refused."""
    assert run(app, list(arguments)) == 2
    (line,) = [text for text in capsys.readouterr().err.splitlines() if text.startswith("error: ")]
    return line.removeprefix("error: ")


def tasks(name: str = "tasks.npz", **arrays: Any) -> str:
    """A file of two tasks, changed as told."""
    waypoints = np.array([[[0, 0, 1], [1, 0, 1], [1, 1, 2]], [[0, 0, 1], [0, 2, 1], [1, 2, 1]]], dtype=float)
    np.savez(name, **{"waypoints": waypoints, "yaws": np.zeros((2, 3))} | arrays)
    return name


def test_a_plan_goes_out_and_comes_back(capsys: pytest.CaptureFixture[str]) -> None:
    made = lcd(capsys, "plan", "demo", "--out", "p.json", "--html", "p.html", "--csv", "p.csv")
    assert (made["out"], made["html"], made["csv"]) == ("p.json", "p.html", ["p.csv"])
    assert all(Path(name).stat().st_size > 1000 for name in ("p.json", "p.html", "p.csv"))
    again = lcd(capsys, "plan", "demo", "--plan", "p.json", "--csv", "q.csv")
    assert again["plan_source"] == "p.json"
    assert again["trajectories"] == made["trajectories"]
    assert Path("q.csv").read_text() == Path("p.csv").read_text()
    assert "from p.json" in again["told"]
    polynomials = lcd(capsys, "plan", "demo", "--from-csv", "p.csv")
    assert polynomials["trajectories"][0]["method"] == "csv"
    assert polynomials["trajectories"][0]["duration_s"] == made["trajectories"][0]["duration_s"]


def test_the_cache_is_used_and_can_be_left_out(capsys: pytest.CaptureFixture[str]) -> None:
    cached = [lcd(capsys, "plan", "demo", *more)["trajectories"][0]["cached"] for more in ([], [], ["--no-cache"])]
    assert cached == [False, True, False]


def test_damage_to_the_cache_is_told_and_hurts_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    made = lcd(capsys, "plan", "demo")
    (kept,) = Path("cache/plans").iterdir()
    kept.write_text(kept.read_text()[:500])
    again = lcd(capsys, "plan", "demo")
    assert again["trajectories"] == made["trajectories"]
    assert "WARN the plan kept in " in again["told"]


def test_radians_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    from lcd_flight.mission.load import shipped_missions

    text = shipped_missions()["demo"].read_text().replace("yaw_deg: 90", "yaw_deg: 1.5708")
    Path("m.yaml").write_text(text)
    assert "1.5708 looks like radians; it is read as degrees, 90 was meant?" in lcd(capsys, "check", "m.yaml")["told"]


def test_a_refused_plan_is_drawn_all_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    from lcd_flight.mission.load import shipped_missions

    Path("m.yaml").write_text(shipped_missions()["demo"].read_text().replace("speed: 1.5", "speed: 2.6"))
    assert run(app, ["plan", "m.yaml", "--html", "p.html", "--out", "p.json"]) == 3
    captured = capsys.readouterr()
    assert "PLAN       refused; what it looks like: p.html" in captured.out
    reasons = [line.removeprefix("error: ") for line in captured.err.splitlines()]
    assert reasons
    page = Path("p.html").read_text()
    assert page.count("Refused: ") == len(reasons)
    assert not Path("p.json").exists()


@pytest.mark.parametrize("method", ["learned", "minimum-snap"])
def test_many_tasks(capsys: pytest.CaptureFixture[str], method: str) -> None:
    made = lcd(
        capsys, "plan", "--tasks", tasks(), "--world", "crazyflie-paper", "--method", method, "--out", "plans.npz"
    )
    assert (made["tasks"], made["segments"], made["method"]) == (2, 2, method)
    plans = load_plans(Path("plans.npz"))
    assert plans.about["method"] == method
    assert plans.trajectories.coefficients.shape == (2, 4, 2, 8)


def test_degrees_in_a_file_of_tasks_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    name = tasks(yaws=np.array([[0.0, 90.0, 180.0]] * 2))
    arguments = ("--world", "crazyflie-paper", "--method", "minimum-snap", "--out", "plans.npz")
    told = lcd(capsys, "plan", "--tasks", name, *arguments)["told"]
    assert "yaws go up to 180; they are read as radians, were degrees meant?" in told


NEVER = ("--world", "crazyflie-paper", "--out", "never.npz")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "give a MISSION; or --tasks FILE.npz --world W --out PLANS.npz"),
        (["demo", "--plan", "none.json"], "none.json: no such file"),
        (["demo", "--plan", "p.json", "--from-csv", "p.csv"], "--plan and --from-csv exclude each other"),
        (["demo", "--tasks", "tasks.npz", *NEVER], "--tasks and MISSION exclude each other; leave one out"),
        (["--tasks", "tasks.npz", "--html", "p.html", *NEVER], "--tasks and --html exclude each other"),
        (["--tasks", "tasks.npz"], "many tasks at once need all of --tasks FILE.npz, --world W and --out PLANS.npz"),
        (["--world", "crazyflie-paper"], "many tasks at once need all of"),
        (["--tasks", "none.npz", *NEVER], "none.npz: no such file"),
        (["--tasks", "tasks.npz", "--timing", "soon", *NEVER], "--timing soon: choose retimed or fixed"),
        (["--tasks", "tasks.npz", "--method", "magic", *NEVER], "no method `magic`; there are minimum-snap"),
        (["--tasks", "tasks.npz", "--world", "mars", "--out", "never.npz"], "world 'mars' is not known"),
        (["--tasks", "tasks.npz", "--world", "crazyflie-paper@99", "--out", "n.npz"], "world crazyflie-paper@99: 99 m"),
        (["--tasks", "equal.npz", *NEVER], "equal.npz: task 1: waypoints 1 and 2 are the same; leave one out"),
        (["--tasks", "one.npz", *NEVER], "one.npz: waypoints has shape (2, 1, 3); give (N, K, 3)"),
        (["--tasks", "nan.npz", *NEVER], "nan.npz: waypoints[0, 0, 0] is nan; give finite numbers"),
        (["--tasks", "flat.npz", *NEVER], "flat.npz: waypoints has shape (2, 3, 2)"),
        (
            ["--tasks", "tasks.npz", "--world", "crazyflie-paper", "--out", "tasks.npz/x.npz"],
            "tasks.npz/.x.npz.blocks/",
        ),
        (["--tasks", "tasks.npz", "--world", "crazyflie-paper", "--out", "."], ".: plans go to a file whose name ends"),
        (["demo", "--out", "."], ".: is a folder; name a file in it"),
        (["demo", "--html", "tasks.npz/p.html"], "tasks.npz/p.html: cannot be written (File exists)"),
        (["demo", "--csv", "tasks.npz/p.csv"], "tasks.npz/p.csv: cannot be written (File exists)"),
    ],
)
def test_wrong_input_is_one_line(capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    good = np.load(tasks())["waypoints"]
    equal, nan = good.copy(), good.copy()
    equal[1, 2], nan[0, 0, 0] = equal[1, 1], np.nan
    tasks("equal.npz", waypoints=equal)
    tasks("nan.npz", waypoints=nan)
    tasks("one.npz", waypoints=good[:, :1], yaws=np.zeros((2, 1)))
    tasks("flat.npz", waypoints=good[:, :, :2])
    assert refused(capsys, "plan", *arguments).startswith(message)
    assert not Path("never.npz").exists()
