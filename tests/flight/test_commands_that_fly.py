"""The commands as a user gives them: what they print last and how they exit."""

from __future__ import annotations

import json
import socket
from pathlib import Path
from typing import Any

import pytest

from lcd_flight import api
from lcd_flight.cli.main import app, flyer, run
from lcd_flight.errors import InputError
from lcd_flight.record import FlightLog

MISSIONS = Path(__file__).parents[2] / "missions"
FOUR = MISSIONS / "four_waypoints.yaml"


@pytest.fixture
def said(capsys: pytest.CaptureFixture[str]) -> Any:
    """Run a command with --json: its exit code, its object, and what it said to people."""

    def run_command(program: Any, *arguments: str) -> tuple[int, dict[str, Any], str]:
        code = run(program, [*arguments, "--json"])
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err
        return code, json.loads(captured.out.splitlines()[-1]), captured.err

    return run_command


def test_a_flight_in_virtual_time_says_the_same_twice(said: Any, tmp_path: Path) -> None:
    first, second = (said(flyer, str(FOUR), "--fast", "--log", str(tmp_path / name)) for name in "ab")
    assert first[0] == second[0] == 0
    paths = ("log", "report")
    numbers = [{k: v for k, v in facts.items() if k not in paths} for _, facts, _ in (first, second)]
    assert numbers[0] == numbers[1]
    facts = first[1]
    assert facts["outcome"] == "landed"
    assert 0.0 < facts["position_rmse_m"] < facts["max_position_error_m"] < 0.75
    assert len(facts["waypoint_errors_m"]) == 4
    assert facts["ticks"] > 1000
    assert facts["missed_ticks"] == 0
    assert facts["saturation_share"] == 0.0
    assert facts["predicted_max_error_m"] == pytest.approx(facts["max_position_error_m"], abs=0.05)
    assert Path(facts["log"]).parent == tmp_path / "a"
    assert Path(facts["report"]).stat().st_size < 2_000_000


def test_the_story_is_told_phase_by_phase(said: Any, tmp_path: Path) -> None:
    _, _, story = said(flyer, "demo", "--fast", "--log", str(tmp_path))
    labels = ["CHECK", "PLAN", "REHEARSE", "CONNECT", "PREFLIGHT", "TAKEOFF", "FLY", "LAND", "SUMMARY"]
    places = [story.index(f"\n{label}" if label != "CHECK" else label) for label in labels]
    assert places == sorted(places)


def test_review_measures_what_the_flight_said(said: Any, tmp_path: Path) -> None:
    _, flown, _ = said(flyer, str(FOUR), "--fast", "--log", str(tmp_path))
    picture = tmp_path / "path.svg"
    code, facts, _ = said(app, "review", flown["log"], "--out", str(tmp_path / "page.html"), "--picture", str(picture))
    assert code == 0
    assert facts["position_rmse_m"] == flown["position_rmse_m"]
    assert facts["overall_max_error_m"] == flown["max_position_error_m"]
    assert picture.read_text().startswith("<svg")


def test_plan_only_stops_after_the_rehearsal(said: Any, tmp_path: Path) -> None:
    code, facts, _ = said(flyer, str(FOUR), "--plan-only", "--rehearse", "5", "--log", str(tmp_path))
    assert (code, facts["outcome"], facts["log"]) == (0, "ok", None)
    assert not any(tmp_path.iterdir())
    (trajectory,) = facts["trajectories"]
    assert trajectory["method"] == "learned-polished"
    assert trajectory["predicted_max_error_m"] < trajectory["minimum_snap_predicted_max_error_m"]


def test_no_arm_turns_no_motor(said: Any, tmp_path: Path) -> None:
    code, facts, story = said(flyer, str(FOUR), "--no-arm", "--fast", "--log", str(tmp_path))
    assert (code, facts["outcome"]) == (0, "ok")
    assert facts["position_rmse_m"] is None
    assert "TAKEOFF" not in story
    assert Path(facts["log"]).exists()


def test_a_refused_rehearsal_exits_with_3(said: Any, tmp_path: Path) -> None:
    mission = tmp_path / "mission.yaml"
    text = (MISSIONS / "saturating_task.yaml").read_text()
    mission.write_text(text.replace("type: learned-polished", "type: minimum-snap"))
    code, facts, _ = said(flyer, str(mission), "--fast", "--log", str(tmp_path / "log"))
    assert (code, facts["outcome"]) == (3, "refused")
    assert "trouble begins in" in facts["error"]
    assert not (tmp_path / "log").exists()


