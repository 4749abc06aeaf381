"""The released objective: its value and gradient, the waypoints, and that its snap term hides the network."""

import cost_models
import numpy as np
import pytest

from lcd_flight.learning.sampling import first_tasks
from lcd_flight.planning.cost.proxy import ThrustProxy
from lcd_flight.planning.knots import Whitening
from lcd_flight.planning.minimum_snap import minimum_snap_batch, snap
from lcd_flight.planning.released import ReleasedObjective, plan_released
from lcd_flight.worlds import load_world

WORLD = load_world("crazyflie-saturated")
TASKS = first_tasks(WORLD.sampler, 3, 5)
DURATIONS = TASKS.durations_s(WORLD.speed)


class Scaled:
    """The analytic cost plus a constant: exp(g) as large as wanted."""

    def __init__(self, offset):
        self.offset = offset

    def value_and_gradient(self, durations_s, coefficients):
        value, *gradients = ThrustProxy().value_and_gradient(durations_s, coefficients)
        return value + self.offset, *gradients


def test_the_value_is_snap_of_all_axes_and_the_exponential():
    space = Whitening.of(TASKS.poses, DURATIONS)
    z = np.random.default_rng(0).normal(size=space.z_shape) * 0.3
    value, _, trusted = ReleasedObjective(space, Scaled(5.0))(z.reshape(5, -1))
    plans = space.plan(z, np.zeros(DURATIONS.shape))
    g, _, _ = Scaled(5.0).value_and_gradient(plans.durations_s, plans.coefficients)
    least = snap(space.minimum)[:, :3].sum(axis=1)
    yaw_floor = snap(space.minimum)[:, 3]  # the least yaw snap is a constant, left out
    assert np.allclose(value * least, snap(plans).sum(axis=1) - yaw_floor + np.exp(g), rtol=1e-9)
    assert trusted.all()


def test_the_gradient_is_its_slope():
    space = Whitening.of(TASKS.poses, DURATIONS)
    objective = ReleasedObjective(space, Scaled(8.0))
    rng = np.random.default_rng(1)
    x, direction = rng.normal(size=(2, 5, 24)) * 0.3
    step = 1e-6
    rise = objective(x + step * direction)[0] - objective(x - step * direction)[0]
    assert np.allclose(rise / (2 * step), (objective(x)[1] * direction).sum(axis=1), rtol=1e-5)


def test_the_snap_term_dwarfs_the_network():
    """Metres of error against thousands of snap: as published, the plan stays minimum snap."""
    least = minimum_snap_batch(TASKS.poses, DURATIONS)
    as_published, failed = plan_released(TASKS, DURATIONS, ThrustProxy())
    loud, _ = plan_released(TASKS, DURATIONS, Scaled(np.log(snap(least).sum(axis=1).mean())))
    moved = [np.abs(p.coefficients - least.coefficients).max() for p in (as_published, loud)]
    assert not failed.any()
    assert moved[0] < 0.02 * moved[1]


def test_waypoints_hold():
    plans, _ = plan_released(TASKS, DURATIONS, Scaled(8.0))
    powers = DURATIONS[..., None] ** np.arange(8)
    ends = np.einsum("nask,nsk->nsa", plans.coefficients, powers)
    assert np.allclose(ends[..., :3], TASKS.waypoints_m[:, 1:], atol=1e-9)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_cost_that_is_not_finite_leaves_minimum_snap(bad):
    plans, failed = plan_released(TASKS, DURATIONS, Scaled(bad))
    assert failed.all()
    assert np.allclose(plans.coefficients, minimum_snap_batch(TASKS.poses, DURATIONS).coefficients)


def test_it_takes_a_network_that_sees_coefficients():
    plans, failed = plan_released(TASKS, DURATIONS, cost_models.random_whole_model("coefficients"))
    assert len(plans) == 5
    assert not failed.any()
