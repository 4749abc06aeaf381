"""The two laws that make up for drag: held to their equations in matrices, and to what the rollout kernel flies."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from simulator_plans import LOPSIDED, minimum_snap_plans, seeds

from lcd_flight.control.adaptive import (
    AT_REST,
    BANDWIDTH,
    POLE,
    Estimate,
    adaptation,
    found_force,
    predicted_velocity,
    unexplained_force,
)
from lcd_flight.control.drag_compensation import DragModel, force_against_drag, rotor_speeds_in_airflow
from lcd_flight.control.geometric import (
    acceleration_setpoint,
    attitude_setpoint,
    clipped,
    dot,
    into_body,
    moment,
    rotation_of,
    rotor_speeds,
    scaled,
)
from lcd_flight.model import GRAVITY_M_PER_S2, RolloutOptions, Trajectory, Vector3, Vehicle
from lcd_flight.worlds import load_vehicle
from sim_bridge.craft import CONTROLLERS, craft_of
from sim_bridge.rollouts import MultirotorSimulator
from sim_bridge.trace import trace

Matrix = NDArray[np.float64]
CRAZYFLIE, HUMMINGBIRD = load_vehicle("crazyflie"), load_vehicle("hummingbird")
DRAGGED = replace(CRAZYFLIE, motor_noise=0.0, parasitic_drag=(0.008, 0.006, 0.013))
LAWS = ("geometric-drag", "geometric-l1")
G = GRAVITY_M_PER_S2


def vector(values: Matrix) -> Vector3:
    x, y, z = (float(v) for v in values)
    return (x, y, z)


def model_of(vehicle: Vehicle) -> DragModel:
    return DragModel(vehicle.k_eta, vehicle.k_d, vehicle.k_z, vehicle.k_h, vehicle.parasitic_drag)


def swept(alpha: Matrix, v: Matrix, yaw: float, drag: DragModel, sweeps: int) -> Matrix:
    """F R e3 = alpha + k_d O R P R' V + R |v_b| C v_b, in matrices."""
    force = alpha
    for _ in range(sweeps):
        b3 = force / np.linalg.norm(force)
        b2 = np.cross(b3, [math.cos(yaw), math.sin(yaw), 0.0])
        b2 /= np.linalg.norm(b2)
        R = np.stack([np.cross(b2, b3), b2, b3], axis=1)
        all_rotors = 4.0 * math.sqrt(np.linalg.norm(force) / (4.0 * drag.k_eta))
        P, C = np.diag([1.0, 1.0, 0.0]), np.diag(drag.parasitic_drag)
        force = alpha + drag.k_d * all_rotors * R @ P @ R.T @ v + R @ (np.linalg.norm(R.T @ v) * C @ (R.T @ v))
    return force


@pytest.mark.parametrize("vehicle", [CRAZYFLIE, HUMMINGBIRD, LOPSIDED], ids=lambda v: v.name)
def test_the_force_against_drag_is_svachas_in_matrices(vehicle: Vehicle) -> None:
    rng, drag = np.random.default_rng(0), model_of(vehicle)
    for _ in range(50):
        alpha = vehicle.mass_kg * (rng.normal(size=3) * 3.0 + [0.0, 0.0, G])
        v, yaw = 3.0 * rng.normal(size=3), float(rng.uniform(-4.0, 4.0))
        ours = force_against_drag(vector(alpha), vector(v), (math.cos(yaw), math.sin(yaw)), drag)
        assert np.allclose(ours, swept(alpha, v, yaw, drag, 3), rtol=1e-12)


@pytest.mark.parametrize("vehicle", [CRAZYFLIE, HUMMINGBIRD], ids=lambda v: v.name)
def test_three_sweeps_solve_it(vehicle: Vehicle) -> None:
    """In ordinary flight: to a hundredth of the weight."""
    rng, drag = np.random.default_rng(3), model_of(vehicle)
    for _ in range(50):
        alpha = vehicle.mass_kg * (rng.normal(size=3) + np.array([0.0, 0.0, G]))
        v, yaw = 1.5 * rng.normal(size=3), float(rng.uniform(-4.0, 4.0))
        ours = force_against_drag(vector(alpha), vector(v), (math.cos(yaw), math.sin(yaw)), drag)
        assert np.allclose(ours, swept(alpha, v, yaw, drag, 60), atol=1e-2 * vehicle.weight_N)