def test_a_folder_that_takes_no_log_is_refused(said: Any, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    code, facts, _ = said(flyer, str(FOUR), "--fast", "--log", str(tmp_path / "file" / "log"))
    assert (code, facts["outcome"]) == (3, "refused")
    assert "--log DIR" in facts["error"]


def test_a_port_in_use_is_refused(said: Any, tmp_path: Path) -> None:
    with socket.socket() as holder:
        holder.bind(("127.0.0.1", 0))
        holder.listen()
        endpoint = f"tcp://127.0.0.1:{holder.getsockname()[1]}"
        mission = tmp_path / "mission.yaml"
        mission.write_text(FOUR.read_text().replace("tcp://127.0.0.1:5555", endpoint))
        code, facts, _ = said(flyer, str(mission), "--log", str(tmp_path))
    assert (code, facts["outcome"]) == (3, "refused")
    assert endpoint in facts["error"]
    assert "motion_capture.endpoint" in facts["error"]


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("--link", "carrier-pigeon://0"), "unknown link"),
        (("--link", "radio://0/80/2M/E7E7E7E7E7"), "--fast flies the simulator only"),
        (("--link", "sim://?no_such=1"), "no_such"),
        (("--link", "nonsense"), "not a URI"),
    ],
)
def test_a_link_that_is_none_is_wrong_input(said: Any, tmp_path: Path, arguments: tuple[str, ...], reason: str) -> None:
    code, facts, _ = said(flyer, str(FOUR), "--fast", "--log", str(tmp_path), *arguments)
    assert (code, facts["outcome"]) == (2, "invalid_input")
    assert reason in facts["error"]


def test_losing_the_vehicle_is_a_crash_or_a_cut(said: Any, tmp_path: Path) -> None:
    code, facts, _ = said(flyer, str(FOUR), "--fast", "--log", str(tmp_path), "--link", "sim://?die_s=6")
    assert code == 5
    assert facts["outcome"] in ("crashed", "cut")
    assert Path(facts["report"]).exists()


def test_losing_the_pose_ends_early(said: Any, tmp_path: Path) -> None:
    link = "sim://?pose_gap_s=6&pose_gap_ms=250"
    code, facts, _ = said(flyer, str(FOUR), "--fast", "--log", str(tmp_path), "--link", link)
    assert (code, facts["outcome"]) == (4, "aborted")
    assert facts["reason"]


def test_evaluate_prints_the_methods(said: Any) -> None:
    code, facts, _ = said(
        app, "evaluate", "--world", "crazyflie-saturated", "--count", "5", "--methods", "minimum-snap,learned"
    )
    assert code == 0
    assert set(facts["methods"]) == {"minimum-snap", "learned"}
    for row in facts["methods"].values():
        assert 0.0 <= row["crash_rate"] <= 100.0
        assert row["tasks"] == 5


def test_bench_lists_what_there_is(said: Any) -> None:
    code, facts, _ = said(app, "bench")
    assert code == 0
    assert {"rollouts", "plan", "mocap", "log"} <= set(facts["benchmarks"])


def test_an_unknown_link_in_the_mission_is_told_before_planning(said: Any, tmp_path: Path) -> None:
    mission = tmp_path / "mission.yaml"
    mission.write_text(FOUR.read_text().replace("sim://", "simm://"))
    code, facts, story = said(flyer, str(mission), "--log", str(tmp_path))
    assert code == 2
    assert facts["error"].startswith(f"{mission}:9: vehicle.uri: unknown link 'simm'")
    assert "PLAN" not in story
    code, _, story = said(app, "check", str(mission))
    assert code == 0
    assert "WARN" in story
    assert "unknown link 'simm'" in story


def test_a_path_refused_says_that_the_learned_plan_was_not_used(said: Any, tmp_path: Path) -> None:
    mission = tmp_path / "mission.yaml"
    slow = (
        FOUR.read_text().replace("speed: 1.5 ", "speed: 0.2 ").replace("max: [4.5, 4.5, 3.5]", "max: [2.6, 2.6, 1.9]")
    )
    mission.write_text(slow.replace("type: learned-polished", "type: learned"))
    code, facts, _ = said(app, "plan", str(mission))
    assert code == 3
    assert "outside safety.geofence" in facts["error"]
    assert "the plan asked for was not used" in facts["error"]


def test_a_report_that_cannot_be_written_leaves_a_landed_flight(
    said: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_log: FlightLog, path: Path) -> Path:
        raise InputError(f"{path}: cannot be written (no space left on device)")

    monkeypatch.setattr(api, "write_page", full)
    code, facts, story = said(flyer, str(FOUR), "--fast", "--log", str(tmp_path))
    assert (code, facts["outcome"], facts["report"]) == (0, "landed", None)
    assert "no report" in story
    assert Path(facts["log"]).exists()
