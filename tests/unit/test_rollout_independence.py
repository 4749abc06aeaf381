"""A row of a batch depends on that row alone: not on its place, its neighbours, the batch's size or the threads."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from simulator_plans import minimum_snap_plans, seeds

from lcd_flight.model import Loop, RolloutLabels, RolloutOptions, Trajectories
from lcd_flight.worlds import load_vehicle
from sim_bridge.kernels.rows import LANES
from sim_bridge.rollouts import MultirotorSimulator

CRAZYFLIE = load_vehicle("crazyflie")
SIMULATOR = MultirotorSimulator()
COUNT = 5 * LANES + 7


def same(a: RolloutLabels, b: RolloutLabels) -> bool:
    """To the bit."""
    return all(
        np.array_equal(getattr(a, f.name), getattr(b, f.name), equal_nan=f.name not in ("valid",))
        for f in fields(RolloutLabels)
    )


def rows_of(labels: RolloutLabels, indices: np.ndarray | slice) -> RolloutLabels:
    return RolloutLabels(*(getattr(labels, f.name)[indices] for f in fields(RolloutLabels)))


@pytest.fixture(scope="module", params=["paper", "flight"])
def batch(request: pytest.FixtureRequest) -> tuple[Loop, Trajectories, RolloutLabels]:
    """A batch that does not fill its last block, with crashes in it, on one thread."""
    plans = minimum_snap_plans(COUNT, 2.3, seed=11)
    labels = SIMULATOR.rollout(plans, CRAZYFLIE, seeds(COUNT), RolloutOptions(loop=request.param, threads=1))
    assert 0.05 < labels.crashed.mean() < 0.95
    return request.param, plans, labels


def test_threads_do_not_matter(batch) -> None:
    loop, plans, labels = batch
    for threads in (0, 2, 3, 7):
        assert same(
            SIMULATOR.rollout(plans, CRAZYFLIE, seeds(COUNT), RolloutOptions(loop=loop, threads=threads)), labels
        )


@pytest.mark.parametrize("index", [0, 17, LANES - 1, LANES, COUNT - 1])
def test_a_row_alone_is_the_row_in_the_batch(batch, index: int) -> None:
    loop, plans, labels = batch
    alone = SIMULATOR.rollout(plans.take([index]), CRAZYFLIE, seeds(1, index), RolloutOptions(loop=loop))
    assert same(alone, rows_of(labels, np.array([index])))


def test_order_and_neighbours_do_not_matter(batch) -> None:
    loop, plans, labels = batch
    chosen = np.random.default_rng(0).permutation(COUNT)[: COUNT // 2]
    mixed = SIMULATOR.rollout(plans.take(chosen), CRAZYFLIE, seeds(COUNT)[chosen], RolloutOptions(loop=loop))
    assert same(mixed, rows_of(labels, chosen))


def test_other_seeds_are_other_flights(batch) -> None:
    loop, plans, labels = batch
    others = SIMULATOR.rollout(plans, CRAZYFLIE, seeds(COUNT, 1000), RolloutOptions(loop=loop))
    assert (others.rms_error_m != labels.rms_error_m).all()


def test_without_noise_seeds_do_not_matter() -> None:
    still = replace(CRAZYFLIE, motor_noise=0.0)
    plans = minimum_snap_plans(3, 1.5, seed=12)
    first, second = (SIMULATOR.rollout(plans, still, seeds(3, s), RolloutOptions()) for s in (0, 50))
    assert same(first, second)


def test_any_number_of_segments() -> None:
    for waypoints in (2, 3, 12):
        plans = minimum_snap_plans(2, 1.2, seed=13, waypoints=waypoints)
        labels = SIMULATOR.rollout(plans, CRAZYFLIE, seeds(2), RolloutOptions())
        assert labels.segment_max_error_m.shape == (2, waypoints - 1)
        assert labels.waypoint_error_m.shape == (2, waypoints)
        assert np.nanmax(labels.segment_max_error_m, axis=1) == pytest.approx(labels.max_error_m)


def test_an_empty_batch_is_an_empty_answer() -> None:
    labels = SIMULATOR.rollout(minimum_snap_plans(2, 1.0).take(np.arange(0)), CRAZYFLIE, seeds(0), RolloutOptions())
    assert len(labels) == 0


def test_a_row_that_diverges_does_not_touch_its_neighbours() -> None:
    """One plan beyond all reach among good ones: it ends early, they do not notice."""
    good = minimum_snap_plans(LANES, 1.2, seed=14)
    bad = Trajectories(good.durations_s.copy(), good.coefficients.copy())
    bad.coefficients[5, :3] *= 1e6
    alone = SIMULATOR.rollout(good, CRAZYFLIE, seeds(LANES), RolloutOptions())
    beside = SIMULATOR.rollout(bad, CRAZYFLIE, seeds(LANES), RolloutOptions())
    others = np.arange(LANES) != 5
    assert beside.crashed[5]
    assert same(rows_of(beside, others), rows_of(alone, others))


def test_the_controller_coasts_through_a_gap_in_the_pose() -> None:
    """A short gap costs a little, a long one a lot; none at all is no gap."""
    plans, count = minimum_snap_plans(40, 1.5, seed=15), 40
    for loop in ("paper", "flight"):
        errors = []
        for length in (0, 3, 50):
            gaps = np.tile([110.0, float(length)], (count, 1))
            options = RolloutOptions(loop=loop, pose_gap_ticks=gaps)
            errors.append(SIMULATOR.rollout(plans, CRAZYFLIE, seeds(count), options))
        assert same(errors[0], SIMULATOR.rollout(plans, CRAZYFLIE, seeds(count), RolloutOptions(loop=loop)))
        assert (errors[0].rms_error_m != errors[1].rms_error_m).all()
        means = [float(e.rms_error_m.mean()) for e in errors]
        assert means[1] < 1.1 * means[0]
        assert means[2] > 1.5 * means[0]


def test_a_controller_that_believes_in_more_thrust_than_there_is_flies_lower() -> None:
    plans, tired = minimum_snap_plans(20, 1.2, seed=16), CRAZYFLIE.weaker(0.9)
    for loop in ("paper", "flight"):
        informed = SIMULATOR.rollout(plans, tired, seeds(20), RolloutOptions(loop=loop))
        misled = SIMULATOR.rollout(plans, tired, seeds(20), RolloutOptions(loop=loop, nominal=CRAZYFLIE))
        assert np.median(misled.rms_error_m) > np.median(informed.rms_error_m)


def test_kernels_are_made_of_the_sources_that_key_their_cache() -> None:
    """Every plain function that a kernel can reach stands in a file whose change recompiles it."""
    import types
    from pathlib import Path

    from sim_bridge.compiled import SOURCES
    from sim_bridge.kernels import plant, rollout

    keyed = {path for source in SOURCES for path in (source.rglob("*.py") if source.is_dir() else [source])}
    pending, seen = [rollout.fly, plant.fly_periods], set()
    while pending:
        function = pending.pop()
        seen.add(function)
        assert Path(function.__code__.co_filename) in keyed, function
        named = (function.__globals__.get(name) for name in function.__code__.co_names)
        pending += [f for f in named if isinstance(f, types.FunctionType) and f not in seen]
    assert len(seen) > 50
