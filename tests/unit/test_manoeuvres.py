from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lcd_flight.flight.manoeuvres import (
    BLIND_ACCELERATION,
    BLIND_MARGIN,
    DESCENT_SPEED,
    HARDEST_DECELERATION,
    PRESS_DEPTH_M,
    RETURN_SPEED,
    blind_setpoint,
    blind_time_s,
    go_to,
    land_from,
    pressed_down,
    stop,
)
from lcd_flight.model import State, Trajectory, Vector3, Vehicle
from lcd_flight.model.frames import from_yaw, yaw_of
from lcd_flight.safety.fence import STOPPING_DECELERATION, stopping_point_m
from lcd_flight.worlds import load_vehicle

speeds = st.floats(-4.0, 4.0)
velocities = st.tuples(speeds, speeds, speeds)


def moving(v_W: Vector3, yaw_rad: float = 0.7) -> State:
    return State((1.0, -2.0, 1.5), v_W, from_yaw(yaw_rad), (0.0, 0.0, 0.0))


@settings(max_examples=50, deadline=None, derandomize=True)
@given(velocities)
def test_stop_begins_as_it_flies_and_ends_where_the_fence_expects_it(v_W: Vector3) -> None:
    path = stop(moving(v_W), ground_z_m=-100.0)
    begin, end = path.reference(0.0), path.reference(path.duration_s + 3.0)
    assert begin.p_W == (1.0, -2.0, 1.5)
    assert begin.v_W == pytest.approx(v_W)
    assert math.hypot(*begin.a_W) <= STOPPING_DECELERATION + 1e-9
    assert end.p_W == pytest.approx(stopping_point_m((1.0, -2.0, 1.5), v_W), abs=0.011 * math.hypot(*v_W) + 1e-9)
    assert end.v_W == end.a_W == (0.0, 0.0, 0.0)
    assert end.yaw_rad == pytest.approx(0.7)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(velocities)
def test_landing_from_here_goes_straight_down_at_its_speed(v_W: Vector3) -> None:
    path = land_from(moving(v_W), ground_z_m=0.0)
    braked_s = float(path.durations_s[0])
    assert path.reference(0.0).v_W == pytest.approx(v_W)
    later = path.reference(braked_s + 0.5 * (path.duration_s - braked_s))
    assert later.v_W == pytest.approx((0.0, 0.0, -DESCENT_SPEED))
    before, after = path.reference(braked_s - 1e-9), path.reference(braked_s + 1e-9)
    assert before.p_W == pytest.approx(after.p_W, abs=1e-6)
    assert before.v_W == pytest.approx(after.v_W, abs=1e-6)
    assert -PRESS_DEPTH_M - 0.5 < path.reference(path.duration_s + 1.0).p_W[2] <= -PRESS_DEPTH_M + 1e-9


@pytest.mark.parametrize("v_W", [(3.0, 0.0, -2.5), (0.0, 0.0, -3.9), (0.0, 2.0, -0.5)])
def test_near_the_ground_it_brakes_harder_and_stops_above(v_W: Vector3) -> None:
    path = stop(State((0.0, 0.0, 1.0), v_W, from_yaw(0.0), (0.0, 0.0, 0.0)), ground_z_m=0.0)
    assert path.reference(path.duration_s).p_W[2] >= -1e-9
    assert math.hypot(*path.reference(0.0).a_W) <= HARDEST_DECELERATION + 1e-9


def test_no_stop_is_harder_than_thrust_can_do_it() -> None:
    path = stop(State((0.0, 0.0, 0.2), (0.0, 0.0, -3.0), from_yaw(0.0), (0.0, 0.0, 0.0)), ground_z_m=0.0)
    assert math.hypot(*path.reference(0.0).a_W) == pytest.approx(HARDEST_DECELERATION)


def test_landing_from_below_the_ground_still_presses_down() -> None:
    low = State((0.0, 0.0, -0.1), (0.0, 0.0, 0.0), from_yaw(0.0), (0.0, 0.0, 0.0))
    path = land_from(low, ground_z_m=0.0)
    assert path.reference(path.duration_s).p_W[2] < -0.1 - 0.9 * PRESS_DEPTH_M


