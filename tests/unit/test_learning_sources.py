"""Training plans and targets: pure functions of (seed, index), over the range they claim."""

from dataclasses import replace

import numpy as np
import pytest

from lcd_flight.learning import sources
from lcd_flight.learning.rebuild import trajectories, variables
from lcd_flight.learning.rollouts import Source
from lcd_flight.learning.sources import optima, random_plans, retimed_plans, training_tasks, turns_short
from lcd_flight.learning.targets import targets, whole_targets
from lcd_flight.model import RolloutLabels
from lcd_flight.planning.minimum_snap import minimum_snap_batch, snap
from lcd_flight.worlds import load_world

WORLD = load_world("crazyflie-saturated")
TASKS = np.arange(4_000)
SHORT = turns_short(0, TASKS)


def test_a_random_plan_depends_on_seed_task_and_draw_alone():
    whole = random_plans(3, np.repeat(TASKS[:50], 4), np.repeat(SHORT[:50], 4), np.tile(np.arange(4), 50), 3)
    one = random_plans(3, np.array([17]), SHORT[17:18], np.array([2]), 3)
    row = 17 * 4 + 2
    assert np.array_equal(one.z[0], whole.z[row])
    assert np.array_equal(one.theta[0], whole.theta[row])
    assert len(np.unique(whole.z[:, 0])) == 200
    assert not np.array_equal(random_plans(4, np.array([17]), SHORT[17:18], np.array([2]), 3).z, one.z)


def test_random_plans_span_the_range_of_relative_snap():
    plans = random_plans(0, TASKS, SHORT, np.zeros_like(TASKS), 3)
    z = plans.z.reshape(-1, 2, 3, 4)
    for axes in (slice(0, 3), slice(3, 4)):
        length = np.log(np.linalg.norm(z[..., axes].reshape(len(z), -1), axis=1))
        low, high = np.log(sources.RELATIVE_SNAP_ROOT)
        share, _ = np.histogram(length, 5, (low - 1e-6, high + 1e-6))
        assert np.allclose(share / len(TASKS), 0.2, atol=0.025)
    retimed = np.any(plans.theta != 0.0, axis=1)
    assert retimed.mean() == pytest.approx(sources.RETIMED_SHARE, abs=0.03)
    assert set(plans.source) == {Source.RANDOM}


def test_stored_plans_are_rebuilt_with_their_relative_snap():
    """At the paper's times |z|^2 over the position axes is the extra snap over the least one."""
    plans = random_plans(0, TASKS[:40], SHORT[:40], np.zeros(40, np.int64), 3)
    still = replace(plans, theta=np.zeros_like(plans.theta))
    space = variables(WORLD, 0, still)
    least, flown = snap(space.minimum)[:, :3].sum(axis=1), snap(trajectories(WORLD, 0, still))[:, :3].sum(axis=1)
    size = (still.z.reshape(-1, 2, 3, 4)[..., :3].astype(float) ** 2).sum(axis=(1, 2, 3))
    assert np.allclose(flown / least - 1.0, size, rtol=1e-6)


def test_optima_are_minimum_snap():
    tasks = training_tasks(WORLD.sampler, 0, TASKS[:10], SHORT[:10])
    wanted = minimum_snap_batch(tasks.poses, tasks.durations_s(WORLD.speed))
    assert np.allclose(
        trajectories(WORLD, 0, optima(TASKS[:10], SHORT[:10], 3)).coefficients, wanted.coefficients, atol=1e-9
    )


def test_times_move_at_equal_total_and_snap_is_least_for_them():
    plans = retimed_plans(0, TASKS[:200], SHORT[:200], np.zeros(200, np.int64), 3)
    flown, paper = trajectories(WORLD, 0, plans), trajectories(WORLD, 0, optima(TASKS[:200], SHORT[:200], 3))
    assert np.allclose(flown.durations_s.sum(axis=1), paper.durations_s.sum(axis=1))
    moved = np.abs(flown.durations_s / paper.durations_s - 1.0).max(axis=1)
    assert moved.min() > 1e-4
    assert moved.max() > 0.3
    poses = training_tasks(WORLD.sampler, 0, TASKS[:200], SHORT[:200]).poses
    assert np.allclose(flown.coefficients, minimum_snap_batch(poses, flown.durations_s).coefficients, atol=1e-6)
    assert set(plans.source) == {Source.TIMES}


def test_rebuilding_does_not_depend_on_the_other_rows():
    task, both_ways = np.array([5, 5, 9, 2]), np.array([False, True, False, True])
    plans = random_plans(0, task, both_ways, np.array([0, 1, 0, 0]), 3)
    alone = trajectories(WORLD, 0, plans.take(np.array([1])))
    assert np.array_equal(trajectories(WORLD, 0, plans).coefficients[1], alone.coefficients[0])


def test_yaw_turns_by_the_short_way_where_asked_for():
    sampled = training_tasks(WORLD.sampler, 1, TASKS, np.zeros(len(TASKS), bool))
    short = training_tasks(WORLD.sampler, 1, TASKS, np.ones(len(TASKS), bool))
    assert np.abs(np.diff(sampled.yaws_rad, axis=1)).max() > 1.5 * np.pi
    assert np.abs(np.diff(short.yaws_rad, axis=1)).max() <= np.pi
    assert np.allclose(np.exp(1j * short.yaws_rad), np.exp(1j * sampled.yaws_rad))
    assert np.array_equal(short.waypoints_m, sampled.waypoints_m)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_a_share_of_the_tasks_turns_short(share):
    assert turns_short(1, TASKS, share).mean() == pytest.approx(share, abs=0.03)
    assert np.array_equal(turns_short(1, TASKS[7:8], share), turns_short(1, TASKS, share)[7:8])


def labels(segments, yaw_cost=0.0):
    segments = np.array(segments, dtype=float)
    n = len(segments)
    zero = np.zeros(n)
    worst = np.nanmax(segments, axis=1)
    return RolloutLabels(
        worst, zero, zero, zero, zero, segments, np.zeros((n, 4)), zero + yaw_cost, zero, zero, zero, zero, zero == 0.0
    )


def test_targets_by_hand():
    found = targets(labels([[0.1, 0.2, 0.4], [1e-6, 0.5, 9.0]], yaw_cost=0.0))
    assert np.allclose(np.exp(found.row), [[0.1, 0.2, 0.4], [0.01, 0.5, 5.0]])
    assert np.allclose(np.exp(found.rollout), [0.4, 5.0])
    assert found.kept.all()
    assert np.allclose(np.exp(targets(labels([[0.3]], yaw_cost=1.6)).row), 0.5)


def test_what_follows_a_lost_segment_is_left_out():
    found = targets(labels([[0.1, 2.5, 0.3], [2.5, 0.3, 0.3], [1.9, 1.9, 3.0], [0.1, 3.0, np.nan]]))
    assert found.kept.tolist() == [
        [True, True, False],
        [True, False, False],
        [True, True, True],
        [True, True, False],
    ]
    assert np.isfinite(found.row).all()


def test_targets_of_whole_trajectories_leave_nothing_out():
    flown = replace(labels([[0.1, 2.5, 0.3], [0.1, 3.0, np.nan]]), released_cost=np.array([np.e, 0.0]))
    assert np.allclose(np.exp(whole_targets(flown, "error").row), [[2.5], [3.0]])
    released = whole_targets(flown, "released")
    assert np.allclose(released.row, [[1.0], [np.log(1e-6)]])
    assert released.kept.all()
    assert np.array_equal(released.rollout, released.row[:, 0])
