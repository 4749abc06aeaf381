"""The geometric law on scalars: held to the paper's equation 2 in matrices and to RotorPy; its degenerate cases."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from rotorpy.controllers.quadrotor_control import SE3Control

from lcd_flight.control.geometric import (
    Rotation,
    acceleration_setpoint,
    attitude_error,
    attitude_setpoint,
    clipped,
    dot,
    moment,
    moment_feed_forward,
    rotation_of,
    rotor_speeds,
    scaled,
)
from lcd_flight.model import GRAVITY_M_PER_S2, Quaternion, Vector3
from lcd_flight.model.frames import normalized
from lcd_flight.worlds import load_vehicle
from sim_bridge.craft import craft_of
from sim_bridge.rotorpy_adapter import parameters

Matrix = NDArray[np.float64]
VEHICLES = [load_vehicle("crazyflie"), load_vehicle("hummingbird")]
K_R, K_W = 544.0, 46.64


def hat(v: Matrix) -> Matrix:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def matrix(R: Rotation) -> Matrix:
    return np.array(R).T


def vector(values: Matrix) -> Vector3:
    x, y, z = (float(v) for v in values)
    return (x, y, z)


def attitude(rng: np.random.Generator) -> Quaternion:
    x, y, z, w = (float(v) for v in rng.normal(size=4))
    return normalized((x, y, z, w))


def test_columns_of_a_quaternion_are_the_rotation() -> None:
    from scipy.spatial.transform import Rotation as Scipy

    rng = np.random.default_rng(0)
    for _ in range(50):
        q = attitude(rng)
        assert np.allclose(matrix(rotation_of(q)), Scipy.from_quat(q).as_matrix(), atol=1e-14)


def test_the_law_is_the_papers_equation_2_in_matrices() -> None:
    """f and M, with the last term of M apart: RotorPy drops it."""
    rng = np.random.default_rng(1)
    for _ in range(100):
        p, v, pd, vd, ad, w, wd, dwd = rng.normal(size=(8, 3))
        mass, J = 0.5, np.diag(rng.uniform(1.0, 5.0, 3))
        Kx, Kv = np.diag([6.5, 6.5, 15.0]), np.diag([4.0, 4.0, 9.0])
        R = rotation_of(attitude(rng))
        yaw = float(rng.uniform(-4.0, 4.0))
        F = mass * (-Kx @ (p - pd) - Kv @ (v - vd) + GRAVITY_M_PER_S2 * np.array([0.0, 0.0, 1.0]) + ad)
        b3 = F / np.linalg.norm(F)
        b2 = np.cross(b3, [math.cos(yaw), math.sin(yaw), 0.0])
        b2 /= np.linalg.norm(b2)
        Rm, Rd = matrix(R), np.stack([np.cross(b2, b3), b2, b3], axis=1)
        E = 0.5 * (Rd.T @ Rm - Rm.T @ Rd)
        e_R = np.array([E[2, 1], E[0, 2], E[1, 0]])
        M = J @ (-K_R * e_R - K_W * (w - [0.0, 0.0, wd[2]])) + np.cross(w, J @ w)
        last = -J @ (hat(w) @ Rm.T @ Rd @ wd - Rm.T @ Rd @ dwd)

        acceleration = acceleration_setpoint(
            vector(p), vector(v), vector(pd), vector(vd), vector(ad), (6.5, 6.5, 15.0), (4.0, 4.0, 9.0)
        )
        force = scaled(acceleration, mass)
        R_WD = attitude_setpoint(force, (math.cos(yaw), math.sin(yaw)))
        inertia = vector(np.diag(J))
        assert np.allclose(force, F, atol=1e-12)
        assert np.isclose(dot(force, R[2]), F @ Rm @ [0.0, 0.0, 1.0], atol=1e-12)
        assert np.allclose(matrix(R_WD), Rd, atol=1e-12)
        assert np.allclose(attitude_error(R, R_WD), e_R, atol=1e-12)
        assert np.allclose(moment(R, R_WD, vector(w), float(wd[2]), inertia, K_R, K_W), M, atol=1e-9)
        assert np.allclose(moment_feed_forward(R, R_WD, vector(w), vector(wd), vector(dwd), inertia), last, atol=1e-12)


@pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda v: v.name)
def test_rotor_speeds_are_those_of_rotorpys_controller(vehicle) -> None:
    rng = np.random.default_rng(2)
    law = craft_of(vehicle, vehicle, "paper").law
    theirs = SE3Control(parameters(vehicle))
    for _ in range(30):
        p, v, pd, vd, ad, w = rng.normal(size=(6, 3))
        q, yaw, yaw_rate = attitude(rng), float(rng.uniform(-3.0, 3.0)), float(rng.normal())
        expected = theirs.update(
            0.0,
            {"x": p, "v": v, "q": np.array(q), "w": w},
            {"x": pd, "x_dot": vd, "x_ddot": ad, "yaw": yaw, "yaw_dot": yaw_rate},
        )
        acceleration = acceleration_setpoint(
            vector(p), vector(v), vector(pd), vector(vd), vector(ad), law.position_gain, law.velocity_gain
        )
        force = scaled(acceleration, law.mass_kg)
        R = rotation_of(q)
        R_WD = attitude_setpoint(force, (math.cos(yaw), math.sin(yaw)))
        turn = moment(R, R_WD, vector(w), yaw_rate, law.inertia_kg_m2, law.attitude_gain, law.rate_gain)
        ours = rotor_speeds(dot(force, R[2]), turn, law.allocation)
        assert np.allclose(ours, expected["cmd_motor_speeds"], rtol=1e-9)


def test_without_a_force_the_vehicle_is_asked_to_be_level() -> None:
    for force in ((0.0, 0.0, 0.0), (1e-12, -1e-12, 0.0)):
        R = attitude_setpoint(force, (0.6, 0.8))
        assert np.allclose(matrix(R), [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_thrust_along_the_heading_still_gives_a_rotation(sign: float) -> None:
    heading = (math.cos(0.3), math.sin(0.3))
    R = matrix(attitude_setpoint((sign * heading[0], sign * heading[1], 0.0), heading))
    assert np.allclose(R.T @ R, np.eye(3), atol=1e-12)
    assert np.isclose(np.linalg.det(R), 1.0)
    assert np.allclose(R[:, 2], [sign * heading[0], sign * heading[1], 0.0])


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.6, 0.0, 0.8)])
def test_at_half_a_turn_the_attitude_error_vanishes_and_nearby_it_does_not(axis: Vector3) -> None:
    """The law's unstable equilibrium; the error is the sine of the angle, about the axis."""
    level = rotation_of((0.0, 0.0, 0.0, 1.0))
    for angle in (math.pi, math.pi - 0.1, 0.3):
        q = (*(math.sin(0.5 * angle) * a for a in axis), math.cos(0.5 * angle))
        assert np.allclose(attitude_error(rotation_of(q), level), math.sin(angle) * np.array(axis), atol=1e-12)


