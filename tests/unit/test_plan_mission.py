"""The planning step: which planner, which model, what is summed up, and what is refused."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcd_flight.mission import Mission, load_mission
from lcd_flight.mission.airframe import vehicle_of
from lcd_flight.mission.path_checks import violations
from lcd_flight.mission.plan_mission import load_cost, plan_mission
from lcd_flight.model import FloatArray, InputError, LegKind, RefusedError
from lcd_flight.planning.cost.proxy import ThrustProxy
from lcd_flight.worlds import load_vehicle

VEHICLE = load_vehicle("crazyflie")
WAYPOINTS: list[dict[str, Any]] = [
    {"position": [0, 0, 1]},
    {"position": [1.5, 0.5, 1.2]},
    {"position": [2.5, 2, 1.8], "yaw_deg": 90},
    {"position": [1, 2.5, 1]},
]


def mission(**sections: Any) -> Mission:
    """The four waypoints in a large room, with `sections` changed."""
    data: dict[str, Any] = {
        "version": 1,
        "name": "t",
        "vehicle": {"type": "crazyflie"},
        "plan": [{"takeoff": {"height": 1}}, {"trajectory": {"waypoints": WAYPOINTS}}, {"land": {}}],
        "safety": {"geofence": {"min": [-4, -4, 0], "max": [6, 6, 4]}},
    }
    return Mission.model_validate(data | sections)


def planner(**keys: Any) -> Mission:
    return mission(planner={"type": "minimum-snap", "speed": 1.5, **keys})


class Unanswering(ThrustProxy):
    """A cost that has no answer anywhere."""

    def value_and_gradient(
        self, durations_s: FloatArray, coefficients: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Nothing but NaN."""
        value, by_durations, by_coefficients = super().value_and_gradient(durations_s, coefficients)
        return value * np.nan, by_durations * np.nan, by_coefficients * np.nan


def test_minimum_snap_asks_no_cost() -> None:
    planned = plan_mission(planner(), VEHICLE, Unanswering())
    (summary,) = planned.summaries
    assert (summary.method, summary.fallback, summary.cost) == ("minimum-snap", None, None)
    assert summary.segment_errors_m is None
    assert (summary.item, summary.place, summary.waypoints) == (1, "plan[1].trajectory", 4)
    assert summary.relative_snap == 1.0
    assert summary.peaks == summary.minimum_snap_peaks
    assert summary.duration_s == pytest.approx(summary.length_m / 1.5)


def test_the_learned_planner_lowers_its_cost_and_keeps_waypoints_and_total_time() -> None:
    planned = plan_mission(planner(type="learned"), VEHICLE, ThrustProxy())
    (summary,) = planned.summaries
    assert summary.method == "learned"
    assert summary.cost is not None
    assert summary.minimum_snap_cost is not None
    assert summary.cost < summary.minimum_snap_cost
    assert summary.duration_s == pytest.approx(summary.length_m / 1.5)
    leg = next(leg for leg in planned.plan.legs if leg.kind is LegKind.TRAJECTORY)
    assert leg.waypoints is not None
    assert np.abs(leg.trajectory.waypoints() - leg.waypoints).max() < 1e-9
    assert leg.baseline is not None
    assert np.abs(leg.baseline.waypoints() - leg.waypoints).max() < 1e-9
    assert np.abs(leg.baseline.durations_s - leg.trajectory.durations_s).max() > 0.01


def test_a_learned_cost_tells_what_it_expects_of_each_segment() -> None:
    (summary,) = plan_mission(planner(type="learned"), VEHICLE).summaries
    assert summary.segment_errors_m is not None
    assert summary.minimum_snap_segment_errors_m is not None
    assert len(summary.segment_errors_m) == len(summary.minimum_snap_segment_errors_m) == 3
    assert max(summary.segment_errors_m) == pytest.approx(summary.predicted_max_error_m)
    assert max(summary.minimum_snap_segment_errors_m) == pytest.approx(summary.minimum_snap_predicted_max_error_m)


def test_given_times_are_kept() -> None:
    timed = [WAYPOINTS[0], WAYPOINTS[1] | {"time": 1.5}, *WAYPOINTS[2:]]
    plan = [{"takeoff": {"height": 1}}, {"trajectory": {"waypoints": timed}}, {"land": {}}]
    planned = plan_mission(mission(plan=plan, planner={"type": "learned", "speed": 1.5}), VEHICLE, ThrustProxy())
    leg = next(leg for leg in planned.plan.legs if leg.kind is LegKind.TRAJECTORY)
    assert leg.baseline is not None
    assert leg.trajectory.durations_s.tolist() == leg.baseline.durations_s.tolist()
    assert leg.trajectory.durations_s[0] == 1.5
    assert planned.summaries[0].method == "learned"


def test_the_weight_of_the_cost_reaches_the_planner() -> None:
    light, heavy = (
        plan_mission(planner(type="learned", weight=weight), VEHICLE, ThrustProxy()).summaries[0]
        for weight in (0.01, 10.0)
    )
    assert light.cost is not None
    assert heavy.cost is not None
    assert heavy.cost < light.cost


def test_a_cost_without_answers_falls_back_to_minimum_snap_and_says_so() -> None:
    (summary,) = plan_mission(planner(type="learned"), VEHICLE, Unanswering()).summaries
    assert summary.method == "minimum-snap"
    assert summary.fallback
    assert summary.cost is None
    assert summary.peaks == summary.minimum_snap_peaks


