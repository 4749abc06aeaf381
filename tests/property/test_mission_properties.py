"""Random right missions: they load, come back the same, and become flights without a jump."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lcd_flight.mission import Mission, load_mission
from lcd_flight.mission.assemble import Planned, flight_plan, trajectory_tasks
from lcd_flight.mission.schema import mission_schema
from lcd_flight.model import InputError, LegKind
from lcd_flight.planning.minimum_snap import minimum_snap


def rounded(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers as people write them."""
    return st.floats(low, high).map(lambda x: round(x, 3))


POINT = st.tuples(rounded(-4, 4), rounded(-4, 4), rounded(0.3, 4)).map(list)
YAW = rounded(-360, 360)
WAYPOINT = st.fixed_dictionaries({"position": POINT}, optional={"yaw_deg": YAW})


def apart(waypoints: list[dict[str, Any]]) -> bool:
    points = [waypoint["position"] for waypoint in waypoints]
    return all(math.dist(a, b) > 0.05 for a, b in pairwise(points))


TRAJECTORY = st.lists(WAYPOINT, min_size=2, max_size=6).filter(apart).map(lambda w: {"trajectory": {"waypoints": w}})
HOLD = rounded(0.1, 20).map(lambda s: {"hold": {"duration": s}})
TAKEOFF = st.fixed_dictionaries({"height": rounded(0.2, 3)}, optional={"duration": rounded(2, 5)})
LAND = st.fixed_dictionaries({}, optional={"position": POINT, "height": rounded(0.1, 1), "duration": rounded(1, 5)})


@st.composite
def missions(draw: st.DrawFn) -> dict[str, Any]:
    items = draw(st.lists(TRAJECTORY | HOLD, max_size=4))
    return {
        "version": 1,
        "name": draw(st.from_regex(r"\A[A-Za-z][A-Za-z0-9._-]{0,20}\Z").filter(lambda n: n.lower() not in YAML_WORDS)),
        "seed": draw(st.integers(0, 2**32 - 1)),
        "vehicle": {"type": "crazyflie", "initial_position": draw(POINT), "initial_yaw_deg": draw(YAW)},
        "planner": {"type": draw(st.sampled_from(["learned", "minimum-snap"])), "speed": draw(rounded(0.1, 4))},
        "plan": [{"takeoff": draw(TAKEOFF)}, *items, {"land": draw(LAND)}],
        "safety": {"geofence": {"min": [-5, -5, 0], "max": [5, 5, 8]}, "max_predicted_error": draw(rounded(0.1, 1.5))},
        "rehearse": {"runs": draw(st.integers(1, 100)), "faults": draw(st.sampled_from([[], ["motor_noise"]]))},
    }


YAML_WORDS = {"yes", "no", "on", "off", "y", "n", "true", "false", "null"}


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=missions())
def test_right_missions_load_and_come_back_the_same(data: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    mission = load_mission(path)
    again = yaml.safe_dump(mission.model_dump(by_alias=True, mode="json"))
    path.write_text(again, encoding="utf-8")
    assert load_mission(path) == mission


@settings(max_examples=30, deadline=None)
@given(data=missions())
def test_right_missions_are_valid_by_the_schema(data: dict[str, Any]) -> None:
    import jsonschema

    jsonschema.Draft202012Validator(mission_schema()).validate(data)


@settings(max_examples=40, deadline=None)
@given(data=missions())
def test_every_leg_begins_at_rest_where_the_one_before_ended(data: dict[str, Any]) -> None:
    mission = Mission.model_validate(data)
    plans = [minimum_snap(task.waypoints, task.durations_s) for task in trajectory_tasks(mission)]
    legs = flight_plan(mission, [Planned(plan, plan) for plan in plans]).legs
    assert np.allclose(legs[0].trajectory.waypoints()[0, :3], mission.vehicle.initial_position_m, atol=1e-9)
    for leg in legs:
        ends = np.array([0.0, leg.duration_s])
        for order, tolerance in ((1, 1e-8), (2, 1e-7), (3, 1e-6)):
            assert np.abs(leg.trajectory.derivative(ends, order)).max() < tolerance * max(1.0, leg.duration_s**-order)
    for before, leg in pairwise(legs):
        assert np.abs(before.trajectory.waypoints()[-1] - leg.trajectory.waypoints()[0]).max() < 1e-9


@settings(max_examples=40, deadline=None)
@given(data=missions())
def test_the_flight_goes_through_what_the_mission_names(data: dict[str, Any]) -> None:
    mission = Mission.model_validate(data)
    tasks = trajectory_tasks(mission)
    plans = [minimum_snap(task.waypoints, task.durations_s) for task in tasks]
    flight = flight_plan(mission, [Planned(plan, plan) for plan in plans])
    flown = [leg for leg in flight.legs if leg.kind is LegKind.TRAJECTORY]
    for leg, task in zip(flown, tasks, strict=True):
        action = data["plan"][task.item]["trajectory"]
        points = leg.trajectory.waypoints()
        assert np.allclose(points[:, :3], [waypoint["position"] for waypoint in action["waypoints"]], atol=1e-9)
        assert (np.abs(np.diff(points[:, 3])) <= math.pi + 1e-9).all()
        for yaw, waypoint in zip(points[:, 3], action["waypoints"], strict=True):
            turn = math.remainder(yaw - math.radians(waypoint.get("yaw_deg", math.degrees(yaw))), 2.0 * math.pi)
            assert abs(turn) < 1e-9
    assert flight.legs[0].kind is LegKind.TAKEOFF
    assert flight.legs[-1].kind is LegKind.LAND
    assert flight.duration_s == sum(leg.duration_s for leg in flight.legs)


DEMO = (Path(__file__).parents[2] / "missions" / "four_waypoints.yaml").read_text(encoding="utf-8")
SNIPPETS = st.text(max_size=6) | st.sampled_from(
    ["- ", ": ", "{", "}", "[", "]", "&a ", "*a", "!!", "\t", "\n", "'", '"', "#", "1e9"]
)


def refusal_of(path: Path) -> str:
    """What the user sees; empty where the mission loads."""
    try:
        load_mission(path)
    except InputError as error:
        return str(error)
    return ""


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(begin=st.integers(0, len(DEMO)), length=st.integers(0, 40), snippet=SNIPPETS)
def test_a_damaged_file_is_read_or_refused_in_lines(begin: int, length: int, snippet: str, tmp_path: Path) -> None:
    text = DEMO[:begin] + snippet + DEMO[begin + length :]
    path = tmp_path / "m.yaml"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    assert all(line.startswith(f"{path}:") for line in refusal_of(path).splitlines())
