"""Collecting: data are a function of the configuration, so cores and interruptions leave no trace in the bytes."""

from dataclasses import replace

import numpy as np
import pytest

from lcd_flight.learning.collect import CollectConfig, Mix, collect, fill
from lcd_flight.learning.dataset import Dataset
from lcd_flight.learning.fingerprint import described, origin
from lcd_flight.learning.given import GivenPlans, load_plans
from lcd_flight.learning.progress import Meter, ignore
from lcd_flight.learning.rebuild import trajectories
from lcd_flight.learning.rollouts import Source
from lcd_flight.learning.shard import ShardJob, ShardMaker
from lcd_flight.learning.spread import in_threads, in_turn
from lcd_flight.model import InputError, RolloutOptions
from lcd_flight.plugins import simulator
from lcd_flight.worlds import load_world

WORLD = load_world("crazyflie-saturated")
TINY = Mix(search=0.4, random=0.2, optimum=0.1, times=0.3, population=4, generations=2, draws=2, shard_rows=60)
CONFIG = CollectConfig(WORLD, seed=1, drags=(1, 3), mix=TINY)
ROWS = TINY.rows


@pytest.fixture(scope="module")
def sim():
    return simulator("multirotor")


def contents(folder):
    return {p.name: p.read_bytes() for p in sorted(folder.iterdir())}


def test_a_shard_holds_every_source_and_can_be_flown_again(sim):
    made = ShardMaker(CONFIG, sim)(ShardJob(2, ROWS))
    assert len(made) == ROWS
    counts = {source: int((made.plans.source == source).sum()) for source in Source}
    assert counts == {Source.OPTIMUM: 6, Source.RANDOM: 12, Source.SEARCH: 24, Source.GIVEN: 0, Source.TIMES: 18}
    assert set(made.plans.task) == set(range(2 * TINY.tasks, 3 * TINY.tasks))
    assert np.array_equal(made.drag, np.array([1, 3])[made.plans.task % 2])
    for drag in (1, 3):
        rows = np.flatnonzero(made.drag == drag)
        plans = trajectories(WORLD, 1, made.plans.take(rows))
        again = sim.rollout(plans, WORLD.vehicle(drag), made.noise_seed[rows], RolloutOptions(loop=WORLD.loop))
        assert np.array_equal(again.max_error_m, made.labels.max_error_m[rows])
        assert np.array_equal(again.segment_max_error_m, made.labels.segment_max_error_m[rows], equal_nan=True)


def test_rows_of_a_task_stand_together(sim):
    task = ShardMaker(CONFIG, sim)(ShardJob(0, ROWS)).plans.task
    assert np.array_equal(task, np.sort(task))


def test_rows_do_not_share_their_noise_but_in_a_search(sim):
    made, other = (ShardMaker(CONFIG, sim)(ShardJob(number, ROWS)) for number in (0, 1))
    perturbed = made.noise_seed[made.plans.source != Source.SEARCH]
    assert len(np.unique(perturbed)) == len(perturbed)
    assert len(np.unique(made.noise_seed)) == len(perturbed) + 3 * 2
    assert not np.isin(other.noise_seed, made.noise_seed).any()


def test_less_than_a_shard_is_its_beginning_and_flies_no_more(sim, tmp_path):
    flown = []

    class Counting:
        def rollout(self, plans, vehicle, seeds, options):
            flown.append(len(plans))
            return sim.rollout(plans, vehicle, seeds, options)

    few = collect(CONFIG, 9, tmp_path, Counting()).read(0)
    assert len(few) == 9
    assert sum(flown) < 9 + 8
    whole = ShardMaker(CONFIG, sim)(ShardJob(0, ROWS))
    assert np.array_equal(few.plans.z, whole.plans.z[:9])
    assert np.array_equal(few.labels.paper_cost.astype(np.float32), whole.labels.paper_cost[:9].astype(np.float32))


@pytest.mark.parametrize("spread", [in_turn, in_threads(1), in_threads(2), in_threads(5)])
def test_the_number_of_threads_leaves_no_trace(sim, tmp_path, spread):
    collect(CONFIG, 130, tmp_path / "one", sim, spread=in_threads(1))
    collect(CONFIG, 130, tmp_path / "other", sim, spread=spread)
    assert contents(tmp_path / "one") == contents(tmp_path / "other")


def test_interrupted_and_gone_on_gives_the_same_bytes(sim, tmp_path):
    whole = collect(CONFIG, 130, tmp_path / "whole", sim)
    assert [whole.rows(n) for n in range(3)] == [ROWS, ROWS, 130 - 2 * ROWS]

    def stop_after_a_shard(progress):
        if progress.rate:
            raise KeyboardInterrupt

    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            collect(CONFIG, 130, tmp_path / "pieces", sim, stop_after_a_shard)
    (tmp_path / "pieces" / ".shard-00002.parquet.partial").write_bytes(b"killed while writing")
    seen = []
    collect(CONFIG, 130, tmp_path / "pieces", sim, seen.append)
    assert contents(tmp_path / "pieces") == contents(tmp_path / "whole")
    assert [(p.done, p.total) for p in seen] == [(130, 130)]


def test_a_smaller_data_set_grows_into_a_larger_one(sim, tmp_path):
    collect(CONFIG, 70, tmp_path / "grown", sim)
    collect(CONFIG, 100, tmp_path / "grown", sim)
    collect(CONFIG, 100, tmp_path / "whole", sim)
    assert contents(tmp_path / "grown") == contents(tmp_path / "whole")