def test_nan_in_is_nan_out() -> None:
    """A controller that turns NaN into a number hides a fault."""
    nan = math.nan
    fine = (0.1, 0.2, 0.3)
    acceleration = acceleration_setpoint((nan, 0.0, 0.0), fine, fine, fine, fine, fine, fine)
    assert math.isnan(acceleration[0])
    R = attitude_setpoint((nan, 0.0, 1.0), (1.0, 0.0))
    assert any(math.isnan(v) for column in R for v in column)
    assert all(math.isnan(v) for v in attitude_error(R, R))
    assert math.isnan(clipped(nan, 0.0, 1.0))
    law = craft_of(VEHICLES[0], VEHICLES[0], "paper").law
    assert all(math.isnan(s) for s in rotor_speeds(nan, fine, law.allocation))


def test_a_negative_force_is_a_negative_speed() -> None:
    """The vehicle clips it; the controller does not hide how far it is out."""
    law = craft_of(VEHICLES[0], VEHICLES[0], "paper").law
    speeds = rotor_speeds(-0.4, (0.0, 0.0, 0.0), law.allocation)
    assert speeds == pytest.approx((-math.sqrt(0.1 / law.allocation.k_eta),) * 4)


def test_a_weaker_vehicle_is_allocated_for_as_believed() -> None:
    vehicle = VEHICLES[0]
    weaker = replace(vehicle, k_eta=0.5 * vehicle.k_eta)
    assert craft_of(weaker, vehicle, "paper").law == craft_of(vehicle, vehicle, "paper").law
