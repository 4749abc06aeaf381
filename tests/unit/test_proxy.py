"""The analytic cost: what it measures, and its gradients."""

import numpy as np
import pytest

from lcd_flight.model import Trajectories, Trajectory
from lcd_flight.planning.cost.proxy import ThrustProxy
from lcd_flight.planning.minimum_snap import minimum_snap_batch


def some_plans(count=3, segments=3):
    rng = np.random.default_rng(0)
    waypoints = np.cumsum(rng.uniform(-2.0, 2.0, (count, segments + 1, 4)), axis=1)
    return minimum_snap_batch(waypoints, rng.uniform(0.5, 2.0, (count, segments)))


def test_hover_costs_nothing():
    plans = Trajectories.stack([Trajectory.hover((1.0, 2.0, 3.0), 0.4, 2.0)])
    value, grad_durations, _ = ThrustProxy().value_and_gradient(plans.durations_s, plans.coefficients)
    np.testing.assert_allclose(value, 0.0, atol=1e-15)
    np.testing.assert_allclose(grad_durations, 0.0, atol=1e-15)


def test_it_is_the_eighth_power_mean_of_the_force_over_time():
    plans = some_plans()
    value, _, _ = ThrustProxy().value_and_gradient(plans.durations_s, plans.coefficients)
    for plan, cost in zip(plans, value, strict=True):
        times = np.linspace(0.0, plan.duration_s, 20_001)
        force = plan.derivative(times, 2)[:, :3] + 0.3 * plan.derivative(times, 1)[:, :3] + [0.0, 0.0, 9.81]
        mean = np.mean((np.linalg.norm(force, axis=1) / 9.81) ** 8)
        assert cost == pytest.approx(np.log(mean) / 8.0, abs=1e-3)


def test_yaw_and_where_it_is_flown_do_not_matter():
    plans = some_plans()
    value, _, gradient = ThrustProxy().value_and_gradient(plans.durations_s, plans.coefficients)
    elsewhere = plans.coefficients.copy()
    elsewhere[:, 3] = 1.0
    elsewhere[:, :, :, 0] += 5.0
    moved, _, _ = ThrustProxy().value_and_gradient(plans.durations_s, elsewhere)
    np.testing.assert_allclose(moved, value, rtol=1e-14)
    assert (gradient[:, 3] == 0.0).all()
    assert (gradient[..., 0] == 0.0).all()


def test_flying_faster_costs_more():
    plans = some_plans()
    fast = plans.coefficients * 2.0 ** np.arange(8)
    slow_cost, _, _ = ThrustProxy().value_and_gradient(plans.durations_s, plans.coefficients)
    fast_cost, _, _ = ThrustProxy().value_and_gradient(0.5 * plans.durations_s, fast)
    assert (fast_cost > slow_cost).all()


def test_a_plan_that_is_not_finite_has_a_cost_that_is_not():
    plans = some_plans()
    broken = plans.coefficients.copy()
    broken[1, 0, 0, 4] = np.nan
    value, _, _ = ThrustProxy().value_and_gradient(plans.durations_s, broken)
    assert np.isfinite(value).tolist() == [True, False, True]


@pytest.mark.parametrize("drag", [0.0, 0.3, 1.0])
def test_its_gradients_agree_with_finite_differences(drag):
    cost, plans = ThrustProxy(drag), some_plans(segments=4)
    durations, coefficients = plans.durations_s, plans.coefficients
    _, grad_durations, grad_coefficients = cost.value_and_gradient(durations, coefficients)
    rng = np.random.default_rng(1)
    for _ in range(5):
        step_t, step_c = 1e-6 * rng.normal(size=durations.shape), 1e-6 * rng.normal(size=coefficients.shape)
        above, _, _ = cost.value_and_gradient(durations + step_t, coefficients + step_c)
        below, _, _ = cost.value_and_gradient(durations - step_t, coefficients - step_c)
        slope = (grad_durations * step_t).sum(axis=1) + (grad_coefficients * step_c).sum(axis=(1, 2, 3))
        np.testing.assert_allclose(slope, 0.5 * (above - below), rtol=1e-4, atol=1e-11)
