"""The equations of motion with summed rotor moments: held to the sum over rotors as RotorPy writes it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from rotorpy.vehicles.multirotor import Multirotor

from lcd_flight.model import Vehicle
from lcd_flight.worlds import load_vehicle
from sim_bridge.kernels.multirotor import Motion, airframe, lagged, rates, rotor_sums, step
from sim_bridge.rotorpy_adapter import parameters

LOPSIDED = replace(
    load_vehicle("hummingbird"),
    name="lopsided",
    rotor_positions_m=((0.15, 0.1, 0.0), (0.11, -0.14, 0.0), (-0.1, -0.12, 0.0), (-0.13, 0.16, 0.0)),
    k_flap=1e-6,
    parasitic_drag=(0.1, 0.2, 0.3),
)
"""Nothing about it is symmetric, so no term can hide."""
VEHICLES = [load_vehicle("crazyflie"), load_vehicle("hummingbird"), LOPSIDED]


def random_motion(rng: np.random.Generator) -> Motion:
    q = rng.normal(size=4)
    (vx, vy, vz), (wx, wy, wz), (qx, qy, qz, qw) = 4.0 * rng.normal(size=3), 5.0 * rng.normal(size=3), q
    size = math.sqrt(float(q @ q))
    return Motion((0.0, 0.0, 0.0), (vx, vy, vz), (qx / size, qy / size, qz / size, qw / size), (wx, wy, wz))


@pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda v: v.name)
def test_time_derivatives_are_rotorpys(vehicle: Vehicle) -> None:
    rng = np.random.default_rng(0)
    theirs, air = Multirotor(parameters(vehicle)), airframe(vehicle)
    for _ in range(50):
        motion = random_motion(rng)
        speeds = tuple(float(s) for s in rng.uniform(0.0, vehicle.rotor_speed_max, 4))
        packed = np.concatenate([motion.p_WB, motion.v_WB_W, motion.q_WB, motion.w_WB_B, np.zeros(3), speeds])
        expected = theirs._s_dot_fn(0.0, packed, np.array(speeds))
        ours = rates(motion.v_WB_W, motion.q_WB, motion.w_WB_B, rotor_sums(speeds, air), air)
        assert np.allclose(ours.v, expected[3:6], rtol=1e-10, atol=1e-10)
        assert np.allclose(ours.q, expected[6:10], rtol=1e-10, atol=1e-10)
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


def flown(h: float) -> Motion:
    """0.4 s of tumbling with rotors that spin up, in steps of h."""
    vehicle = VEHICLES[0]
    air, tau = airframe(vehicle), 0.05
    motion = random_motion(np.random.default_rng(3))
    speeds, commands = (500.0, 800.0, 600.0, 700.0), (1800.0, 1700.0, 1750.0, 1850.0)
    for _ in range(round(0.4 / h)):
        middle = lagged(speeds, commands, math.exp(-0.5 * h / tau))
        end = lagged(middle, commands, math.exp(-0.5 * h / tau))
        motion = step(motion, rotor_sums(speeds, air), rotor_sums(middle, air), rotor_sums(end, air), air, h)
        speeds = end
    return motion


def test_steps_converge_with_order_four() -> None:
    best = flown(0.000625)
    errors = [np.linalg.norm(np.concatenate(flown(h)) - np.concatenate(best)) for h in (0.01, 0.005)]
    assert 10.0 < errors[0] / errors[1] < 25.0