def test_two_waypoints_can_be_planned() -> None:
    plan = [{"takeoff": {"height": 1}}, {"trajectory": {"waypoints": WAYPOINTS[:2]}}, {"land": {}}]
    assert plan_mission(mission(plan=plan), VEHICLE, ThrustProxy()).summaries[0].waypoints == 2


def test_a_mission_without_trajectories_needs_no_model() -> None:
    plan = [{"takeoff": {"height": 1}}, {"hold": {"duration": 2}}, {"land": {}}]
    planned = plan_mission(mission(plan=plan), VEHICLE)
    assert planned.summaries == ()
    assert len(planned.plan.legs) == 4


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            {"speed": 2.2, "limits": {"max_velocity": 3.0, "max_tilt_deg": 170, "max_thrust_ratio": 3}},
            "planned speed 5.22 m/s",
        ),
        ({"speed": 2.0, "limits": {"max_velocity": 9.0, "max_tilt_deg": 60}}, "planned tilt 68.3 deg"),
        ({"speed": 2.37, "limits": {"max_velocity": 9.0, "max_tilt_deg": 170}}, "planned thrust 97.2 % of full thrust"),
    ],
)
def test_plans_beyond_the_limits_are_refused(keys: dict[str, Any], message: str) -> None:
    with pytest.raises(RefusedError) as caught:
        plan_mission(planner(**keys), VEHICLE)
    lines = str(caught.value).splitlines()
    assert len(lines) == 1
    assert lines[0].startswith(f"plan[1].trajectory: {message}")
    assert "raise planner.limits." in lines[0]


def test_a_path_that_leaves_the_fence_between_waypoints_is_refused() -> None:
    # the curve through these four points swings out beyond x = 2.5, which every waypoint keeps
    fence = {"geofence": {"min": [-4, -4, 0], "max": [2.55, 6, 4]}}
    with pytest.raises(RefusedError) as caught:
        plan_mission(mission(planner={"type": "minimum-snap"}, safety=fence), VEHICLE)
    (line,) = str(caught.value).splitlines()
    assert line.startswith("plan[1].trajectory: planned path is ")
    assert "m outside safety.geofence at " in line


def test_a_path_too_fast_towards_the_fence_is_refused() -> None:
    waypoints = [{"position": [0, 0, 1]}, {"position": [3, 0, 1]}]
    plan = [{"takeoff": {"height": 1}}, {"trajectory": {"waypoints": waypoints}}, {"land": {}}]
    fence = {"geofence": {"min": [-4, -4, 0], "max": [3.05, 6, 4]}}
    slow, fast = ({"type": "minimum-snap", "speed": speed} for speed in (1.0, 2.0))
    plan_mission(mission(plan=plan, planner=slow, safety=fence), VEHICLE)
    with pytest.raises(RefusedError, match=r"so fast towards the fence at .* a stop would end .* m outside"):
        plan_mission(mission(plan=plan, planner=fast, safety=fence), VEHICLE)


def test_a_flight_longer_than_the_battery_is_refused() -> None:
    tired = mission(planner={"type": "minimum-snap"}, vehicle={"type": "crazyflie", "battery": {"endurance": 10.0}})
    with pytest.raises(RefusedError, match=r"^plan: takes \d+ s, more than vehicle.battery.endurance 10 s; fly less"):
        plan_mission(tired, VEHICLE)


def test_every_refusal_is_told_with_its_line(tmp_path: Path) -> None:
    text = Path(__file__).parents[2].joinpath("missions", "four_waypoints.yaml").read_text(encoding="utf-8")
    text = text.replace("type: learned-polished", "type: minimum-snap").replace("speed: 1.5", "speed: 2.37")
    path = tmp_path / "fast.yaml"
    path.write_text(text, encoding="utf-8")
    described = load_mission(path)
    with pytest.raises(RefusedError) as caught:
        plan_mission(described, VEHICLE)
    lines = str(caught.value).splitlines()
    assert len(lines) == 4
    line = described.source.lines[("plan", 2, "trajectory")]
    assert all(told.startswith(f"{path}:{line}: plan[2].trajectory: ") for told in lines)


def test_the_model_is_named_by_the_mission_or_by_the_vehicle(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="none-such"):
        load_cost(planner(type="learned", model="none-such"), VEHICLE)
    with pytest.raises(InputError, match=r"mine\.safetensors: there is no such model file"):
        load_cost(planner(type="learned", model="mine.safetensors"), VEHICLE)
    from dataclasses import replace

    with pytest.raises(InputError, match="mine-flight"):
        load_cost(planner(type="learned"), replace(VEHICLE, name="mine"))


def test_a_right_plan_has_no_violations() -> None:
    planned = plan_mission(planner(), VEHICLE)
    assert list(violations(planned.plan, planner(), VEHICLE)) == []


def test_a_damaged_model_is_told_with_file_line_and_key(tmp_path: Path) -> None:
    shipped = Path(str(resources.files("lcd_flight.planning") / "models" / "crazyflie-flight.safetensors"))
    data = bytearray(shipped.read_bytes())
    data[-1000] ^= 1
    (tmp_path / "bad.safetensors").write_bytes(data)
    mission = tmp_path / "mission.yaml"
    text = (Path(__file__).parents[2] / "missions" / "four_waypoints.yaml").read_text()
    mission.write_text(text.replace("type: learned-polished\n", "type: learned\n  model: bad.safetensors\n"))
    loaded = load_mission(mission)
    with pytest.raises(InputError, match=r"mission\.yaml:\d+: planner\.model: .*checksum"):
        load_cost(loaded, vehicle_of(loaded))
