"""Right mission files: what they become, which one a name stands for, and the files that they name."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from lcd_flight.mission import Mission, MissionError, find_mission, load_mission, shipped_missions
from lcd_flight.mission.actions import Hold, Land, Takeoff, TrajectoryAction
from lcd_flight.mission.airframe import load_gains, top_speed_m_per_s, vehicle_of
from lcd_flight.model import Geofence, GeometricGains, SafetyLimits
from lcd_flight.worlds import load_vehicle

ROOT = Path(__file__).parents[2]
SMALLEST = """\
version: 1
name: smallest
vehicle: {type: crazyflie}
plan:
  - takeoff: {height: 1}
  - land: {}
safety: {geofence: {min: [-1, -1, 0], max: [1, 1, 2]}}
"""


def mission_file(folder: Path, text: str = SMALLEST) -> Path:
    path = folder / "m.yaml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("path", sorted((ROOT / "missions").glob("*.yaml")), ids=lambda path: path.stem)
def test_missions_of_the_repository_load_and_name_their_schema(path: Path) -> None:
    mission = load_mission(path)
    assert mission.source.path == path
    first = path.read_text(encoding="utf-8").splitlines()[0]
    assert first == "# yaml-language-server: $schema=mission.schema.json"


def test_demo_is_the_four_waypoints_without_the_editor_line() -> None:
    ours = (ROOT / "missions" / "four_waypoints.yaml").read_text(encoding="utf-8")
    demo = find_mission("demo").read_text(encoding="utf-8")
    assert ours.splitlines()[1:] == demo.splitlines()
    assert load_mission("demo") == load_mission(ROOT / "missions" / "four_waypoints.yaml")
    assert list(shipped_missions()) == ["demo"]


def test_a_file_in_the_current_folder_comes_before_one_that_ships(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert find_mission("demo").parent.name == "data"
    Path("demo").write_text(SMALLEST, encoding="utf-8")
    assert find_mission("demo") == Path("demo")
    assert load_mission("demo").name == "smallest"


def test_defaults_are_those_of_the_vocabulary(tmp_path: Path) -> None:
    mission = load_mission(mission_file(tmp_path))
    fence = Geofence((-1.0, -1.0, 0.0), (1.0, 1.0, 2.0))
    assert mission.geofence() == fence
    assert mission.safety_limits() == SafetyLimits(geofence=fence)
    assert mission.vehicle.uri == "sim://"
    assert (mission.planner.type, mission.rehearse.runs) == ("learned-polished", 20)


def test_every_limit_reaches_the_monitors(tmp_path: Path) -> None:
    text = SMALLEST.replace(
        "{type: crazyflie}",
        "{type: crazyflie, initial_position_tolerance: 0.2, "
        "battery: {voltage_takeoff: 4.0, voltage_warning: 3.5, voltage_critical: 3.1}}",
    ).replace("safety: {", "motion_capture: {rate: 120, timeout: 0.5}\nsafety: {max_position_error: 1.0, ")
    text = text.replace("safety: {", "safety: {on_mocap_lost: cut, on_battery_critical: warn, ")
    limits = load_mission(mission_file(tmp_path, text)).safety_limits()
    assert limits == SafetyLimits(
        geofence=Geofence((-1.0, -1.0, 0.0), (1.0, 1.0, 2.0)),
        max_position_error_m=1.0,
        brake_position_error_m=0.5,
        pose_timeout_s=0.5,
        on_mocap_lost="cut",
        on_battery_critical="warn",
        battery_takeoff_V=4.0,
        battery_warning_V=3.5,
        battery_critical_V=3.1,
        expected_pose_rate_hz=120.0,
        initial_position_tolerance_m=0.2,
    )


def test_actions_come_in_order() -> None:
    kinds = [type(action) for action in load_mission("demo").actions()]
    assert kinds == [Takeoff, Hold, TrajectoryAction, Land]


def test_angles_become_radians_once(tmp_path: Path) -> None:
    text = SMALLEST.replace("{type: crazyflie}", "{type: crazyflie, initial_yaw_deg: 90}")
    assert load_mission(mission_file(tmp_path, text)).initial_yaw_rad == pytest.approx(math.pi / 2.0)


def test_places_name_file_line_and_key(tmp_path: Path) -> None:
    path = mission_file(tmp_path)
    mission = load_mission(path)
    assert mission.place("plan", 1, "land") == f"{path}:6: plan[1].land"
    assert mission.place("plan", 1, "land", "height") == f"{path}:6: plan[1].land.height"
    assert Mission.model_validate(mission.model_dump(by_alias=True)).place("plan", 0) == "plan[0]"


def test_missions_are_equal_by_what_they_say(tmp_path: Path) -> None:
    one = load_mission(mission_file(tmp_path))
    two = load_mission(mission_file(tmp_path, "# a comment\n" + SMALLEST))
    assert one == two
    assert one.source.text != two.source.text
    assert one != load_mission(mission_file(tmp_path, SMALLEST.replace("height: 1", "height: 1.5")))


def test_a_byte_order_mark_and_windows_line_ends_are_no_obstacle(tmp_path: Path) -> None:
    path = tmp_path / "windows.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + SMALLEST.replace("\n", "\r\n").encode())
    assert load_mission(path).name == "smallest"


def test_vehicle_and_gains_are_files_beside_the_mission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from lcd_flight.worlds import vehicles

    shipped = (Path(vehicles.__file__).parent / "data" / "vehicles" / "crazyflie.yaml").read_text(encoding="utf-8")
    (tmp_path / "mine.yaml").write_text(shipped.replace("name: crazyflie", "name: mine"), encoding="utf-8")
    (tmp_path / "gains.yaml").write_text(
        "position: [1, 2, 3]\nvelocity: [4, 5, 6]\nintegral: [0, 0, 1]\n", encoding="utf-8"
    )
    text = SMALLEST.replace("type: crazyflie", "type: mine.yaml") + "control: {gains: gains.yaml}\n"
    path = mission_file(tmp_path, text)
    monkeypatch.chdir("/")
    vehicle = vehicle_of(load_mission(path))
    assert vehicle.name == "mine"
    assert vehicle.mass_kg == load_vehicle("crazyflie").mass_kg
    assert vehicle.flight_gains == GeometricGains(
        position=(1, 2, 3), velocity=(4, 5, 6), attitude=0.0, body_rates=0.0, integral=(0, 0, 1)
    )


def test_gains_default_to_the_vehicle_own(tmp_path: Path) -> None:
    assert vehicle_of(load_mission(mission_file(tmp_path))) == load_vehicle("crazyflie")


def test_wrong_gains_are_told_key_by_key(tmp_path: Path) -> None:
    path = tmp_path / "gains.yaml"
    path.write_text("position: [1, 2]\nvelocity: [1, -2, 3]\nintegral_limt: 1\n", encoding="utf-8")
    with pytest.raises(MissionError) as caught:
        load_gains(path)
    assert str(caught.value).splitlines() == [
        f"{path}:1: position: has 2 numbers, must have 3; write [x, y, z]",
        f"{path}:2: velocity[1]: -2 is below 0; write at least 0",
        f"{path}:3: integral_limt: is not a known key; did you mean integral_limit? "
        "(one of position, velocity, attitude, body_rates, integral, integral_limit)",
    ]


def test_top_speed_balances_thrust_weight_and_drag() -> None:
    for name in ("crazyflie", "hummingbird"):
        vehicle = load_vehicle(name)
        v = top_speed_m_per_s(vehicle)
        drag_N = vehicle.parasitic_drag[0] * v * v + 4.0 * vehicle.k_d * vehicle.rotor_speed_max * v
        assert math.hypot(drag_N, vehicle.weight_N) == pytest.approx(vehicle.max_thrust_N)