def test_a_planned_landing_is_left_as_it_is_and_goes_on_down() -> None:
    landing = Trajectory.hover((1.0, 2.0, 0.0), 0.4, 1.0)
    pressed = pressed_down(landing)
    assert pressed.reference(0.5) == landing.reference(0.5)
    assert pressed.reference(10.0).p_W == pytest.approx((1.0, 2.0, -PRESS_DEPTH_M))
    assert pressed.reference(10.0).yaw_rad == pytest.approx(0.4)


@pytest.mark.parametrize("target", [(2.0, -1.0, 1.0, 3.0), (1.0, -2.0, 1.5, -2.6), (1.0, -2.0, 1.5, 0.7)])
def test_the_way_back_is_straight_slow_and_from_rest_to_rest(target: tuple[float, ...]) -> None:
    path = go_to(moving((0.0, 0.0, 0.0)), np.array(target))
    begin, end = path.reference(0.0), path.reference(path.duration_s)
    assert begin.p_W == (1.0, -2.0, 1.5)
    assert end.p_W == pytest.approx(target[:3])
    assert math.cos(end.yaw_rad - target[3]) == pytest.approx(1.0)
    for instant in (begin, end):
        assert (*instant.v_W, *instant.a_W) == pytest.approx((0.0,) * 6, abs=1e-9)
    times = np.linspace(0.0, path.duration_s, 200)
    points, speed = path.derivative(times, 0), np.linalg.norm(path.derivative(times, 1)[:, :3], axis=1)
    assert speed.max() <= RETURN_SPEED + 1e-9
    assert np.abs(np.diff(points[:, 3])).sum() <= math.pi + 1e-9
    way = np.array(target[:3]) - points[0, :3]
    assert np.linalg.norm(np.cross(points[:, :3] - points[0, :3], way), axis=1).max() < 1e-9


def test_the_blind_setpoint_is_level_and_just_below_hover() -> None:
    vehicle = load_vehicle("crazyflie")
    setpoint = blind_setpoint(vehicle, 0.3, 1.2)
    assert setpoint.thrust_N == pytest.approx(0.3 - 0.5 * vehicle.mass_kg)
    assert yaw_of(setpoint.q_WB) == pytest.approx(1.2)


def fall_time_s(vehicle: Vehicle, height_m: float, climb: float) -> float:
    """The descent integrated, with inflow and drag."""
    height, sink, step_s, steps = height_m, -climb, 0.001, 0
    inflow = 4.0 * vehicle.k_z * vehicle.hover_rotor_speed
    while height > 0.0:
        resistance = inflow * sink + vehicle.parasitic_drag[2] * sink * abs(sink)
        sink += step_s * (BLIND_ACCELERATION - resistance / vehicle.mass_kg)
        height -= step_s * sink
        steps += 1
    return steps * step_s


@pytest.mark.parametrize("name", ["crazyflie", "crazyflie-2.1", "hummingbird", "x500"])
@pytest.mark.parametrize(("height_m", "climb"), [(0.3, 0.0), (1.0, 0.0), (2.0, 1.5), (8.0, 0.0), (30.0, 2.0)])
def test_the_blind_time_covers_the_descent_and_little_more(name: str, height_m: float, climb: float) -> None:
    vehicle = load_vehicle(name)
    share = blind_time_s(vehicle, height_m, climb) / fall_time_s(vehicle, height_m, climb)
    assert 0.9 * BLIND_MARGIN < share < 1.7 * BLIND_MARGIN


def test_the_blind_time_of_a_vehicle_without_drag_is_that_of_free_motion() -> None:
    slippery = replace(load_vehicle("crazyflie"), k_z=0.0, parasitic_drag=(0.0, 0.0, 0.0))
    assert blind_time_s(slippery, 1.0, 0.0) == pytest.approx(BLIND_MARGIN * math.sqrt(2.0 / BLIND_ACCELERATION))


def test_there_is_no_blind_time_on_the_ground() -> None:
    assert blind_time_s(load_vehicle("crazyflie"), -0.05, -1.0) == 0.0
