"""Minimum snap over all numbers of waypoints and all durations: what must hold whatever the task."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from lcd_flight.model import Trajectories
from lcd_flight.planning.minimum_snap import minimum_snap, snap


@st.composite
def tasks(draw):
    """2 to 13 waypoints in a 20 m box, durations from 0.3 to 6 s."""
    segments = draw(st.integers(1, 12))
    steps = draw(arrays(float, (segments, 4), elements=st.floats(0.1, 3.0)))
    signs = draw(arrays(float, (segments, 4), elements=st.sampled_from([-1.0, 1.0])))
    start = draw(arrays(float, 4, elements=st.floats(-10.0, 10.0)))
    logs = draw(arrays(float, segments, elements=st.floats(np.log(0.3), np.log(6.0))))
    return start + np.concatenate([np.zeros((1, 4)), np.cumsum(signs * steps, axis=0)]), np.exp(logs)


def extent(plan):
    """How far the plan swings, m: rounding is relative to it."""
    return 1.0 + np.abs(plan.derivative(np.linspace(0.0, plan.duration_s, 400), 0)).max()


def derivative_at_ends(plan, order):
    """A derivative at each segment's start (4, S), and the eight terms that make it up at its end (4, S, 8)."""
    scale = np.array([math.perm(k, order) for k in range(8)])
    terms = plan.coefficients * scale * plan.durations_s[:, None] ** np.maximum(np.arange(8) - order, 0)
    return plan.coefficients[:, :, order] * scale[order], terms


@settings(deadline=None, max_examples=60)
@given(tasks())
def test_waypoints_hold_on_both_sides_of_a_knot(task):
    waypoints, durations = task
    plan = minimum_snap(waypoints, durations)
    ends = (plan.coefficients * (durations[:, None] ** np.arange(8))).sum(axis=2).T
    assert np.abs(plan.coefficients[:, :, 0].T - waypoints[:-1]).max() < 1e-9
    assert np.abs(ends - waypoints[1:]).max() < 1e-9


@settings(deadline=None, max_examples=60)
@given(tasks())
def test_it_rests_at_both_ends(task):
    plan = minimum_snap(*task)
    for order in (1, 2, 3):
        starts, terms = derivative_at_ends(plan, order)
        assert np.abs(starts[:, 0]).max() == 0.0
        assert np.abs(terms[:, -1].sum(axis=1)).max() <= 1e-9 * (1.0 + np.abs(terms).max())


@settings(deadline=None, max_examples=60)
@given(tasks())
def test_derivatives_to_snap_are_continuous(task):
    plan = minimum_snap(*task)
    for order in (1, 2, 3, 4):
        starts, terms = derivative_at_ends(plan, order)
        gaps = terms.sum(axis=2)[:, :-1] - starts[:, 1:]
        assert np.abs(gaps).max(initial=0.0) <= 1e-9 * (1.0 + np.abs(terms).max())


@settings(deadline=None, max_examples=60)
@given(tasks(), st.floats(0.2, 5.0))
def test_flying_it_slower_is_the_same_path(task, factor):
    waypoints, durations = task
    plan, slow = minimum_snap(waypoints, durations), minimum_snap(waypoints, factor * durations)
    times = np.linspace(0.0, plan.duration_s, 50)
    np.testing.assert_allclose(slow.derivative(factor * times, 0), plan.derivative(times, 0), atol=1e-7 * extent(plan))


@settings(deadline=None, max_examples=60)
@given(tasks(), arrays(float, 4, elements=st.floats(-20.0, 20.0)))
def test_moving_the_waypoints_moves_the_plan(task, shift):
    waypoints, durations = task
    plan, moved = minimum_snap(waypoints, durations), minimum_snap(waypoints + shift, durations)
    np.testing.assert_allclose(
        moved.coefficients[..., 1:], plan.coefficients[..., 1:], rtol=1e-6, atol=1e-7 * np.abs(plan.coefficients).max()
    )


@settings(deadline=None, max_examples=60)
@given(tasks())
def test_flown_backwards_it_is_the_same_path(task):
    waypoints, durations = task
    plan, back = minimum_snap(waypoints, durations), minimum_snap(waypoints[::-1], durations[::-1])
    times = np.linspace(0.0, plan.duration_s, 50)
    np.testing.assert_allclose(
        back.derivative(plan.duration_s - times, 0), plan.derivative(times, 0), atol=1e-7 * extent(plan)
    )


@settings(deadline=None, max_examples=40)
@given(tasks())
def test_an_extra_waypoint_on_the_way_never_lowers_the_snap(task):
    waypoints, durations = task
    middle = 0.5 * (waypoints[0] + waypoints[1])
    more = np.concatenate([waypoints[:1], middle[None], waypoints[1:]])
    split = np.concatenate([[0.5 * durations[0]] * 2, durations[1:]])
    before = snap(Trajectories.stack([minimum_snap(waypoints, durations)]))
    after = snap(Trajectories.stack([minimum_snap(more, split)]))
    assert (after >= before * (1.0 - 1e-6)).all()
