"""The equations of motion with summed rotor moments: held to the sum over rotors as RotorPy writes it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from rotorpy.vehicles.multirotor import Multirotor
from simulator_plans import LOPSIDED

from lcd_flight.model import Vehicle
from lcd_flight.worlds import load_vehicle
from sim_bridge.kernels import rows
from sim_bridge.kernels.lane import aim_rotors, fly_step, turn_rotors
from sim_bridge.kernels.multirotor import (
    Airframe,
    Motion,
    RotorSums,
    Stage,
    airframe,
    lagged,
    lagged_sums,
    linear_sums,
    rotor_sums,
    slope_of,
)
from sim_bridge.kernels.rows import LANES, ROWS, load_motion, store_motion
from sim_bridge.rotorpy_adapter import parameters

VEHICLES = [load_vehicle("crazyflie"), load_vehicle("hummingbird"), LOPSIDED]


def random_motion(rng: np.random.Generator) -> Motion:
    q = rng.normal(size=4)
    (vx, vy, vz), (wx, wy, wz), (qx, qy, qz, qw) = 4.0 * rng.normal(size=3), 5.0 * rng.normal(size=3), q
    size = math.sqrt(float(q @ q))
    return Motion((0.0, 0.0, 0.0), (vx, vy, vz), (qx / size, qy / size, qz / size, qw / size), (wx, wy, wz))


def sums_at(speeds: tuple[float, float, float, float], air: Airframe) -> RotorSums:
    return rotor_sums(speeds, linear_sums(speeds, air), air)


@pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda v: v.name)
def test_time_derivatives_are_rotorpys(vehicle: Vehicle) -> None:
    rng = np.random.default_rng(0)
    theirs, air = Multirotor(parameters(vehicle)), airframe(vehicle)
    for _ in range(50):
        motion = random_motion(rng)
        speeds = tuple(float(s) for s in rng.uniform(0.0, vehicle.rotor_speed_max, 4))
        packed = np.concatenate([motion.p_WB, motion.v_WB_W, motion.q_WB, motion.w_WB_B, np.zeros(3), speeds])
        expected = theirs._s_dot_fn(0.0, packed, np.array(speeds))
        stage = Stage(motion.v_WB_W, motion.q_WB, motion.w_WB_B)
        ours = slope_of(stage, sums_at(speeds, air), air, air.lifts)
        assert np.allclose(ours.v, expected[3:6], rtol=1e-10, atol=1e-10)
        assert np.allclose(0.5 * np.array(ours.q_twice), expected[6:10], rtol=1e-10, atol=1e-10)
        assert np.allclose(ours.w, expected[10:13], rtol=1e-9, atol=1e-8)


def test_rotors_out_of_the_plane_are_refused() -> None:
    tall = replace(LOPSIDED, rotor_positions_m=((0.15, 0.1, 0.02), *LOPSIDED.rotor_positions_m[1:]))
    with pytest.raises(ValueError, match="lopsided: rotors must lie in the plane"):
        airframe(tall)


def test_motors_approach_their_command_exponentially() -> None:
    speeds, commands = (0.0, 100.0, 200.0, 300.0), (100.0, 100.0, 0.0, 400.0)
    whole = lagged(speeds, commands, math.exp(-2.0))
    halves = lagged(lagged(speeds, commands, math.exp(-1.0)), commands, math.exp(-1.0))
    assert whole == pytest.approx(halves)
    assert whole[0] == pytest.approx(100.0 * (1.0 - math.exp(-2.0)))
    assert whole[1] == 100.0


def test_what_the_rotors_add_up_to_lags_as_they_do() -> None:
    air = airframe(LOPSIDED)
    speeds, commands = (500.0, 800.0, 600.0, 700.0), (1800.0, 0.0, 1750.0, 1850.0)
    later = linear_sums(lagged(speeds, commands, 0.3), air)
    assert lagged_sums(linear_sums(speeds, air), linear_sums(commands, air), 0.3) == pytest.approx(later)


def test_only_some_vehicles_need_the_terms_of_translational_lift() -> None:
    """Those that have none are computed without; with them it comes out the same."""
    air = airframe(VEHICLES[0])
    assert [airframe(v).lifts for v in VEHICLES] == [False, True, True]
    motion = random_motion(np.random.default_rng(1))
    stage, rotors = Stage(motion.v_WB_W, motion.q_WB, motion.w_WB_B), sums_at((900.0, 800.0, 700.0, 600.0), air)
    assert slope_of(stage, rotors, air, True) == slope_of(stage, rotors, air, False)


def flown(h: float) -> Motion:
    """0.4 s of tumbling with rotors that spin up, in steps of h."""
    air, tau = airframe(LOPSIDED), 0.05
    memory = np.zeros(ROWS * LANES)
    store_motion(memory, rows.MOTION, 0, random_motion(np.random.default_rng(3)))
    turn_rotors(memory, 0, (200.0, 500.0, 300.0, 400.0), air)
    aim_rotors(memory, 0, (500.0, 480.0, 490.0, 510.0), air)
    for _ in range(round(0.4 / h)):
        fly_step(memory, 0, air, h, math.exp(-0.5 * h / tau))
    return load_motion(memory, rows.MOTION, 0)


def test_steps_converge_with_order_four() -> None:
    best = flown(0.000625)
    errors = [np.linalg.norm(np.concatenate(flown(h)) - np.concatenate(best)) for h in (0.01, 0.005)]
    assert 10.0 < errors[0] / errors[1] < 25.0
