"""The search, on a simulator that is a formula: it finds, it is reproducible, it hands out what it flew."""

import math

import numpy as np
import pytest

from lcd_flight.model import RolloutLabels, RolloutOptions
from lcd_flight.planning.cost.proxy import ThrustProxy
from lcd_flight.planning.knots import Whitening
from lcd_flight.planning.search import Arena, SearchSettings, search, tracking_cost

SHORT = SearchSettings(population=20, generations=8)


def labels(p8_error, valid=None):
    count = len(p8_error)
    zeros = np.zeros(count)
    return RolloutLabels(
        max_error_m=p8_error,
        max_error_time_s=zeros,
        mean_error_m=zeros,
        rms_error_m=zeros,
        p8_error_m=p8_error,
        segment_max_error_m=np.zeros((count, 1)),
        waypoint_error_m=np.zeros((count, 2)),
        yaw_cost=zeros,
        paper_cost=zeros,
        released_cost=zeros,
        saturation_share=zeros,
        longest_saturation_s=zeros,
        valid=np.ones(count, bool) if valid is None else valid,
    )


class Formula:
    """A "simulator" whose error is the analytic cost, times what the noise adds."""

    def __init__(self, noise=0.0):
        self.noise, self.seeds, self.rows = noise, [], 0

    def rollout(self, plans, vehicle, seeds, options):
        self.seeds.append(seeds)
        self.rows += len(plans)
        cost, _, _ = ThrustProxy().value_and_gradient(plans.durations_s, plans.coefficients)
        luck = (seeds >> np.uint64(40)).astype(float) / 2.0**24
        return labels(np.exp(cost) * (1.0 + self.noise * luck))


def problem(count=4, segments=3):
    rng = np.random.default_rng(0)
    waypoints = np.cumsum(rng.uniform(-2.0, 2.0, (count, segments + 1, 4)), axis=1)
    whitening = Whitening.of(waypoints, rng.uniform(0.8, 1.2, (count, segments)))
    return whitening, np.zeros(whitening.z_shape), np.zeros(whitening.durations_s.shape)


def run(rows, simulator=None, settings=SHORT, seed=5, watch=None):
    whitening, z, theta = problem()
    arena = Arena(simulator or Formula(noise=0.2), None, RolloutOptions())
    rows = np.asarray(rows)
    return search(
        whitening.take(rows), z[rows], theta[rows], arena, seed=seed, tasks=100 + rows, settings=settings, watch=watch
    )


def test_it_finds_better_plans_and_says_their_cost():
    simulator, seen = Formula(), []
    found = run([0, 1, 2, 3], simulator, watch=seen.append)
    assert simulator.rows == 4 * 20 * 8
    start = seen[0].costs[:, 0]
    assert (found.cost < start - 0.02).all()
    whitening, _, _ = problem()
    plans = whitening.plan(found.z, found.theta)
    flown = Formula().rollout(plans, None, np.zeros(4, np.uint64), None)
    np.testing.assert_allclose(tracking_cost(flown), found.cost, rtol=1e-12)


def test_later_generations_are_better_than_earlier_ones():
    seen = []
    run([0, 1, 2, 3], Formula(), watch=seen.append)
    medians = [np.median(g.costs) for g in seen]
    assert medians[-1] < medians[0] - 0.05


def test_the_start_is_flown_first_and_never_lost():
    whitening, z, theta = problem()
    liked_start = whitening.plan(z, theta)

    class LikesTheStart:
        def rollout(self, plans, vehicle, seeds, options):
            away = plans.coefficients - np.repeat(liked_start.coefficients, len(plans) // 4, axis=0)
            return labels(0.01 + np.abs(away).mean(axis=(1, 2, 3)))

    found = run([0, 1, 2, 3], LikesTheStart())
    np.testing.assert_array_equal(found.z, 0.0)
    np.testing.assert_array_equal(found.theta, 0.0)
    np.testing.assert_allclose(found.cost, math.log(0.01), rtol=1e-6)


def test_a_task_does_not_depend_on_the_tasks_beside_it():
    together, apart = run([0, 1, 2, 3]), [run([2]), run([3, 0])]
    for alone, rows in ((apart[0], [2]), (apart[1], [3, 0])):
        np.testing.assert_array_equal(alone.z, together.z[rows])
        np.testing.assert_array_equal(alone.theta, together.theta[rows])
        np.testing.assert_array_equal(alone.cost, together.cost[rows])


def test_the_seed_decides():
    np.testing.assert_array_equal(run([0]).z, run([0]).z)
    assert (run([0]).z != run([0], seed=6).z).any()


def test_noise_is_common_within_a_population_and_new_in_each():
    simulator = Formula()
    run([0, 1], simulator)
    seeds = np.array(simulator.seeds).reshape(8, 2, 20)
    assert (seeds == seeds[:, :, :1]).all()
    assert len(np.unique(seeds)) == 16


def test_every_sample_is_handed_out_as_it_was_flown():
    seen = []
    run([0, 1, 2, 3], watch=seen.append)
    assert [g.number for g in seen] == list(range(8))
    whitening, _, _ = problem()
    last = seen[-1]
    assert last.z.shape == (4, 20, 2, 3, 4)
    crowd = whitening.take(np.repeat(np.arange(4), 20))
    kept_z, kept_theta = last.z.astype(np.float32), last.theta.astype(np.float32)
    rebuilt = crowd.plan(kept_z.reshape(crowd.z_shape), kept_theta.reshape(80, 3))
    np.testing.assert_array_equal(rebuilt.coefficients, last.plans.coefficients)
    np.testing.assert_array_equal(tracking_cost(last.labels).reshape(4, 20), last.costs)


def test_without_spread_in_time_the_durations_stay():
    settings, seen = SearchSettings(population=10, generations=3, theta_sd=0.0), []
    found = run([0, 1], settings=settings, watch=seen.append)
    assert (found.theta == 0.0).all()
    assert all((g.theta == 0.0).all() for g in seen)


def test_what_leaves_the_model_is_the_worst():
    error, valid = np.array([0.1, 0.1, 7.0]), np.array([True, False, False])
    np.testing.assert_allclose(tracking_cost(labels(error, valid)), np.log([0.1, 5.0, 7.0]))


def test_an_interrupt_from_the_watcher_ends_it():
    def stop(generation):
        if generation.number == 2:
            raise KeyboardInterrupt

    simulator = Formula()
    with pytest.raises(KeyboardInterrupt):
        run([0], simulator, watch=stop)
    assert simulator.rows == 3 * 20
