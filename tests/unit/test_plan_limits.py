"""Peaks of a plan: their size, their place, and the findings where a limit is passed."""

import math

import numpy as np
import pytest

from lcd_flight.model import GeometricGains, Severity, Trajectory, Vehicle
from lcd_flight.planning.limits import PlanLimits, check_limits, peaks
from lcd_flight.planning.minimum_snap import minimum_snap

GAINS = GeometricGains(position=(6.0, 6.0, 6.0), velocity=(4.0, 4.0, 4.0), attitude=544.0, body_rates=46.64)
VEHICLE = Vehicle(
    name="of this test",
    mass_kg=0.5,
    inertia_kg_m2=(1e-3, 1e-3, 1e-3),
    rotor_positions_m=((0.1, 0.1, 0.0), (0.1, -0.1, 0.0), (-0.1, -0.1, 0.0), (-0.1, 0.1, 0.0)),
    rotor_directions=(1.0, -1.0, 1.0, -1.0),
    k_eta=2.5e-6,
    k_m=1e-7,
    k_d=0.0,
    k_z=0.0,
    k_h=0.0,
    k_flap=0.0,
    parasitic_drag=(0.0, 0.0, 0.0),
    motor_time_constant_s=0.005,
    rotor_speed_min=0.0,
    rotor_speed_max=1000.0,
    motor_noise=0.0,
    gains=GAINS,
    flight_gains=GAINS,
    onboard=None,
    source="made up",
)


def test_a_straight_line_peaks_where_the_known_polynomial_does():
    plan = minimum_snap(np.array([[0.0, 0.0, 1.0, 0.0], [2.0, 0.0, 1.0, 0.0]]), np.array([2.0]))
    found = peaks(plan, VEHICLE)
    assert found.speed.value == pytest.approx(35 / 16, rel=1e-9)  # 35/16 is the peak of the unit polynomial's rate
    assert found.speed.time_s == pytest.approx(1.0, abs=1e-4)
    u = np.linspace(0.0, 1.0, 200_001)
    acceleration = 2.0 / 4.0 * np.abs(420 * u**2 - 1680 * u**3 + 2100 * u**4 - 840 * u**5).max()
    assert found.tilt.value == pytest.approx(math.atan(acceleration / 9.81), rel=1e-7)
    assert found.thrust_ratio.value == pytest.approx(0.5 * math.hypot(acceleration, 9.81) / 10.0, rel=1e-7)


def test_they_are_no_less_than_any_sample_and_name_their_segment():
    rng = np.random.default_rng(0)
    waypoints = np.cumsum(rng.uniform(-2.0, 2.0, (9, 4)), axis=0)
    plan = minimum_snap(waypoints, rng.uniform(0.5, 2.0, 8))
    found = peaks(plan, VEHICLE)
    speeds = np.linalg.norm(plan.derivative(np.linspace(0.0, plan.duration_s, 5_001), 1)[:, :3], axis=1)
    assert speeds.max() <= found.speed.value * (1 + 1e-9)
    assert found.speed.value <= speeds.max() * (1 + 1e-3)
    knots = plan.knot_times_s
    for peak in (found.speed, found.tilt, found.thrust_ratio):
        assert knots[peak.segment] - 1e-9 <= peak.time_s <= knots[peak.segment + 1] + 1e-9


def test_hovering_is_level_and_carries_the_weight():
    found = peaks(Trajectory.hover((0.0, 0.0, 1.0), 0.0, 3.0), VEHICLE)
    assert found.speed.value == 0.0
    assert found.tilt.value == 0.0
    assert found.thrust_ratio.value == pytest.approx(0.4905)


def test_falling_faster_than_free_fall_is_upside_down():
    plan = Trajectory(np.array([1.0]), np.zeros((4, 1, 8)))
    plan.coefficients[2, 0, 2] = -10.0
    assert peaks(plan, VEHICLE).tilt.value == pytest.approx(math.pi)


def test_a_finding_for_each_limit_that_is_passed():
    plan = minimum_snap(np.array([[0.0, 0.0, 1.0, 0.0], [2.0, 0.0, 1.0, 0.0]]), np.array([2.0]))
    found = peaks(plan, VEHICLE)
    assert check_limits(found, PlanLimits()) == ()
    assert check_limits(found, PlanLimits(max_velocity=2.2, max_tilt_rad=1.0, max_thrust_ratio=0.9)) == ()
    speed, tilt, thrust = check_limits(found, PlanLimits(max_velocity=2.0, max_tilt_rad=0.1, max_thrust_ratio=0.5))
    assert (speed.code, tilt.code, thrust.code) == ("plan_speed", "plan_tilt", "plan_thrust")
    assert (speed.severity, speed.value, speed.limit) == (Severity.WARN, found.speed.value, 2.0)
    assert speed.message == "planned speed 2.19 m/s at 1.00 s, between waypoints 1 and 2 (limit 2)"
    assert "deg" in tilt.message
    assert "% of full thrust" in thrust.message
