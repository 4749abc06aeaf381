"""Plan files: what is written is read again to the bit, and whatever does not fit is refused in one line."""

from __future__ import annotations

import errno
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest
from plan_bench import VEHICLE, WAYPOINTS, edited, mission, plan_file, planned, trajectory

from lcd_flight.mission.plan_file import FORMAT, VERSION, planned_from_file, write_plan
from lcd_flight.model import GeometricGains, InputError, RefusedError
from lcd_flight.worlds import fingerprint

Edit: TypeAlias = Callable[[dict[str, Any]], Any]


def first(data: dict[str, Any]) -> dict[str, Any]:
    return data["trajectories"][0]


def refused(path: Path, **sections: Any) -> str:
    """The one line with which a file is refused."""
    with pytest.raises(InputError) as caught:
        planned_from_file(path, mission(**sections), VEHICLE)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}: ")
    return line.removeprefix(f"{path}: ")


def test_a_plan_comes_back_to_the_bit(tmp_path: Path) -> None:
    made = planned()
    read = planned_from_file(plan_file(tmp_path), mission(), VEHICLE)
    for there, here in zip(made.plan.legs, read.plan.legs, strict=True):
        assert np.array_equal(there.trajectory.durations_s, here.trajectory.durations_s)
        assert np.array_equal(there.trajectory.coefficients, here.trajectory.coefficients)
    assert read.summaries == made.summaries
    assert read.source == str(tmp_path / "plan.json")
    assert made.summaries[0].method == "learned"
    assert made.summaries[0].segment_errors_m is not None


def test_the_same_plan_is_the_same_file(tmp_path: Path) -> None:
    text = plan_file(tmp_path).read_text()
    assert plan_file(tmp_path).read_text() == text
    again = planned_from_file(tmp_path / "plan.json", mission(), VEHICLE)
    write_plan(tmp_path / "again.json", again, mission(), VEHICLE)
    assert (tmp_path / "again.json").read_text() == text


def test_what_a_file_says_of_itself(tmp_path: Path) -> None:
    data = json.loads(plan_file(tmp_path).read_text())
    assert (data["format"], data["version"], data["mission"]) == (FORMAT, VERSION, "bench")
    assert data["vehicle"] == {"name": "crazyflie", "loop": "flight", "fingerprint": fingerprint(VEHICLE, "flight")}
    found = first(data)
    assert found["method"] == "learned"
    assert found["options"]["timing"] == "retimed"
    assert found["model"]["name"] == "crazyflie-flight"
    assert len(found["model"]["hash"]) == 16
    assert np.shape(found["coefficients"]) == (4, 3, 8)
    assert found["asked_durations_s"] == pytest.approx(
        np.linalg.norm(np.diff(found["waypoints"], axis=0)[:, :3], axis=1) / 1.5
    )
    assert sum(found["durations_s"]) == pytest.approx(sum(found["asked_durations_s"]))


def test_two_trajectories(tmp_path: Path) -> None:
    twice = mission(trajectory(), trajectory(WAYPOINTS[::-1]))
    path = plan_file(tmp_path, twice)
    assert len(planned_from_file(path, twice, VEHICLE).summaries) == 2
    assert "made for 2 trajectories, the mission has 1" in refused(path)


def test_a_renamed_mission_may_fly_it_and_is_told(tmp_path: Path) -> None:
    (note,) = planned_from_file(plan_file(tmp_path), mission(name="other"), VEHICLE).notes
    assert note.endswith("made for the mission bench; its waypoints are those of other")


def test_other_waypoints(tmp_path: Path) -> None:
    moved = [*WAYPOINTS[:2], WAYPOINTS[2] | {"position": [2.5, 2, 1.9]}, WAYPOINTS[3]]
    line = refused(plan_file(tmp_path), plan=[{"takeoff": {"height": 1}}, trajectory(moved), {"land": {}}])
    assert line.startswith("trajectories[0]: was planned for waypoint 3 at (2.500, 2.000, 1.800) m, yaw 90.0 deg")
    assert "the mission has it at (2.500, 2.000, 1.900) m" in line
    assert "(plan[1].trajectory); make it again with `lcd plan" in line


def test_another_heading(tmp_path: Path) -> None:
    turned = [*WAYPOINTS[:2], WAYPOINTS[2] | {"yaw_deg": 80}, WAYPOINTS[3]]
    line = refused(plan_file(tmp_path), plan=[{"takeoff": {"height": 1}}, trajectory(turned), {"land": {}}])
    assert "yaw 90.0 deg, the mission has it at (2.500, 2.000, 1.800) m, yaw 80.0 deg" in line


def test_more_waypoints(tmp_path: Path) -> None:
    more = [*WAYPOINTS, {"position": [0, 0, 1]}]
    line = refused(plan_file(tmp_path), plan=[{"takeoff": {"height": 1}}, trajectory(more), {"land": {}}])
    assert "was planned for 4 waypoints, the mission has 5" in line


def test_another_speed(tmp_path: Path) -> None:
    line = refused(plan_file(tmp_path), planner={"speed": 1.2})
    assert "was planned for 3.510 s from the first waypoint to the last, the mission asks for 4.388 s" in line


