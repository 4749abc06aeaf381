"""Time allocation, headings by the short way, re-timing at equal total time and its pullback."""

import math

import numpy as np
import pytest

from lcd_flight.model import InputError
from lcd_flight.planning.times import allocate, retime, retime_pullback, shortest_yaw


def test_durations_are_distance_over_speed():
    waypoints = np.array([[0.0, 0.0, 1.0, 0.0], [3.0, 4.0, 1.0, 2.0], [3.0, 4.0, 2.0, 0.0]])
    np.testing.assert_allclose(allocate(waypoints, 2.0), [2.5, 0.5])
    np.testing.assert_allclose(allocate(np.stack([waypoints, 2 * waypoints]), 2.0), [[2.5, 0.5], [5.0, 1.0]])


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan, math.inf])
def test_a_speed_that_is_none_is_refused(speed):
    with pytest.raises(InputError, match=r"speed is .* m/s"):
        allocate(np.eye(3), speed)


def test_two_waypoints_at_one_place_have_no_duration():
    with pytest.raises(InputError, match="waypoint 2 and the next share a position"):
        allocate(np.array([[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 1.0, 0.0], [1.0, 0.0, 1.0, 2.0]]), 1.0)
    with pytest.raises(InputError, match="share a position"):
        allocate(np.array([[0.0, 0.0, 1.0], [math.nan, 0.0, 1.0]]), 1.0)


def test_yaw_takes_the_short_way_with_any_leading_shape():
    yaws = np.array([[[0.0, 3.0, -3.0, 0.5]], [[1.0, 1.0 + math.pi / 2, -2.0, 9.0]]])
    short = shortest_yaw(yaws)
    np.testing.assert_allclose(np.exp(1j * short), np.exp(1j * yaws), atol=1e-12)
    assert (np.abs(np.diff(short)) <= math.pi + 1e-12).all()
    np.testing.assert_array_equal(short[..., 0], yaws[..., 0])


def test_re_timing_keeps_the_total_and_zero_changes_nothing():
    durations = np.array([[1.0, 2.0, 0.5], [0.3, 0.3, 3.0]])
    np.testing.assert_allclose(retime(durations, np.zeros((2, 3))), durations, rtol=1e-15)
    moved = retime(durations, np.array([[0.5, -0.5, 9.0], [0.1, 0.0, 0.0]]))
    np.testing.assert_allclose(moved.sum(axis=1), durations.sum(axis=1), rtol=1e-14)
    stretch = np.exp(0.7 * np.tanh(np.array([0.5, -0.5, 9.0]) / 0.7))
    np.testing.assert_allclose(moved[0] / moved[0, 0], durations[0] * stretch / stretch[0], rtol=1e-14)


def test_all_segments_alike_is_no_change():
    durations = np.array([1.0, 2.0, 0.5])
    np.testing.assert_allclose(retime(durations, np.full(3, 0.8)), durations, rtol=1e-14)


def test_the_pullback_agrees_with_finite_differences():
    rng = np.random.default_rng(0)
    durations, theta, gradient = rng.uniform(0.5, 2.0, (4, 5)), rng.normal(size=(4, 5)), rng.normal(size=(4, 5))
    exact = retime_pullback(retime(durations, theta), theta, gradient)
    for _ in range(5):
        step = 1e-6 * rng.normal(size=theta.shape)
        change = (gradient * (retime(durations, theta + step) - retime(durations, theta - step))).sum(axis=1) / 2
        np.testing.assert_allclose((exact * step).sum(axis=1), change, rtol=1e-6)
