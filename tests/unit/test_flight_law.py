"""The flight loop's law: thrust and attitude of the geometric law, the integral, and what is not finite."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Scipy

from lcd_flight.control.flight_law import NO_INTEGRAL, command, quaternion_of, thrust_limit_N
from lcd_flight.control.geometric import rotation_of
from lcd_flight.model import GRAVITY_M_PER_S2, Reference, State, Vector3
from lcd_flight.model.frames import IDENTITY, body_z_axis, from_yaw, multiply, rotate, yaw_of
from lcd_flight.worlds import load_vehicle

VEHICLE = load_vehicle("crazyflie")
ZERO: Vector3 = (0.0, 0.0, 0.0)


def at(p: Vector3 = ZERO, v: Vector3 = ZERO, q: tuple[float, float, float, float] = IDENTITY) -> State:
    return State(p, v, q, ZERO)


def hover(p: Vector3 = ZERO, a: Vector3 = ZERO, yaw: float = 0.0) -> Reference:
    return Reference(p, ZERO, a, ZERO, ZERO, yaw, 0.0, 0.0)


def with_integral(gain: float, limit: float):
    gains = replace(VEHICLE.flight_gains, integral=(gain, gain, gain), integral_limit=limit)
    return replace(VEHICLE, flight_gains=gains)


def test_at_rest_on_its_reference_it_hovers() -> None:
    setpoint, integral = command(at(), hover(), VEHICLE, NO_INTEGRAL, 0.01)
    assert setpoint.thrust_N == pytest.approx(VEHICLE.weight_N)
    assert setpoint.q_WB == pytest.approx(IDENTITY)
    assert integral == NO_INTEGRAL


def test_thrust_points_where_the_force_is_wanted() -> None:
    """Body z along Kx e + Kv e_v + a + g, its size projected onto where thrust points now, times the mass."""
    gains = VEHICLE.flight_gains
    p, v, a, q = (0.1, -0.2, 0.3), (0.5, 0.4, -0.1), (1.0, -2.0, 0.5), from_yaw(0.4)
    tilted = multiply(q, (math.sin(0.1), 0.0, 0.0, math.cos(0.1)))
    setpoint, _ = command(at(p, v, tilted), hover(a=a, yaw=0.4), VEHICLE, NO_INTEGRAL, 0.01)
    gravity = np.array([0.0, 0.0, GRAVITY_M_PER_S2])
    wanted = gravity + a - np.array(gains.position) * p - np.array(gains.velocity) * v
    assert np.allclose(body_z_axis(setpoint.q_WB), wanted / np.linalg.norm(wanted))
    assert setpoint.thrust_N == pytest.approx(VEHICLE.mass_kg * float(wanted @ body_z_axis(tilted)))


@pytest.mark.parametrize("yaw", [-3.0, -0.5, 0.0, 2.0])
def test_level_it_takes_the_heading_and_hands_the_yaw_rate_on(yaw: float) -> None:
    setpoint, _ = command(at(), replace(hover(yaw=yaw), yaw_rate=0.7), VEHICLE, NO_INTEGRAL, 0.01)
    assert yaw_of(setpoint.q_WB) == pytest.approx(yaw)
    assert setpoint.yaw_rate == 0.7


def test_thrust_is_never_negative() -> None:
    upside_down = (1.0, 0.0, 0.0, 0.0)
    assert command(at(q=upside_down), hover(), VEHICLE, NO_INTEGRAL, 0.01)[0].thrust_N == 0.0
    assert command(at(p=(0.0, 0.0, 9.0)), hover(), VEHICLE, NO_INTEGRAL, 0.01)[0].thrust_N == 0.0


def test_what_is_not_finite_stays_so() -> None:
    nan = math.nan
    assert not command(at(p=(nan, 0.0, 0.0)), hover(), VEHICLE, NO_INTEGRAL, 0.01)[0].is_finite()
    assert not command(at(), hover(a=(0.0, 0.0, nan)), VEHICLE, NO_INTEGRAL, 0.01)[0].is_finite()
    assert not command(at(q=(nan, 0.0, 0.0, 1.0)), hover(), VEHICLE, NO_INTEGRAL, 0.01)[0].is_finite()


def test_the_integral_is_off_by_default() -> None:
    assert VEHICLE.flight_gains.integral == ZERO
    _, integral = command(at(p=(1.0, 1.0, 1.0)), hover(), VEHICLE, NO_INTEGRAL, 0.01)
    assert integral == NO_INTEGRAL


def test_the_integral_pushes_against_the_error_and_is_bounded() -> None:
    vehicle = with_integral(0.2, 0.5)
    integral = NO_INTEGRAL
    for _ in range(100):
        _, integral = command(at(p=(0.5, -0.5, 0.0)), hover(), vehicle, integral, 0.01)
    assert integral == pytest.approx((-0.1, 0.1, 0.0))
    for _ in range(10_000):
        _, integral = command(at(p=(0.5, -0.5, 0.0)), hover(), vehicle, integral, 0.01)
    assert integral == pytest.approx((-0.5, 0.5, 0.0))
    setpoint, _ = command(at(), hover(), vehicle, integral, 0.01)
    assert np.allclose(
        body_z_axis(setpoint.q_WB), np.array([-0.5, 0.5, GRAVITY_M_PER_S2]) / math.hypot(0.5, 0.5, GRAVITY_M_PER_S2)
    )


def test_the_integral_does_not_wind_up_while_thrust_is_at_its_limit() -> None:
    vehicle = with_integral(0.2, 0.5)
    far_below = at(p=(0.0, 0.0, -5.0))
    setpoint, integral = command(far_below, hover(), vehicle, (0.0, 0.0, 0.1), 0.01)
    assert setpoint.thrust_N > thrust_limit_N(vehicle)
    assert integral == (0.0, 0.0, 0.1)


def test_the_thrust_limit_is_the_onboard_controllers() -> None:
    assert thrust_limit_N(VEHICLE) == pytest.approx(60000 / 65535 * VEHICLE.max_thrust_N)
    assert thrust_limit_N(replace(VEHICLE, onboard=None)) == VEHICLE.max_thrust_N


def test_quaternions_of_all_kinds_of_rotation() -> None:
    rng = np.random.default_rng(0)
    half_turns = [(1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.6, 0.0, 0.8, 0.0)]
    for q in [*half_turns, *(tuple(Scipy.random(random_state=rng).as_quat().tolist()) for _ in range(200))]:
        back = quaternion_of(rotation_of(q))
        assert back[3] >= 0.0
        assert math.hypot(*back) == pytest.approx(1.0)
        for v in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
            assert np.allclose(rotate(back, v), rotate(q, v), atol=1e-12)