class NoSimulator:
    def rollout(self, *_):
        raise AssertionError("nothing is to be flown")


def test_what_is_there_is_not_made_again(sim, tmp_path):
    collect(CONFIG, 60, tmp_path, sim)
    before = contents(tmp_path)
    assert collect(CONFIG, 30, tmp_path, NoSimulator()).rows(0) == ROWS
    assert contents(tmp_path) == before


def test_another_configuration_or_damage_is_refused_before_any_work(sim, tmp_path):
    collect(CONFIG, 70, tmp_path, sim)
    with pytest.raises(InputError, match=r"another configuration \(seed: 2, there 1\)"):
        collect(replace(CONFIG, seed=2), 60, tmp_path, NoSimulator())
    with pytest.raises(InputError, match=r"another configuration \(world\.speed: 2\.0, there 2\.37\)"):
        collect(replace(CONFIG, world=replace(WORLD, speed=2.0)), 60, tmp_path, NoSimulator())
    with pytest.raises(InputError, match=r"another configuration \(mix\.population: 8, there 4"):
        collect(replace(CONFIG, mix=replace(TINY, population=8)), 60, tmp_path, NoSimulator())
    with pytest.raises(InputError, match=r"another configuration \(world\.loop: flight, there paper\)"):
        collect(replace(CONFIG, world=replace(WORLD, loop="flight")), 60, tmp_path, NoSimulator())
    second = tmp_path / "shard-00001.parquet"
    second.write_bytes(second.read_bytes()[:-10])
    with pytest.raises(InputError, match=r"shard-00001\.parquet: damaged"):
        collect(CONFIG, 70, tmp_path, NoSimulator())
    with pytest.raises(InputError, match=r"shard-00001\.parquet: damaged"):
        collect(CONFIG, 20, tmp_path, NoSimulator())


def test_progress_counts_this_runs_rollouts(sim, tmp_path):
    seen = []
    collect(CONFIG, 130, tmp_path, sim, seen.append)
    assert [p.done for p in seen] == [ROWS, 2 * ROWS, 130]
    assert [p.note for p in seen] == ["shard 1 of 3", "shard 2 of 3", "shard 3 of 3"]
    assert seen[0].unit == "rollouts"
    assert seen[0].rate > 0.0
    assert seen[-1].seconds_left == 0.0


def test_given_plans_are_flown_in_turn_with_jitter_around_them(sim, tmp_path):
    z = np.random.default_rng(0).normal(scale=0.2, size=(3, 24))
    np.savez(tmp_path / "plans.npz", task=[7, 8, 9], z=z, theta=np.zeros((3, 3)))
    given = load_plans(tmp_path / "plans.npz", WORLD.sampler, 1, 0.5)
    mix = Mix(search=0.0, random=0.2, optimum=0.0, plans=0.8, draws=2, jitters=4, shard_rows=20)
    config = replace(CONFIG, mix=mix, plans_sha256=given.sha256)
    dataset = collect(config, 40, tmp_path / "data", sim, given=given)
    plans = [dataset.read(number).plans for number in (0, 1)]
    rows = [p.take(np.flatnonzero(p.source == Source.GIVEN)) for p in plans]
    assert np.concatenate([p.task for p in rows])[::4].tolist() == [7, 8, 9, 7, 8, 9, 7, 8]
    assert np.array_equal(rows[0].z[::4][:3], z.astype(np.float32))
    assert not np.array_equal(rows[0].z[1], rows[0].z[13])
    with pytest.raises(InputError, match="go together"):
        ShardMaker(config, sim)
    with pytest.raises(InputError, match="go together"):
        ShardMaker(CONFIG, sim, given)
    with pytest.raises(InputError, match="not those of the configuration"):
        ShardMaker(config, sim, GivenPlans(given.plans, "another"))


def test_tasks_of_any_number_of_waypoints_in_both_loops(sim, tmp_path):
    for waypoints, loop in ((3, "paper"), (7, "flight")):
        world = replace(WORLD, loop=loop, sampler=replace(WORLD.sampler, waypoints=waypoints))
        made = collect(replace(CONFIG, world=world), 20, tmp_path / loop, sim).read(0)
        assert made.plans.z.shape == (20, 12 * (waypoints - 2))
        assert np.isfinite(made.labels.paper_cost).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"drags": (1, 6)}, r"configurations 1 to 5"),
        ({"drags": ()}, r"configurations 1 to 5"),
        ({"short_yaw_share": 1.5}, r"short yaw: 1\.5 of the tasks is no share"),
        ({"world": replace(WORLD, sampler=replace(WORLD.sampler, waypoints=2))}, r"at least 3 waypoints"),
    ],
)
def test_what_is_no_configuration(change, message):
    with pytest.raises(InputError, match=message):
        replace(CONFIG, **change)


def test_shards_flown_by_other_versions_are_refused(sim, tmp_path):
    def elsewhere(work, parts):
        for part in parts:
            made = work(part)
            there = {**origin(), "versions": {**origin()["versions"], "numba": "0.1"}}
            yield part, replace(made, flown_by=there)

    dataset = Dataset(tmp_path, described(CONFIG))
    with pytest.raises(InputError, match=r"other versions \(numba: .*there 0\.1\)"):
        fill(dataset, [ShardJob(0, 5)], ShardMaker(CONFIG, sim), elsewhere, Meter(ignore, 5, "rollouts"))
    assert not dataset.numbers()