def test_times_that_the_mission_gives_are_kept_by_plans_with_their_own(tmp_path: Path) -> None:
    own = edited(plan_file(tmp_path), lambda data: first(data).update(asked_durations_s=None))
    (summary,) = planned_from_file(own, mission(planner={"speed": 1.2}), VEHICLE).summaries
    assert summary.duration_s == pytest.approx(3.51, abs=0.01)
    timed = [WAYPOINTS[0], WAYPOINTS[1] | {"time": 2.0}, *WAYPOINTS[2:]]
    line = refused(own, plan=[{"takeoff": {"height": 1}}, trajectory(timed), {"land": {}}])
    assert "was planned for" in line


def test_another_vehicle_and_other_gains(tmp_path: Path) -> None:
    path = plan_file(tmp_path)
    gains = GeometricGains((1.0, 1.0, 1.0), (1.0, 1.0, 1.0), 1.0, 1.0)
    for other in (replace(VEHICLE, mass_kg=0.031), replace(VEHICLE, flight_gains=gains)):
        with pytest.raises(InputError, match=r"plan\.json: made for another vehicle or other gains"):
            planned_from_file(path, mission(), other)
    noisier = replace(VEHICLE, motor_noise=10.0)  # a disturbance is no other vehicle
    assert planned_from_file(path, mission(), noisier).summaries


def test_the_missions_limits_hold_for_a_file_too(tmp_path: Path) -> None:
    low = {"geofence": {"min": [-4, -4, 0], "max": [2.6, 6, 4]}}
    with pytest.raises(RefusedError, match=r"outside safety\.geofence"):
        planned_from_file(plan_file(tmp_path), mission(safety=low), VEHICLE)


def coefficient(value: Any) -> Edit:
    """Put something else in the place of one coefficient."""
    return lambda data: first(data)["coefficients"][0][1].__setitem__(3, value)


ONE_COEFFICIENT = "trajectories[0].coefficients[0][1][3]"


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda d: d.update(version=2), f"plan version 2, this program reads {VERSION}; make it again"),
        (lambda d: d.pop("format"), 'no plan file (it has no "format": "lcd-flight plan")'),
        (lambda d: d.pop("vehicle"), "vehicle: Field required"),
        (lambda d: d.update(colour="red"), "colour: 'red': Extra inputs are not permitted"),
        (
            lambda d: first(d)["durations_s"].__setitem__(1, -1.0),
            "trajectories[0].durations_s[1]: '-1.0': Input should",
        ),
        (lambda d: first(d)["durations_s"].append(1.0), "trajectories[0]: damaged: has 4 durations, but other numbers"),
        (lambda d: first(d)["coefficients"].pop(), "trajectories[0].coefficients[3]: Field required"),
        (lambda d: first(d)["coefficients"][0][1].pop(), "coefficients[0][1]: Tuple should have at least 8"),
        (coefficient(float("nan")), f"{ONE_COEFFICIENT}: 'nan': Input should be a finite number"),
        (coefficient("1.0"), f"{ONE_COEFFICIENT}: '1.0': Input should be a valid number"),
        (coefficient(0.5), "trajectories[0]: damaged: "),
        (lambda d: first(d)["waypoints"][1].__setitem__(0, 1.6), "damaged: misses waypoint 2 by 0.1 m in x"),
        (lambda d: first(d)["predictions"]["segment_errors_m"].pop(), "damaged: has 2 segment_errors_m for 3 segments"),
        (lambda d: d.update(trajectories=[]), "made for 0 trajectories, the mission has 1"),
    ],
)
def test_damage_is_one_line(tmp_path: Path, edit: Edit, message: str) -> None:
    line = refused(edited(plan_file(tmp_path), edit))
    assert message in line
    assert line.endswith("make it again with `lcd plan MISSION --out FILE`")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "no plan file (EOF while parsing"),
        (b"duration,x^0", "no plan file (expected value"),
        (b"[1, 2]", 'no plan file (it has no "format"'),
        (b"\xff\xfe\x00", "byte 0xff is not UTF-8"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "plan.json"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        planned_from_file(path, mission(), VEHICLE)
    assert message in str(caught.value)


def test_a_cut_file_is_refused(tmp_path: Path) -> None:
    path = plan_file(tmp_path)
    path.write_text(path.read_text()[:1000])
    assert "no plan file (EOF while parsing" in refused(path)


def test_a_full_disk_leaves_the_file_that_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = plan_file(tmp_path)
    before = path.read_bytes()

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(InputError, match=r"plan\.json: cannot be written \(No space left on device\)"):
        write_plan(path, planned(), mission(), VEHICLE)
    assert path.read_bytes() == before
    assert [kept.name for kept in tmp_path.iterdir()] == ["plan.json"]


def test_places_that_cannot_be_read_or_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.json: no such file"):
        planned_from_file(tmp_path / "none.json", mission(), VEHICLE)
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"plan\.json: cannot be written \(File exists\)"):
        write_plan(tmp_path / "file" / "plan.json", planned(), mission(), VEHICLE)
    with pytest.raises(InputError, match="is a folder; name a file in it"):
        write_plan(tmp_path, planned(), mission(), VEHICLE)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