def test_at_rest_nothing_is_added() -> None:
    force, heading = (0.1, -0.2, 0.3), (1.0, 0.0)
    assert force_against_drag(force, (0.0, 0.0, 0.0), heading, model_of(CRAZYFLIE)) == force


@pytest.mark.parametrize("vehicle", [CRAZYFLIE, HUMMINGBIRD], ids=lambda v: v.name)
def test_rotor_speeds_give_the_thrust_in_the_airflow(vehicle: Vehicle) -> None:
    rng, drag = np.random.default_rng(1), model_of(vehicle)
    allocation = craft_of(vehicle, vehicle, "paper").law.allocation
    for _ in range(50):
        wind, turn = vector(2.0 * rng.normal(size=3)), vector(1e-4 * rng.normal(size=3))
        thrust = vehicle.weight_N * float(rng.uniform(0.5, 1.5))
        speeds = rotor_speeds_in_airflow(thrust, turn, allocation, wind, drag)
        for row, speed in zip(allocation.inverse, speeds, strict=True):
            lift = drag.k_eta * speed**2 - drag.k_z * speed * wind[2] + drag.k_h * (wind[0] ** 2 + wind[1] ** 2)
            assert lift == pytest.approx(np.dot(row, (thrust, *turn)), abs=1e-12)
    for thrust in (vehicle.weight_N, -vehicle.weight_N):
        calm = rotor_speeds_in_airflow(thrust, (0.0, 0.0, 0.0), allocation, (0.0, 0.0, 0.0), drag)
        assert calm == pytest.approx(rotor_speeds(thrust, (0.0, 0.0, 0.0), allocation))


def test_the_estimate_is_the_l1_law_in_matrices() -> None:
    rng, mass, T = np.random.default_rng(2), 0.03, 0.01
    law = adaptation(mass, T, T)
    for _ in range(50):
        v_hat, v, b3 = rng.normal(size=(3, 3))
        found, u = 0.05 * mass * G * rng.normal(size=3), float(rng.uniform(0.0, 0.6))
        A = POLE * np.eye(3)
        fading = np.diag(np.exp(np.diag(A) * T))
        sigma = -mass * A @ fading @ np.linalg.inv(fading - np.eye(3)) @ (v_hat - v)
        later = v_hat + T * (np.array([0.0, 0.0, -G]) + (b3 * u + sigma) / mass + A @ (v_hat - v))
        kept = found + (1.0 - math.exp(-BANDWIDTH * T)) * (sigma - found)
        kept *= min(1.0, 0.5 * mass * G / np.linalg.norm(kept))
        estimate = Estimate(vector(v_hat), vector(found))
        assert np.allclose(unexplained_force(estimate, vector(v), law), sigma, rtol=1e-12)
        assert np.allclose(found_force(estimate, vector(v), False, law), kept, rtol=1e-12)
        assert found_force(estimate, vector(v), True, law) == pytest.approx(vector(found))
        assert np.allclose(predicted_velocity(estimate, vector(v), u, vector(b3), law), later, rtol=1e-12)


def test_a_steady_force_is_found() -> None:
    """A point mass that hovers while something pulls at it: the estimate settles on e^(A T) of the pull."""
    mass, T, pull = 0.03, 0.01, (0.02, -0.03, 0.04)
    law, estimate, v, up = adaptation(mass, T, T), AT_REST, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    for _ in range(300):
        found = found_force(estimate, v, False, law)
        estimate = Estimate(predicted_velocity(estimate, v, mass * G, up, law), found)
        v = (v[0] + T * pull[0] / mass, v[1] + T * pull[1] / mass, v[2] + T * pull[2] / mass)
    assert estimate.found == pytest.approx(scaled(pull, math.exp(POLE * T)), rel=1e-3)


def test_what_is_found_is_bounded_and_periods_are_held_to_reason() -> None:
    law = adaptation(0.03, 0.01, 0.01)
    far = found_force(Estimate((100.0, 0.0, 0.0), (0.0, 0.0, 0.0)), (0.0, 0.0, 0.0), False, law)
    assert far == pytest.approx((-0.5 * 0.03 * G, 0.0, 0.0))
    assert adaptation(0.03, 1.0, 0.01).period_s == 0.02
    assert adaptation(0.03, 0.0, 0.01).period_s == 0.005


