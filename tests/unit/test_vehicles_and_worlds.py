"""Vehicles and worlds as data: what ships, what a user may get wrong, what binds a model."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest
import yaml

import lcd_flight.worlds
from lcd_flight.model import InputError, Vehicle
from lcd_flight.worlds import fingerprint, load_vehicle, load_world, vehicle_names, world_names

DATA = Path(lcd_flight.worlds.__file__).parent / "data"


def written(folder: Path, change: dict[str, Any], *, without: str = "") -> Path:
    """The Crazyflie's file with some keys changed and one left out."""
    content = yaml.safe_load((DATA / "vehicles" / "crazyflie.yaml").read_text())
    content.update(change)
    content.pop(without, None)
    path = folder / "mine.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def test_the_vehicles_that_ship() -> None:
    assert vehicle_names() == ["crazyflie", "crazyflie-2.1", "hummingbird", "x500"]
    for name in vehicle_names():
        assert load_vehicle(name).name == name


def test_the_papers_crazyflie() -> None:
    """Figures that every reported result stands on."""
    v = load_vehicle("crazyflie")
    assert (v.mass_kg, v.inertia_kg_m2) == (0.03, (1.43e-5, 1.43e-5, 2.89e-5))
    assert (v.k_eta, v.k_m, v.k_d, v.k_z, v.k_h, v.k_flap) == (2.3e-8, 7.8e-10, 1.02506e-6, 7.553e-7, 0.0, 0.0)
    assert (v.motor_time_constant_s, v.motor_noise, v.rotor_speed_max) == (0.005, 100.0, 2500.0)
    assert all(math.hypot(*r) == pytest.approx(0.043) for r in v.rotor_positions_m)
    assert (v.gains.attitude, v.gains.body_rates) == (544.0, 46.64)
    assert v.thrust_to_weight == pytest.approx(1.954, abs=1e-3)
    assert v.hover_rotor_speed == pytest.approx(1788.5, abs=0.1)


def test_the_crazyflie_of_today_hovers_where_its_firmware_does() -> None:
    """38842 counts of thrust, thrust-to-weight 1.54 at the cap of 60000 (mass 29 g, 0.12 N a motor)."""
    v = load_vehicle("crazyflie-2.1")
    assert v.onboard is not None
    assert v.weight_N / v.max_thrust_N * 65535 == pytest.approx(38842, abs=2)
    assert v.onboard.thrust_limit * v.thrust_to_weight == pytest.approx(1.54, abs=0.005)


def test_the_x500_is_that_of_the_gazebo_model() -> None:
    """Hovers at 770 of 1000 rad/s; mass and moments of inertia are put together from its links."""
    v = load_vehicle("x500")
    body_kg, rotor_kg, height_m, arm_m = 2.0, 0.016076923076923075, 0.06, 0.174
    mass_kg = body_kg + 4.0 * rotor_kg
    centre_m = 4.0 * rotor_kg * height_m / mass_kg
    across, around = 0.5 * (3.8464910e-7 + 2.6115852e-5), 2.6498582e-5
    tilting = across + rotor_kg * (arm_m**2 + (height_m - centre_m) ** 2)
    roll = 0.02166666666666667 + body_kg * centre_m**2 + 4.0 * tilting
    yaw = 0.04 + 4.0 * (around + 2.0 * rotor_kg * arm_m**2)
    assert v.mass_kg == pytest.approx(mass_kg, rel=1e-6)
    assert v.inertia_kg_m2 == pytest.approx((roll, roll, yaw), rel=1e-4)
    assert v.k_m == pytest.approx(0.016 * v.k_eta)
    assert v.hover_rotor_speed == pytest.approx(769.56, abs=0.01)


def test_the_x500s_onboard_gains_are_px4s() -> None:
    """Outputs become counts by the slope of thrust at hover: decision record 0119. The yaw rate has twice the P."""
    v = load_vehicle("x500")
    assert v.onboard is not None
    slope = 2.0 * v.k_eta * v.hover_rotor_speed * 850.0 / (v.k_eta * v.rotor_speed_max**2)
    tilt, heading = math.sqrt(0.5) * 2.0 * 65535.0 * slope, 65535.0 * slope
    assert [axis.kp for axis in v.onboard.attitude] == [6.5, 6.5, 2.8]
    for axis, scale, (p, i, d) in zip(
        v.onboard.rates,
        (tilt, tilt, heading),
        ((0.15, 0.2, 0.003), (0.15, 0.2, 0.003), (2.0 * 0.2, 0.1, 0.0)),
        strict=True,
    ):
        wanted = [math.radians(scale * gain) for gain in (p, i, d)]
        assert [axis.kp, axis.ki, axis.kd] == pytest.approx(wanted, rel=1e-3)
        assert axis.integral_limit == pytest.approx(math.degrees(0.3 / i), rel=1e-3)


