"""Damage to a trajectory shows: every digit of it is tied to the others by continuity and waypoints."""

from __future__ import annotations

import numpy as np
import pytest

from lcd_flight.mission.soundness import discontinuity, flaw, knot_derivatives
from lcd_flight.model import Trajectory
from lcd_flight.planning.minimum_snap import minimum_snap

RANDOM = np.random.default_rng(5)
WAYPOINTS = np.column_stack([RANDOM.normal(size=(5, 3)).cumsum(axis=0), [0.0, 0.4, 0.9, 2.0, 4.0]])
PLAN = minimum_snap(WAYPOINTS, np.array([1.0, 0.8, 1.7, 1.2]))


def changed(axis: int, segment: int, power: int, value: float) -> Trajectory:
    coefficients = PLAN.coefficients.copy()
    coefficients[axis, segment, power] = value
    return Trajectory(PLAN.durations_s, coefficients)


def test_a_good_plan_has_no_flaw() -> None:
    assert flaw(PLAN, WAYPOINTS) is None


@pytest.mark.parametrize("durations", [np.ones(199), np.exp(RANDOM.normal(size=199))], ids=["even", "uneven"])
def test_long_plans_have_none_either(durations: np.ndarray) -> None:
    waypoints = np.column_stack([RANDOM.normal(size=(200, 3)).cumsum(axis=0), np.zeros(200)])
    assert flaw(minimum_snap(waypoints, durations), waypoints) is None


@pytest.mark.parametrize("axis", range(4))
@pytest.mark.parametrize("segment", range(4))
@pytest.mark.parametrize("power", range(8))
def test_no_coefficient_can_be_changed_unnoticed(axis: int, segment: int, power: int) -> None:
    value = PLAN.coefficients[axis, segment, power]
    assert flaw(changed(axis, segment, power, value + 1e-3), WAYPOINTS)
    assert flaw(changed(axis, segment, power, np.nan), WAYPOINTS) == "has a coefficient that is not finite"
    assert flaw(changed(axis, segment, power, 1e300), WAYPOINTS)


@pytest.mark.parametrize("segment", range(4))
@pytest.mark.parametrize("factor", [1.001, 0.5, 0.0, -1.0, np.nan, np.inf])
def test_no_duration_can_be_changed_unnoticed(segment: int, factor: float) -> None:
    durations = PLAN.durations_s.copy()
    durations[segment] *= factor
    assert flaw(Trajectory(durations, PLAN.coefficients), WAYPOINTS)


def test_a_missed_waypoint_is_named() -> None:
    waypoints = WAYPOINTS.copy()
    waypoints[3, 1] += 0.25
    assert flaw(PLAN, waypoints) == "misses waypoint 4 by 0.25 m in y"
    waypoints = WAYPOINTS.copy()
    waypoints[-1, 2] += 0.5
    assert flaw(PLAN, waypoints) == "misses waypoint 5 by 0.5 m in z"
    waypoints = WAYPOINTS.copy()
    waypoints[0, 3] += 0.5
    assert flaw(PLAN, waypoints) == "misses waypoint 1 by 0.5 rad in yaw"


def test_a_jump_is_named() -> None:
    found = discontinuity(changed(0, 1, 2, PLAN.coefficients[0, 1, 2] + 0.5))
    assert found is not None
    assert found.startswith("is not continuous: x's ")
    tangled = discontinuity(changed(2, 0, 1, 0.5))
    assert tangled is not None
    assert "z's velocity" in tangled or "is not continuous" in tangled


def test_an_end_in_motion_is_named() -> None:
    drifting = Trajectory(np.array([2.0]), np.zeros((4, 1, 8)))
    drifting.coefficients[1, 0, 1] = 0.25
    assert discontinuity(drifting) == "is not at rest at its start: y's velocity is 0.25"


def test_other_numbers_of_waypoints() -> None:
    assert flaw(PLAN, WAYPOINTS[:4]) == "has 4 segments; 4 waypoints need 3"


def test_knot_derivatives_are_those_of_the_polynomials() -> None:
    starts, ends = knot_derivatives(PLAN)
    knots = PLAN.knot_times_s
    for order in range(4):
        expected = PLAN.derivative(knots, order)
        assert np.allclose(starts[:, order], expected[:-1], atol=1e-9)
        assert np.allclose(ends[:, order], expected[1:], atol=1e-9)