def flown_by_the_plain_law(plan: Trajectory, controller: str) -> tuple[Matrix, Matrix]:
    """(T - 1, 4) rotor commands of a flight, and those that the plain functions give along it."""
    flight = trace(plan, DRAGGED, 0, RolloutOptions(controller=controller))
    law, air = craft_of(DRAGGED, DRAGGED, "paper", controller).law, (DRAGGED.rotor_speed_min, DRAGGED.rotor_speed_max)
    estimate, frozen, plain = AT_REST, False, []
    for tick, time_s in enumerate(flight.times_s[:-1]):
        p, v, w = (vector(part[tick]) for part in (flight.p_WB, flight.v_WB_W, flight.w_WB_B))
        value, first, second = (plan.derivative(np.array([time_s]), order)[0] for order in range(3))
        heading, R_WB = (math.cos(value[3]), math.sin(value[3])), rotation_of(tuple(map(float, flight.q_WB[tick])))
        reference = (vector(value[:3]), vector(first[:3]), vector(second[:3]))
        force = scaled(acceleration_setpoint(p, v, *reference, law.position_gain, law.velocity_gain), law.mass_kg)
        if controller == "geometric-drag":
            force = force_against_drag(force, v, heading, law.drag)
        else:
            found = found_force(estimate, v, frozen, law.adaptation)
            force = (force[0] - found[0], force[1] - found[1], force[2] - found[2])
            b3 = R_WB[2]
            estimate = Estimate(predicted_velocity(estimate, v, dot(force, b3), b3, law.adaptation), found)
        R_WD, thrust = attitude_setpoint(force, heading), dot(force, R_WB[2])
        turn = moment(R_WB, R_WD, w, float(first[3]), law.inertia_kg_m2, law.attitude_gain, law.rate_gain)
        wanted = rotor_speeds(thrust, turn, law.allocation)
        if controller == "geometric-drag":
            wanted = rotor_speeds_in_airflow(thrust, turn, law.allocation, into_body(R_WB, v), law.drag)
        plain.append([clipped(speed, *air) for speed in wanted])
        frozen = plain[-1] != list(wanted)
    return flight.rotor_commands[1:], np.array(plain)


@pytest.mark.parametrize("controller", LAWS)
@pytest.mark.parametrize("speed", [1.2, 2.4])
def test_the_kernel_flies_the_plain_law(controller: str, speed: float) -> None:
    """Tick by tick along the flight, also where motors saturate and the estimate is frozen."""
    flown, plain = flown_by_the_plain_law(minimum_snap_plans(1, speed, seed=8)[0], controller)
    assert np.allclose(flown, plain, rtol=1e-7, atol=1e-4)


@pytest.mark.parametrize("controller", LAWS)
def test_drag_is_made_up_for(controller: str) -> None:
    """On gentle flights of a vehicle with much drag the error is clearly smaller; that is all they promise."""
    plans = minimum_snap_plans(40, 1.1, seed=9)
    plain, better = (
        MultirotorSimulator().rollout(plans, DRAGGED, seeds(40), RolloutOptions(controller=name))
        for name in ("geometric", controller)
    )
    calm = (plain.saturation_share == 0.0) & (better.saturation_share == 0.0)
    assert calm.sum() >= 10
    assert np.median(better.rms_error_m[calm]) < 0.95 * np.median(plain.rms_error_m[calm])


def test_a_row_flies_alone_as_in_a_batch() -> None:
    plans = minimum_snap_plans(40, 2.0, seed=10)
    for controller in CONTROLLERS:
        options = RolloutOptions(controller=controller)
        batch = MultirotorSimulator().rollout(plans, CRAZYFLIE, seeds(40), options)
        alone = MultirotorSimulator().rollout(plans.take([33]), CRAZYFLIE, seeds(1, 33), options)
        assert alone.paper_cost[0] == batch.paper_cost[33]
        assert alone.p8_error_m[0] == batch.p8_error_m[33]