def test_every_figure_that_ships_is_cited() -> None:
    for path in (DATA / "vehicles").glob("*.yaml"):
        content = yaml.safe_load(path.read_text())
        cited = {key.strip() for keys in content["sources"] for key in keys.split(",")}
        assert cited == set(content) - {"name", "sources"}, path


def test_the_worlds_that_ship() -> None:
    assert world_names() == ["crazyflie-flight", "crazyflie-paper", "crazyflie-saturated", "hummingbird-paper"]
    for name, vehicle, speed, loop in (
        ("crazyflie-paper", "crazyflie", 2.0, "paper"),
        ("crazyflie-saturated", "crazyflie", 2.37, "paper"),
        ("hummingbird-paper", "hummingbird", 2.0, "paper"),
        ("crazyflie-flight", "crazyflie", 2.5, "flight"),
    ):
        world = load_world(name)
        assert (world.name, world.base_vehicle.name, world.speed, world.loop) == (name, vehicle, speed, loop)
        assert (world.base_vehicle.motor_time_constant_s, world.base_vehicle.motor_noise) == (0.005, 100.0)
        assert [world.vehicle(n).parasitic_drag for n in range(1, 6)] == [
            (0.002, 0.002, 0.007),
            (0.0035, 0.0035, 0.009),
            (0.005, 0.005, 0.01),
            (0.0065, 0.0065, 0.011),
            (0.008, 0.008, 0.013),
        ]
        assert (world.sampler.waypoints, world.sampler.distance_m) == (4, (1.0, 3.0))
        assert world.sampler.yaw_span_rad == pytest.approx(0.85 * math.pi)
        assert world.start_aligned


def test_a_world_or_vehicle_that_is_not_there_lists_those_that_are(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="world 'crazyfly' is not known; worlds: crazyflie-flight, crazyflie-paper, "):
        load_world("crazyfly")
    with pytest.raises(InputError, match=r"vehicle 'crazyfly' is neither a vehicle file \(\*.yaml\) nor one of: crazy"):
        load_vehicle("crazyfly")
    with pytest.raises(InputError, match="neither a vehicle file"):
        load_vehicle(tmp_path / "missing.yaml")


def test_a_users_vehicle_is_read_from_its_file(tmp_path: Path) -> None:
    mine = load_vehicle(written(tmp_path, {"name": "mine", "mass_kg": 0.035}))
    assert replace(mine, source="") == replace(load_vehicle("crazyflie"), name="mine", mass_kg=0.035, source="")
    assert load_vehicle(str(written(tmp_path, {}, without="flight_gains"))).flight_gains == mine.gains
    assert load_vehicle(written(tmp_path, {}, without="onboard")).onboard is None


