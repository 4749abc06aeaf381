"""A polynomial CSV as a mission's plan: exact ones come out as they went in, rounded ones are mended, or refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from plan_bench import VEHICLE, WAYPOINTS, mission, planned, trajectory

from lcd_flight.mission.plan_csv import planned_from_csv, read_csv, write_csv
from lcd_flight.mission.soundness import flaw
from lcd_flight.model import InputError, LegKind, RefusedError, Trajectory
from lcd_flight.wire.polynomial_csv import encode

STRAIGHT = """\
Duration,x^0,x^1,x^2,x^3,x^4,x^5,x^6,x^7,y^0,y^1,y^2,y^3,y^4,y^5,y^6,y^7,z^0,z^1,z^2,z^3,z^4,z^5,z^6,z^7,yaw^0,yaw^1,yaw^2,yaw^3,yaw^4,yaw^5,yaw^6,yaw^7,
2.000000,0.000000,0.000000,0.000000,0.000000,4.375000,-5.250000,2.187500,-0.312500,0,0,0,0,0,0,0,0,1.000000,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,
"""
"""2 m along x in 2 s from rest to rest: 2 (35 s^4 - 84 s^5 + 70 s^6 - 20 s^7) of s = t / 2."""
TWO = [{"position": [0, 0, 1]}, {"position": [2, 0, 1]}]


def flown(mission_csv: tuple[Path, ...], **sections: Any) -> Trajectory:
    plan = planned_from_csv(mission_csv, mission(**sections), VEHICLE).plan
    return next(leg.trajectory for leg in plan.legs if leg.kind is LegKind.TRAJECTORY)


def items(*waypoints: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [{"takeoff": {"height": 1}}, *map(trajectory, waypoints), {"land": {}}]


def written(folder: Path, text: str) -> Path:
    path = folder / "plan.csv"
    path.write_text(text)
    return path


def rounded(plan: Trajectory, digits: int) -> str:
    return encode(Trajectory(plan.durations_s.round(digits), plan.coefficients.round(digits)))


def refused(path: Path, **sections: Any) -> str:
    with pytest.raises(InputError) as caught:
        flown((path,), **sections)
    (line,) = str(caught.value).splitlines()
    return line.removeprefix(f"{path}: ")


def test_our_own_comes_back(tmp_path: Path) -> None:
    made = planned()
    (path,) = write_csv(tmp_path / "plan.csv", made)
    original, found = made.solutions[0].trajectory, flown((path,))
    assert np.array_equal(found.durations_s, original.durations_s)
    assert np.allclose(found.coefficients, original.coefficients, rtol=1e-9, atol=1e-9)


def test_a_file_as_it_stands(tmp_path: Path) -> None:
    found = flown((written(tmp_path, STRAIGHT),), plan=items(TWO))
    assert found.durations_s.tolist() == [2.0]
    assert found.coefficients[0, 0].tolist() == [0, 0, 0, 0, 4.375, -5.25, 2.1875, -0.3125]
    assert found.derivative(np.array([1.0]), 0)[0].tolist() == [1.0, 0.0, 1.0, 0.0]
    assert found.derivative(np.array([1.0]), 1)[0, 0] == 35 / 16  # the peak speed of 2 m in 2 s


@pytest.mark.parametrize("digits", [4, 6])
def test_rounded_files_are_mended(tmp_path: Path, digits: int) -> None:
    original = planned().solutions[0].trajectory
    path = written(tmp_path, rounded(original, digits))
    waypoints = original.waypoints()
    assert flaw(read_csv(path), waypoints) is not None
    found = flown((path,))
    assert flaw(found, waypoints) is None
    times = np.linspace(0.0, original.duration_s, 500)
    assert np.abs(found.derivative(times, 0) - original.derivative(times, 0)).max() < 50.0 * 10.0**-digits


def test_it_brings_its_own_times(tmp_path: Path) -> None:
    path = written(tmp_path, STRAIGHT)
    assert flown((path,), plan=items(TWO), planner={"speed": 0.7}).duration_s == 2.0
    timed = [TWO[0], TWO[1] | {"time": 2.5}]
    assert "brings its own times, but plan[1].trajectory gives times" in refused(path, plan=items(timed))
    assert flown((path,), plan=items([TWO[0], TWO[1] | {"time": 2.0}])).duration_s == 2.0


def test_whole_turns_of_yaw_do_not_matter(tmp_path: Path) -> None:
    row = STRAIGHT.splitlines()[1].split(",")
    row[25] = repr(2.0 * np.pi)
    path = written(tmp_path, ",".join(row))
    assert flown((path,), plan=items(TWO)).waypoints()[:, 3].tolist() == [0.0, 0.0]


def test_one_file_for_each_trajectory(tmp_path: Path) -> None:
    twice = mission(trajectory(), trajectory(WAYPOINTS[::-1]))
    paths = write_csv(tmp_path / "plan.csv", planned(twice))
    assert [path.name for path in paths] == ["plan-1.csv", "plan-2.csv"]
    read = planned_from_csv(paths, twice, VEHICLE)
    assert [summary.method for summary in read.summaries] == ["csv", "csv"]
    assert read.methods == "csv"
    with pytest.raises(InputError, match=r"1 polynomial CSV file\(s\) for 2 trajectories; give one for each"):
        planned_from_csv(paths[:1], twice, VEHICLE)


def test_other_waypoints(tmp_path: Path) -> None:
    path = written(tmp_path, STRAIGHT)
    off = refused(path, plan=items([TWO[0], {"position": [2, 0.2, 1]}]))
    assert off == "is 0.2 m in y from waypoint 2 of plan[1].trajectory; write the waypoints that it goes through"
    turned = refused(path, plan=items([TWO[0], TWO[1] | {"yaw_deg": 90}]))
    assert turned.startswith("is 1.57 rad in yaw from waypoint 2")
    assert refused(path).startswith("has 1 segments, plan[1].trajectory has 4 waypoints; they must be the ends")


def test_a_jump_is_not_mended(tmp_path: Path) -> None:
    original = planned().solutions[0].trajectory
    coefficients = original.coefficients.copy()
    coefficients[1, 1, 1] += 0.5
    coefficients[1, 1, 2] -= 0.5 / original.durations_s[1]  # the waypoints hold; the velocity jumps
    line = refused(written(tmp_path, encode(Trajectory(original.durations_s, coefficients))))
    assert line.startswith("is not continuous: y's ")
    assert line.endswith("make it smooth to jerk and at rest at both ends")


def test_a_rolling_start_is_refused(tmp_path: Path) -> None:
    rolling = Trajectory(np.array([2.0]), np.zeros((4, 1, 8)))
    rolling.coefficients[0, 0, 1], rolling.coefficients[2, 0, 0] = 1.0, 1.0
    line = refused(written(tmp_path, encode(rolling)), plan=items(TWO))
    assert line.startswith("is not at rest at its start: x's velocity is 1")


def test_wrong_files_are_named(tmp_path: Path) -> None:
    assert refused(written(tmp_path, "1,2,3")) == "line 1 has 3 numbers; a segment has 33"
    assert "no such file" in refused(tmp_path / "none.csv")


def test_the_missions_limits_hold(tmp_path: Path) -> None:
    path = written(tmp_path, STRAIGHT)
    with pytest.raises(RefusedError, match=r"planned speed 2\.19 m/s at 1\.00 s"):
        flown((path,), plan=items(TWO), planner={"limits": {"max_velocity": 2.0}})


def test_nothing_to_write(tmp_path: Path) -> None:
    hovering = mission(plan=[{"takeoff": {"height": 1}}, {"land": {}}])
    with pytest.raises(InputError, match="the mission has no trajectory to write"):
        write_csv(tmp_path / "plan.csv", planned(hovering))
