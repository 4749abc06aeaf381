"""The plant: the rollout's flight to the last bits, the floor, crashes, the battery, time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulator_plans import minimum_snap_plans

from lcd_flight.control.flight_law import NO_INTEGRAL, command
from lcd_flight.model import AttitudeThrust, InputError, Reference, RolloutOptions, State, Vector3, Vehicle
from lcd_flight.model.frames import from_yaw, tilt_of, yaw_of
from lcd_flight.worlds import load_vehicle
from sim_bridge.battery import Battery
from sim_bridge.plant import Plant
from sim_bridge.trace import trace

VEHICLES = [load_vehicle("crazyflie"), load_vehicle("crazyflie-2.1")]
REST: Vector3 = (0.0, 0.0, 0.0)
TICK_NS = 10_000_000
SECOND_NS = 1_000_000_000


def standing(z: float = 0.0, yaw: float = 0.3) -> State:
    return State((1.0, 2.0, z), REST, from_yaw(yaw), REST)


def level(thrust_N: float, yaw: float = 0.3) -> AttitudeThrust:
    return AttitudeThrust(thrust_N, from_yaw(yaw))


def lifted(vehicle: Vehicle, height_m: float) -> Plant:
    """Hovering at about a height above the floor, to be let go."""
    plant, integral = Plant(vehicle, standing(), 0), NO_INTEGRAL
    for tick in range(600):
        p_W = (1.0, 2.0, height_m * min(1.0, tick / 300.0))
        there = Reference(p_W, REST, REST, REST, REST, 0.3, 0.0, 0.0)
        plant.setpoint, integral = command(plant.state, there, vehicle, integral, 0.01)
        plant.advance(TICK_NS)
    assert plant.state.p_WB[2] == pytest.approx(height_m, abs=0.05)
    return plant


INTEGRAL = replace(VEHICLES[0].flight_gains, integral=(0.5, 0.5, 0.5), integral_limit=0.8)


@pytest.mark.parametrize(
    ("vehicle", "speed"),
    [
        (replace(VEHICLES[0], motor_noise=0.0), 1.0),
        (replace(VEHICLES[1], motor_noise=100.0), 1.0),
        (replace(VEHICLES[0], flight_gains=INTEGRAL), 2.6),
    ],
    ids=["still", "noisy", "integral, saturated"],
)
def test_it_flies_as_the_rollout_does(vehicle: Vehicle, speed: float) -> None:
    """Same plan, same seed, the tick's law: to a tenth of a micrometre over a second and a half.

    Both begin in the air, their rotors at hover.
    """
    plan = minimum_snap_plans(1, speed, seed=21)[0]
    expected = trace(plan, vehicle, 7, RolloutOptions(loop="flight"))
    reference = plan.reference(0.0)
    plant = Plant(vehicle, State(reference.p_W, REST, from_yaw(reference.yaw_rad), REST), 7, floor_m=-50.0)
    integral, positions = NO_INTEGRAL, []
    for tick in range(150):
        positions.append(plant.state.p_WB)
        plant.setpoint, integral = command(plant.state, plan.reference(0.01 * tick), vehicle, integral, 0.01)
        plant.advance(TICK_NS)
    assert np.abs(np.array(positions) - expected.p_WB[:150]).max() < 1e-7


def test_it_stands_until_thrust_exceeds_its_weight() -> None:
    vehicle = VEHICLES[1]
    plant = Plant(vehicle, standing(0.25), 0)
    for share in (None, 0.5, 0.98):
        if share is not None:
            plant.setpoint = level(share * vehicle.weight_N)
        plant.advance(SECOND_NS)
        assert plant.on_ground
        assert plant.state.p_WB == (1.0, 2.0, 0.25)
        assert plant.state.v_WB_W == REST
    plant.setpoint = level(1.05 * vehicle.weight_N)
    plant.advance(SECOND_NS)
    assert not plant.on_ground
    assert plant.state.p_WB[2] > 0.3


def test_on_the_floor_it_keeps_its_heading_and_stays_level_whatever_is_asked() -> None:
    plant = Plant(VEHICLES[0], standing(yaw=1.0), 0)
    plant.setpoint = AttitudeThrust(0.1, (0.4, 0.0, 0.0, 0.9165151389911680))
    plant.advance(SECOND_NS)
    assert tilt_of(plant.state.q_WB) == pytest.approx(0.0, abs=1e-9)
    assert yaw_of(plant.state.q_WB) == pytest.approx(1.0)
    assert not plant.crashed


def test_with_its_motors_stopped_it_falls_to_the_floor_and_no_further() -> None:
    plant = lifted(VEHICLES[0], 0.3)
    plant.stop()
    plant.advance(3 * SECOND_NS)
    assert plant.setpoint is None
    assert plant.on_ground
    assert plant.state.p_WB[2] == 0.0
    assert plant.motor_shares == (0.0,) * 4
    assert not plant.crashed


def test_a_fall_from_height_is_a_crash_and_its_motors_do_not_start_again() -> None:
    plant = lifted(VEHICLES[0], 1.5)
    plant.stop()
    plant.advance(2 * SECOND_NS)
    assert plant.crashed
    at = plant.state
    plant.setpoint = level(0.5)
    plant.advance(SECOND_NS)
    assert plant.setpoint is None
    assert plant.state == at


def test_touching_the_floor_tilted_is_a_crash() -> None:
    plant = lifted(VEHICLES[0], 0.3)
    plant.setpoint = AttitudeThrust(0.15, (0.7071067811865476, 0.0, 0.0, 0.7071067811865476))
    plant.advance(SECOND_NS)
    assert plant.on_ground
    assert plant.crashed


def test_a_setpoint_that_is_not_finite_is_an_error() -> None:
    plant = Plant(VEHICLES[0], standing(), 0)
    with pytest.raises(ValueError, match="not a setpoint"):
        plant.setpoint = level(float("nan"))


def test_a_vehicle_without_an_onboard_controller_is_refused() -> None:
    with pytest.raises(InputError, match="hummingbird has no onboard controller"):
        Plant(load_vehicle("hummingbird"), standing(), 0)


def flown(seed: int, slices_ns: list[int]) -> State:
    plant = Plant(VEHICLES[0], standing(), seed)
    plant.setpoint = level(1.3 * VEHICLES[0].weight_N)
    for dt_ns in slices_ns:
        plant.advance(dt_ns)
    return plant.state


def test_it_is_deterministic_by_seed() -> None:
    assert flown(3, [TICK_NS] * 50) == flown(3, [TICK_NS] * 50)
    assert flown(3, [TICK_NS] * 50) != flown(4, [TICK_NS] * 50)
    assert flown(-1, [TICK_NS]) == flown(-1, [TICK_NS])


def test_how_time_is_cut_up_does_not_matter() -> None:
    """What is less than a period of the onboard controller is kept for later."""
    whole = flown(5, [500_000_000])
    assert flown(5, [TICK_NS] * 50) == whole
    assert flown(5, [700_001] * 714 + [500_000_000 - 714 * 700_001]) == whole
    assert flown(5, [0, 500_000_000, 1_999_999]) == whole


def test_motor_shares_are_shares_of_the_largest_thrust() -> None:
    vehicle = VEHICLES[0]
    plant = Plant(vehicle, standing(), 0)
    plant.setpoint = level(0.5 * vehicle.weight_N)
    plant.advance(TICK_NS)
    assert sum(plant.motor_shares) / 4.0 == pytest.approx(0.5 / vehicle.thrust_to_weight, rel=1e-6)


def test_a_battery_empties_in_about_seven_minutes_of_hover() -> None:
    battery, minutes = Battery(), 0.0
    rest_V = battery.voltage_V
    battery = battery.drained(1.0, 0.0)
    assert rest_V - battery.voltage_V == pytest.approx(0.32, abs=0.02)
    while battery.voltage_V > 3.0:
        before = battery.voltage_V
        battery = battery.drained(1.0, 1.0)
        assert battery.voltage_V <= before
        minutes += 1.0 / 60.0
    assert 6.0 < minutes < 7.5


def test_a_battery_shows_the_voltage_that_it_was_given() -> None:
    for volts in (4.1, 3.9, 3.7, 3.5):
        assert Battery.at_voltage(volts).voltage_V == pytest.approx(volts)
    assert Battery.at_voltage(None).charge == 1.0
    assert Battery.at_voltage(9.0).charge == 1.0
    assert Battery.at_voltage(1.0).charge == 0.0
    assert Battery(0.0).drained(1.0, 1e6).charge == 0.0


def test_the_plants_battery_sags_and_drains() -> None:
    plant = Plant(VEHICLES[1], standing(), 0, battery_V=3.9)
    assert plant.battery_V == pytest.approx(3.9)
    plant.setpoint = level(0.95 * VEHICLES[1].weight_N)
    plant.advance(SECOND_NS)
    sagged = plant.battery_V
    assert 3.5 < sagged < 3.65
    for _ in range(60):
        plant.advance(SECOND_NS)
    assert plant.battery_V < sagged - 0.02