def test_an_onboard_controller_may_be_written_out(tmp_path: Path) -> None:
    pid = {"kp": 1.0, "ki": 0.0, "kd": 0.0, "integral_limit": 0.0}
    own = {"rate_hz": 1000.0, "attitude": [pid] * 3, "rates": [pid] * 3, "thrust_limit": 1.0}
    mine = load_vehicle(written(tmp_path, {"onboard": own}))
    assert mine.onboard is not None
    assert (mine.onboard.rate_hz, mine.onboard.thrust_floor, mine.onboard.rates[2].kp) == (1000.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mass_kg": -0.03}, "mass_kg: -0.03: Input should be greater than 0"),
        ({"mass_kg": math.nan}, "mass_kg: nan: Input should be a finite number"),
        ({"k_eta": math.inf}, "k_eta: inf: Input should be a finite number"),
        ({"mass_kg": "heavy"}, "mass_kg: 'heavy': Input should be a valid number"),
        ({"k_eta": "2e-8"}, "k_eta: '2e-8' is text to YAML; write 2.0e-08"),
        ({"mass_kg": None}, "mass_kg: None: Input should be a valid number"),
        ({"mass": 0.03}, "mass: unknown key; remove it or correct its spelling"),
        ({"inertia_kg_m2": [1e-5, 1e-5]}, "inertia_kg_m2.2: this key is missing"),
        ({"inertia_kg_m2": [1.0e-5, 1.0e-5, 0.0]}, "inertia_kg_m2.2: 0.0: Input should be greater than 0"),
        ({"rotor_directions": [1, 1, 1, -1]}, "rotor_directions: two rotors turn one way"),
        ({"rotor_positions_m": [[0.03, 0.03, 0.01]] * 4}, "rotor_positions_m: rotors lie in the plane"),
        ({"rotor_speed_min": 3000.0}, "rotor_speed_min must be below rotor_speed_max"),
        ({"mass_kg": 0.3}, "thrust-to-weight is 0.20; it cannot hover"),
        ({"onboard": "betaflight"}, "onboard: 'betaflight': no onboard controller of this name; there are: crazyflie-"),
        ({"onboard": {"rate_hz": 500.0}}, "onboard.attitude: this key is missing"),
        ({"gains": {"position": [1, 1, 1], "velocity": [1, 1, -1]}}, "gains.velocity.2: -1: Input should be greater"),
        ({"motor_time_constant_s": 0.0}, "motor_time_constant_s: 0.0: Input should be greater than 0"),
        ({"motor_noise": True}, "motor_noise: True: Input should be a valid number"),
    ],
)
def test_what_is_wrong_in_a_vehicle_file_is_named(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    path = written(tmp_path, change)
    with pytest.raises(InputError) as caught:
        load_vehicle(path)
    assert f"{path}: " in str(caught.value)
    assert message in str(caught.value)


def test_a_missing_key_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"mine.yaml: mass_kg: this key is missing"):
        load_vehicle(written(tmp_path, {}, without="mass_kg"))


def test_all_that_is_wrong_is_said_at_once_a_line_each(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        load_vehicle(written(tmp_path, {"mass_kg": -1.0, "k_m": 0.0, "wings": 2}))
    assert len(str(caught.value).splitlines()) == 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name: [", "not valid YAML: line 1"),
        ("a: 1\na: 2\n", "not valid YAML: line 2: key 'a' stands twice"),
        ("just words", "a mapping of keys to values is expected"),
        ("", "a mapping of keys to values is expected"),
        ("? [1, 2]\n: 3\n", "not valid YAML: line 1: key [1, 2] is not a word"),
    ],
)
def test_files_that_are_no_vehicle_at_all(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_vehicle(path)
    assert message in str(caught.value)


def test_bytes_that_are_no_text(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_bytes(b"name: \xff\xfe")
    with pytest.raises(InputError, match="cannot be read"):
        load_vehicle(path)


def test_a_fingerprint_binds_what_the_loop_flies_and_nothing_else() -> None:
    v = load_vehicle("crazyflie")
    paper, flight = fingerprint(v, "paper"), fingerprint(v, "flight")
    assert paper != flight
    for free in (replace(v, name="mine"), replace(v, parasitic_drag=(0.0, 0.0, 0.0)), replace(v, motor_noise=0.0)):
        assert (fingerprint(free, "paper"), fingerprint(free, "flight")) == (paper, flight)
    bound = {f.name for f in fields(Vehicle)} - {"name", "source", "parasitic_drag", "motor_noise"}
    for name in bound - {"gains", "flight_gains", "onboard", "inertia_kg_m2", "rotor_positions_m", "rotor_directions"}:
        assert fingerprint(replace(v, **{name: getattr(v, name) * 1.01 + 0.01}), "paper") != paper, name
    slower = replace(v.gains, position=(1.0, 1.0, 1.0))
    assert fingerprint(replace(v, gains=slower), "paper") != paper
    assert fingerprint(replace(v, gains=slower), "flight") == flight
    assert fingerprint(replace(v, flight_gains=slower), "flight") != flight
    assert fingerprint(replace(v, flight_gains=slower), "paper") == paper
    assert fingerprint(replace(v, onboard=None), "flight") != flight


def test_a_world_can_be_had_at_another_speed() -> None:
    slow, base = load_world("crazyflie-flight@1.5"), load_world("crazyflie-flight")
    assert slow == replace(base, name="crazyflie-flight@1.5", speed=1.5)


@pytest.mark.parametrize("speed", ["", "fast", "0", "-1", "nan", "inf"])
def test_a_speed_that_is_none_is_refused(speed: str) -> None:
    with pytest.raises(InputError, match="is no speed"):
        load_world(f"crazyflie-flight@{speed}")
