"""Collecting: shards are pure functions of configuration and number, so interruptions leave no trace in the bytes."""

from dataclasses import replace

import numpy as np
import pytest

from lcd_flight.learning import collect as collect_module
from lcd_flight.learning.collect import CollectConfig, Mix, collect, shard, shard_rows
from lcd_flight.learning.rebuild import trajectories
from lcd_flight.learning.rollouts import Source
from lcd_flight.model import InputError, RolloutOptions
from lcd_flight.plugins import simulator
from lcd_flight.worlds import load_world

WORLD = load_world("crazyflie-saturated")
TINY = Mix(search_tasks=3, search_population=4, search_generations=2, random_tasks=10, random_draws=2)
CONFIG = CollectConfig(WORLD, seed=1, drags=(1, 3), mix=TINY)
ROWS = 3 * 4 * 2 + 10 * 3


@pytest.fixture(scope="module")
def sim():
    return simulator("multirotor")


def contents(folder):
    return {p.name: p.read_bytes() for p in sorted(folder.iterdir())}


def test_rows_of_the_shards():
    assert TINY.rows == ROWS
    assert shard_rows(100, 40) == [40, 40, 20]
    assert shard_rows(80, 40) == [40, 40]
    assert Mix().rows == 1 << 16


def test_a_shard_holds_every_source_and_can_be_flown_again(sim):
    made = shard(CONFIG, 2, sim)
    assert len(made) == ROWS
    counts = {source: int((made.plans.source == source).sum()) for source in Source}
    assert counts == {Source.OPTIMUM: 10, Source.RANDOM: 20, Source.SEARCH: 24, Source.POLICY: 0}
    assert set(made.plans.task) == set(range(2 * 13, 3 * 13))
    assert np.array_equal(made.drag, np.array([1, 3])[made.plans.task % 2])
    for drag in (1, 3):
        rows = np.flatnonzero(made.drag == drag)
        plans = trajectories(WORLD, 1, made.plans.take(rows))
        again = sim.rollout(plans, WORLD.vehicle(drag), made.noise_seed[rows], RolloutOptions(loop=WORLD.loop))
        assert np.array_equal(again.max_error_m, made.labels.max_error_m[rows])
        assert np.array_equal(again.segment_max_error_m, made.labels.segment_max_error_m[rows], equal_nan=True)


def test_rows_do_not_share_their_noise(sim):
    made = shard(CONFIG, 0, sim)
    perturbed = made.noise_seed[made.plans.source != Source.SEARCH]
    assert len(np.unique(perturbed)) == len(perturbed)
    assert not np.isin(shard(CONFIG, 1, sim).noise_seed, made.noise_seed).any()


def test_interrupted_and_gone_on_gives_the_same_bytes(sim, tmp_path):
    whole = collect(CONFIG, 130, tmp_path / "whole", sim)
    assert [whole.rows(n) for n in range(3)] == [ROWS, ROWS, 130 - 2 * ROWS]

    class Stop(KeyboardInterrupt):
        pass

    def stop_after_a_shard(_):
        raise Stop

    for _ in range(2):
        with pytest.raises(Stop):
            collect(CONFIG, 130, tmp_path / "pieces", sim, stop_after_a_shard)
    (tmp_path / "pieces" / "shard-00002.partial").write_bytes(b"killed while writing")
    seen = []
    collect(CONFIG, 130, tmp_path / "pieces", sim, seen.append)
    assert contents(tmp_path / "pieces") == contents(tmp_path / "whole")
    assert [(p.done, p.total) for p in seen] == [(130, 130)]


def test_a_smaller_data_set_grows_into_a_larger_one(sim, tmp_path):
    collect(CONFIG, 70, tmp_path / "grown", sim)
    collect(CONFIG, 100, tmp_path / "grown", sim)
    collect(CONFIG, 100, tmp_path / "whole", sim)
    assert contents(tmp_path / "grown") == contents(tmp_path / "whole")


def test_what_is_there_is_not_made_again(sim, tmp_path, monkeypatch):
    collect(CONFIG, 60, tmp_path, sim)
    monkeypatch.setattr(collect_module, "shard", None)
    assert collect(CONFIG, 60, tmp_path, sim).rows(0) == ROWS


def test_another_configuration_or_damage_is_refused_before_any_work(sim, tmp_path):
    collect(CONFIG, 60, tmp_path, sim)
    with pytest.raises(InputError, match=r"another configuration \(seed: 2, there 1\)"):
        collect(replace(CONFIG, seed=2), 60, tmp_path, sim)
    with pytest.raises(InputError, match=r"another configuration \(world\.speed: 2\.0, there 2\.37\)"):
        collect(replace(CONFIG, world=replace(WORLD, speed=2.0)), 60, tmp_path, sim)
    second = tmp_path / "shard-00001.parquet"
    second.write_bytes(second.read_bytes()[:-10])
    with pytest.raises(InputError, match=r"shard-00001\.parquet: damaged"):
        collect(CONFIG, 60, tmp_path, sim)


def test_progress_counts_this_runs_rollouts(sim, tmp_path):
    seen = []
    collect(CONFIG, 120, tmp_path, sim, seen.append)
    assert [p.done for p in seen] == [ROWS, 2 * ROWS, 120]
    assert seen[0].unit == "rollouts"
    assert seen[0].rate > 0.0
    assert seen[-1].seconds_left == 0.0
