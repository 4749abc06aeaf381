"""The sampler of tasks and its random streams: independent of count and grouping, and the paper's distribution."""

import math
from dataclasses import replace

import numpy as np
import pytest

from lcd_flight.learning.sampling import first_tasks, sample_tasks
from lcd_flight.model import TaskSampler
from lcd_flight.model.streams import Stream

PAPER = TaskSampler(4, (10.0, 10.0, 10.0), (1.0, 3.0), yaw_span_rad=0.85 * math.pi, margin_m=2.0)


def test_a_draw_depends_on_seed_domain_index_and_number_alone():
    stream = Stream(7, "task")
    whole = stream.words(np.arange(100), 8)
    assert np.array_equal(stream.words(np.array([42]), 8)[0], whole[42])
    assert np.array_equal(stream.words(np.arange(100), 3, first=5), whole[:, 5:])
    assert not np.any(whole == Stream(8, "task").words(np.arange(100), 8))
    assert not np.any(whole == Stream(7, "noise").words(np.arange(100), 8))


def test_words_do_not_repeat_across_indices_and_draws():
    words = Stream(0, "task").words(np.arange(20_000), 10)
    assert len(np.unique(words)) == words.size


def test_known_words():
    """A change of the generator would silently change every data set and every development task."""
    assert Stream(0, "task").words(np.array([0, 1]), 1)[:, 0].tolist() == [4927751553582492156, 2632552583609332718]


def test_uniforms_and_normals_have_their_moments():
    uniform = Stream(1, "u").uniforms(np.arange(50_000), 4)
    normal = Stream(1, "n").normals(np.arange(50_000), 4)
    assert uniform.min() > 0.0
    assert uniform.max() < 1.0
    assert np.allclose(uniform.mean(axis=0), 0.5, atol=0.006)
    assert np.allclose(np.cov(normal.T), np.eye(4), atol=0.03)
    assert abs(float((normal**4).mean()) - 3.0) < 0.1


@pytest.mark.parametrize("waypoints", [2, 4, 10])
def test_tasks_keep_the_margin_and_the_distances(waypoints):
    sampler = replace(PAPER, waypoints=waypoints)
    tasks = first_tasks(sampler, seed=3, count=2_000)
    distances = np.linalg.norm(np.diff(tasks.waypoints_m, axis=1), axis=2)
    assert tasks.waypoints_m.shape == (2_000, waypoints, 3)
    assert distances.min() >= 1.0
    assert distances.max() <= 3.0
    assert np.all(tasks.waypoints_m >= [-3.0, -3.0, 2.0])
    assert np.all(tasks.waypoints_m <= [3.0, 3.0, 8.0])
    assert np.abs(tasks.yaws_rad).max() <= sampler.yaw_span_rad


def test_waypoints_are_uniform_in_the_shell():
    """Far from the walls the distance r has density 3 r^2 / (27 - 1): its cube is uniform."""
    roomy = TaskSampler(2, (1000.0, 1000.0, 1000.0), (1.0, 3.0), 0.0)
    tasks = first_tasks(roomy, seed=0, count=40_000)
    step = np.diff(tasks.waypoints_m, axis=1)[:, 0]
    share = (np.linalg.norm(step, axis=1) ** 3 - 1.0) / 26.0
    assert np.allclose(np.histogram(share, 10, (0.0, 1.0))[0] / len(share), 0.1, atol=0.008)
    assert np.allclose((step / np.linalg.norm(step, axis=1)[:, None]).mean(axis=0), 0.0, atol=0.012)


def test_a_task_is_the_same_whatever_the_count_and_the_grouping():
    whole = first_tasks(PAPER, seed=5, count=500)
    some = np.array([499, 3, 3, 250])
    chosen = sample_tasks(PAPER, 5, some)
    assert np.array_equal(chosen.waypoints_m, whole.waypoints_m[some])
    assert np.array_equal(chosen.yaws_rad, whole.yaws_rad[some])
    assert not np.array_equal(first_tasks(PAPER, 6, 1).waypoints_m, whole.waypoints_m[:1])


def test_more_waypoints_go_on_from_the_same_ones():
    longer = replace(PAPER, waypoints=6)
    assert np.array_equal(first_tasks(longer, 5, 50).waypoints_m[:, :4], first_tasks(PAPER, 5, 50).waypoints_m)


def test_waypoints_are_uniform_among_those_allowed():
    """As RotorPy draws them: anywhere in the room, again until the distance from the last one is good."""
    tasks = first_tasks(PAPER, seed=2, count=20_000).waypoints_m - [0.0, 0.0, 5.0]
    before, after = tasks[:, 0], tasks[:, 1]
    anywhere = np.random.default_rng(0).uniform(-3.0, 3.0, (200, *before.shape))
    distance = np.linalg.norm(anywhere - before, axis=2)
    good = (distance >= 1.0) & (distance <= 3.0)
    expected = anywhere[good.argmax(axis=0), np.arange(len(before))]
    for ours, wanted in ((after, expected), (after - before, expected - before)):
        assert np.allclose(
            np.quantile(ours, [0.1, 0.3, 0.5, 0.7, 0.9], axis=0),
            np.quantile(wanted, [0.1, 0.3, 0.5, 0.7, 0.9], axis=0),
            atol=0.1,
        )


def test_training_and_evaluation_never_share_a_task():
    training = sample_tasks(PAPER, 5, np.arange(100), purpose="training")
    assert not np.isin(training.waypoints_m[:, 0], first_tasks(PAPER, 5, 100).waypoints_m[:, 0]).any()


def test_no_yaw_span_means_yaw_zero():
    assert not first_tasks(replace(PAPER, yaw_span_rad=0.0), 1, 10).yaws_rad.any()


def test_an_impossible_sampler_says_so():
    cramped = TaskSampler(3, (0.2, 0.2, 0.2), (1.0, 3.0), 0.0)
    with pytest.raises(ValueError, match=r"no waypoint found 1 to 3 m from the last one in a box"):
        first_tasks(cramped, 0, 2)
