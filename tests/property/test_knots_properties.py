"""Whatever the planner's variables are, the waypoints hold and the plan is continuous to jerk."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from lcd_flight.planning.knots import Whitening


@st.composite
def plans(draw):
    """A task of 1 to 8 segments, its variables and the plan there."""
    segments = draw(st.integers(1, 8))
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    waypoints = np.cumsum(rng.uniform(-3.0, 3.0, (1, segments + 1, 4)), axis=1)
    durations = rng.uniform(0.4, 2.0, (1, segments))
    z = draw(arrays(float, (1, segments - 1, 3, 4), elements=st.floats(-10.0, 10.0)))
    theta = draw(arrays(float, (1, segments), elements=st.floats(-5.0, 5.0)))
    whitening = Whitening.of(waypoints, durations)
    return waypoints[0], durations[0], whitening.plan(z, theta)[0]


@settings(deadline=None, max_examples=100)
@given(plans())
def test_the_waypoints_hold_for_any_variables(case):
    waypoints, _, plan = case
    ends = (plan.coefficients * plan.durations_s[:, None] ** np.arange(8)).sum(axis=2).T
    assert np.abs(plan.coefficients[:, :, 0].T - waypoints[:-1]).max() < 1e-9
    assert np.abs(ends - waypoints[1:]).max() < 1e-9


@settings(deadline=None, max_examples=60)
@given(plans())
def test_the_plan_rests_at_its_ends_and_is_continuous_to_jerk(case):
    _, _, plan = case
    for order in (1, 2, 3):
        scale = np.array([math.perm(k, order) for k in range(8)])
        terms = plan.coefficients * scale * plan.durations_s[:, None] ** np.maximum(np.arange(8) - order, 0)
        ends = terms.sum(axis=2)
        starts = np.concatenate([plan.coefficients[:, :, order] * scale[order], np.zeros((4, 1))], axis=1)
        assert (starts[:, 0] == 0.0).all()
        assert np.abs(ends - starts[:, 1:]).max() <= 1e-11 * (1.0 + np.abs(terms).max())


@settings(deadline=None, max_examples=60)
@given(plans())
def test_re_timing_keeps_the_total_and_stays_within_its_reach(case):
    _, durations, plan = case
    assert math.isclose(plan.duration_s, durations.sum(), rel_tol=1e-12)
    assert np.abs(np.log(plan.durations_s / durations)).max() <= 2 * 0.7 + 1e-9
