"""The airframe under the simulated autopilot: sensors, rotors, the floor; and what turns it."""

from __future__ import annotations

import math

import pytest
from virtual_mavlink import turned

from lcd_flight.model import GRAVITY_M_PER_S2, State
from lcd_flight.model.frames import from_yaw
from lcd_flight.worlds import load_vehicle
from sim_bridge.mavlink.body import Body
from sim_bridge.mavlink.estimator import Estimator
from sim_bridge.mavlink.frames import angles, level
from sim_bridge.mavlink.guidance import Goal, towards
from sim_bridge.mavlink.stabilizer import Gains, Stabilizer, wanted_rates

STILL = (0.0, 0.0, 0.0)
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
GAINS = Gains(6.5, 2.8)
HUMMINGBIRD = load_vehicle("hummingbird")
"""Its rotors: front left, front right, back right, back left; the first and third turn it counter-clockwise."""


def standing(height_m: float = 0.0) -> Body:
    return Body(HUMMINGBIRD, State((0.0, 0.0, height_m), STILL, from_yaw(0.0), STILL), 0, None)


def speeds(q: tuple[float, float, float, float], force_N: float = 5.0) -> tuple[float, float, float, float]:
    return Stabilizer(HUMMINGBIRD).speeds(q, force_N, UPRIGHT, STILL, GAINS)


def test_at_rest_the_accelerometer_measures_up_which_is_negative() -> None:
    body = standing()
    body.advance()
    assert body.inertial.specific_force == pytest.approx((0.0, 0.0, -GRAVITY_M_PER_S2), abs=0.1)
    assert body.inertial.body_rates == pytest.approx(STILL, abs=2e-3)


def test_gyroscopes_measure_forward_right_down() -> None:
    body = standing()
    a = HUMMINGBIRD.hover_rotor_speed
    for _ in range(25):
        body.command((1.2 * a,) * 4)
        body.advance()
    for _ in range(10):
        body.command((1.3 * a, 1.1 * a, 1.2 * a, 1.2 * a))
        body.advance()
    p, q, r = body.state.w_WB_B
    assert min(map(abs, (p, q, r))) > 0.05
    assert body.inertial.body_rates == pytest.approx((p, -q, -r), abs=1e-3)


def test_level_all_rotors_turn_alike_and_carry_the_force() -> None:
    told = speeds(UPRIGHT)
    assert max(told) == pytest.approx(min(told))
    assert HUMMINGBIRD.k_eta * sum(speed**2 for speed in told) == pytest.approx(5.0)


def test_to_roll_right_the_left_rotors_turn_faster() -> None:
    front_left, front_right, back_right, back_left = speeds(turned(roll_deg=5.0))
    assert min(front_left, back_left) > max(front_right, back_right)


def test_to_pitch_up_the_front_rotors_turn_faster() -> None:
    front_left, front_right, back_right, back_left = speeds(turned(pitch_deg=5.0))
    assert min(front_left, front_right) > max(back_left, back_right)


def test_to_turn_clockwise_the_others_turn_faster() -> None:
    front_left, front_right, back_right, back_left = speeds(turned(yaw_deg=5.0))
    assert min(front_right, back_left) > max(front_left, back_right)


def test_too_much_for_a_rotor_lowers_all_of_them() -> None:
    told = speeds(turned(roll_deg=10.0), force_N=HUMMINGBIRD.max_thrust_N)
    assert max(told) == pytest.approx(HUMMINGBIRD.rotor_speed_max)
    assert told[0] > told[1]


def test_the_tilt_is_turned_the_shortest_way_and_the_heading_with_less_weight() -> None:
    p, q, r = wanted_rates(turned(roll_deg=10.0), UPRIGHT, GAINS)
    assert (p, q, r) == pytest.approx((6.5 * 2 * math.sin(math.radians(5.0)), 0.0, 0.0), abs=1e-9)
    _, _, r = wanted_rates(turned(yaw_deg=10.0), UPRIGHT, GAINS)
    assert r == pytest.approx(2.8 * math.radians(10.0), rel=0.01)
    _, _, r = wanted_rates(turned(yaw_deg=60.0), UPRIGHT, GAINS)
    assert r == pytest.approx(2.0 * math.sin(math.radians(12.0)) * 2.8 / 0.4, rel=1e-6)


def test_rates_are_bounded_and_upside_down_is_no_special_case() -> None:
    p, q, r = wanted_rates((0.0, 1.0, 0.0, 0.0), UPRIGHT, GAINS)
    assert math.hypot(p, q, r) == pytest.approx(3.84)


def test_the_negative_of_a_setpoint_asks_for_the_same() -> None:
    w, x, y, z = turned(pitch_deg=30.0)
    assert wanted_rates((-w, -x, -y, -z), UPRIGHT, GAINS) == pytest.approx(wanted_rates((w, x, y, z), UPRIGHT, GAINS))


def test_dropped_from_a_metre_it_breaks_and_is_put_upright() -> None:
    body = Body(HUMMINGBIRD, State((0.0, 0.0, 0.0), STILL, from_yaw(0.0), STILL), 0, None)
    hover = HUMMINGBIRD.hover_rotor_speed
    while body.height_m < 1.0:
        body.command((1.1 * hover,) * 4)
        body.advance()
    while not body.on_ground:
        body.command((0.0,) * 4)
        body.advance()
    assert body.broken
    body.command((2.0 * hover,) * 4)
    for _ in range(100):
        body.advance()
    assert body.height_m == 0.0
    body.put_upright()
    body.command((1.2 * hover,) * 4)
    for _ in range(100):
        body.advance()
    assert body.height_m > 0.0


def at(position: tuple[float, float, float], yaw: float = 0.0) -> Estimator:
    estimate = Estimator(yaw)
    estimate.position = position
    return estimate


def test_a_place_to_the_north_pitches_the_nose_down() -> None:
    wish = towards(Goal((1.0, 0.0), 0.0, 0.0, 0.0), at(STILL))
    roll, pitch, _ = angles(wish.attitude)
    assert pitch < -0.1
    assert roll == pytest.approx(0.0)


def test_a_place_to_the_east_rolls_it_right_and_with_the_nose_east_pitches_it_down() -> None:
    roll, _, _ = angles(towards(Goal((0.0, 1.0), 0.0, 0.0, 0.0), at(STILL)).attitude)
    assert roll > 0.1
    roll, pitch, yaw = angles(towards(Goal((0.0, 1.0), 0.0, 0.0, math.pi / 2), at(STILL)).attitude)
    assert (roll, yaw) == pytest.approx((0.0, math.pi / 2), abs=1e-9)
    assert pitch < -0.1


def test_below_its_height_it_pushes_more_and_sinking_less() -> None:
    assert towards(Goal(None, -1.0, 0.0, 0.0), at(STILL)).force > 1.2
    assert towards(Goal(None, None, 0.5, 0.0), at(STILL)).force < 0.9
    assert towards(Goal(None, 0.0, 0.0, 0.0), at(STILL)).force == pytest.approx(1.0)
    assert towards(Goal(None, 0.0, 0.0, 0.7), at(STILL)).attitude == pytest.approx(level(0.7))
