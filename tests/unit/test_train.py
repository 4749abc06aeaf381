"""Training from nothing, small: it learns, says so on its card, goes on where it stopped, refuses what does not fit."""

import sys
from dataclasses import replace

import numpy as np
import pytest
import torch

from lcd_flight.learning import train as train_module
from lcd_flight.learning.collect import Mix
from lcd_flight.learning.evaluate import EvaluationOptions, evaluate
from lcd_flight.learning.fit import FitSettings, windows_of
from lcd_flight.learning.policy import PolicyConfig, PolicyMix, collect_policy, policy_rollouts
from lcd_flight.learning.rebuild import trajectories
from lcd_flight.learning.recipes import RECIPES, TrainConfig
from lcd_flight.learning.rollouts import Source
from lcd_flight.learning.sampling import first_tasks
from lcd_flight.learning.train import train
from lcd_flight.learning.training_set import trains
from lcd_flight.model import InputError, RolloutOptions
from lcd_flight.planning.cost.inputs import INPUTS
from lcd_flight.planning.cost.model_file import check_fits, load_model
from lcd_flight.planning.planner import PlannerOptions, plan_batch
from lcd_flight.planning.search import SearchSettings
from lcd_flight.plugins import simulator
from lcd_flight.worlds import fingerprint, load_world

WORLD = load_world("crazyflie-saturated")
TINY = TrainConfig(
    "tiny",
    (WORLD,),
    count=12_000,
    rounds=1,
    policy_tasks=40,
    policy=PolicyMix(block=8, hardest=1, search=SearchSettings(population=8, generations=4)),
    members=2,
    mix=Mix(search=0.4, random=0.45, optimum=0.15, population=8, generations=4, shard_rows=4_000),
    fit=FitSettings(hidden=(32, 16), epochs=12, batch=256),
)


@pytest.fixture(scope="module")
def sim():
    return simulator("multirotor")


@pytest.fixture(scope="module")
def trained(sim, tmp_path_factory):
    folder = tmp_path_factory.mktemp("training")
    seen = []
    train(TINY, folder / "work", folder / "tiny.safetensors", sim, seen.append)
    return folder, seen


def test_it_beats_the_mean_on_tasks_that_it_never_saw(trained):
    figures = load_model(trained[0] / "tiny.safetensors").card.validation
    assert figures["huber"] < 0.6 * figures["huber_of_mean"]
    assert figures["correlation"] > 0.6


def test_what_was_measured_rises_with_what_was_predicted(trained):
    calibration = load_model(trained[0] / "tiny.safetensors").card.calibration
    for source in ("optima", "planned"):
        predicted, low, median, high, count = np.array(calibration[source]).T
        assert (np.diff(predicted) >= 0.0).all()
        assert (low <= median).all()
        assert (median <= high).all()
        assert count.min() >= 10
    predicted, _, median, _, _ = np.array(calibration["optima"]).T
    assert np.corrcoef(predicted, median)[0, 1] > 0.7


def test_the_learning_curve_falls(trained):
    learned, training, held_out = np.array(load_model(trained[0] / "tiny.safetensors").card.learning_curve).T
    assert (np.diff(learned) > 0.0).all()
    assert training[-5:].mean() < 0.7 * training[:2].mean()
    assert held_out[-1] < 0.8 * held_out[0]


def test_the_card_says_what_it_is_good_for(trained):
    model = load_model(trained[0] / "tiny.safetensors")
    card = model.card
    assert card.name == "tiny"
    assert card.worlds == ("crazyflie-saturated v2",)
    assert card.rollouts == 12_000 + 5 * (8 * 6 + 4 * 4)
    assert card.parasitic_drag == WORLD.drag_configurations
    assert {"torch", "lcd-flight"} <= set(card.versions)
    assert model.network.members == 2
    check_fits(model, fingerprint(WORLD.base_vehicle, "paper"), "paper")
    with pytest.raises(InputError, match="flight loop"):
        check_fits(model, fingerprint(WORLD.base_vehicle, "paper"), "flight")


def test_progress_names_every_stage(trained):
    assert {p.unit for p in trained[1]} == {"rollouts", "rollouts loaded", "rollouts learned"}
    assert all(p.done <= p.total for p in trained[1])


def test_it_is_evaluated_like_any_other_method(trained, sim):
    options = EvaluationOptions(seed=3, model=str(trained[0] / "tiny.safetensors"))
    found = evaluate(WORLD, ["minimum-snap", "learned"], 60, sim, options).methods
    assert found["learned"].crash_rate < found["minimum-snap"].crash_rate
    assert found["learned"].tasks == 60


def test_a_network_that_saw_optima_only_leads_astray(sim, tmp_path):
    """The method's lesson at small scale: on raw inputs, trained on minimum snap alone, worse than minimum snap."""
    mixed = replace(TINY, inputs="knots", rounds=0, members=1)
    optima = replace(mixed, mix=replace(TINY.mix, search=0.0, random=0.0, optimum=1.0))
    tasks = first_tasks(WORLD.sampler, 5, 150)
    durations, seeds = tasks.durations_s(WORLD.speed), np.arange(150, dtype=np.uint64)

    def crash_rate(plans):
        return sim.rollout(plans, WORLD.vehicle(3), seeds, RolloutOptions()).crashed.mean()

    rates = {}
    for name, config in (("mixed", mixed), ("optima", optima)):
        path = tmp_path / f"{name}.safetensors"
        train(config, tmp_path / name, path, sim)
        anywhere = np.full(39, 1e9)
        cost = replace(load_model(path), feature_low=-anywhere, feature_high=anywhere)
        result = plan_batch(tasks, durations, cost, PlannerOptions("fixed", 0.03, start="minimum-snap"))
        rates[name] = sim.rollout(result.plans, WORLD.vehicle(3), seeds, RolloutOptions()).crashed.mean()
        rates["minimum snap"] = sim.rollout(
            result.minimum_snap, WORLD.vehicle(3), seeds, RolloutOptions()
        ).crashed.mean()
    assert rates["optima"] > rates["mixed"] + 0.1
    assert rates["optima"] > rates["minimum snap"] + 0.1


def test_a_second_run_does_nothing_and_gives_the_same_file(trained, sim, monkeypatch):
    folder, _ = trained
    monkeypatch.setattr(train_module, "fit", None)
    train(TINY, folder / "work", folder / "again.safetensors", sim)
    assert (folder / "again.safetensors").read_bytes() == (folder / "tiny.safetensors").read_bytes()


def test_a_lost_round_is_trained_again_to_the_same_file(trained, sim):
    folder, _ = trained
    (folder / "work" / "round-1.safetensors").unlink()
    train(TINY, folder / "work", folder / "again.safetensors", sim)
    assert (folder / "again.safetensors").read_bytes() == (folder / "tiny.safetensors").read_bytes()


def test_a_work_folder_of_another_training_is_refused(trained, sim):
    folder, _ = trained
    with pytest.raises(InputError, match=r"round-0\.safetensors: made by another configuration"):
        train(replace(TINY, members=1), folder / "work", folder / "no.safetensors", sim)
    with pytest.raises(InputError, match=r"shard-00000\.parquet: made by another configuration \(seed: 9, there 0\)"):
        train(replace(TINY, seed=9), folder / "work", folder / "no.safetensors", sim)


@pytest.fixture(scope="module")
def policy(trained, sim):
    path = trained[0] / "work" / "round-0.safetensors"
    config = PolicyConfig(TINY.collecting(WORLD), 1, "a hash", 0.1, TINY.policy)
    return config, path, policy_rollouts(config, load_model(path), config.tasks(0, 16), sim)


def test_policy_rows_are_the_plan_and_jitter_around_it(policy):
    config, _, rollouts = policy
    plans = rollouts.plans.take(np.arange(96))
    z, theta = plans.z.reshape(16, 6, -1), plans.theta.reshape(16, 6, -1)
    assert set(plans.source) == {Source.GIVEN}
    assert np.array_equal(plans.task, np.repeat(config.tasks(0, 16), 6))
    assert np.abs(z[:, 0]).max() > 0.05
    assert np.all(np.linalg.norm(z[:, 1:] - z[:, :1], axis=2) > 0.0)
    fixed = ~theta.reshape(16, -1).any(axis=1)
    assert 0 < fixed.sum() < 16
    assert np.all(np.abs(theta[~fixed][:, 1:] - theta[~fixed][:, :1]).max(axis=2) > 0.0)
    assert plans.task.min() > 1 << 32


def test_the_hardest_of_each_block_are_searched_from_their_plans(policy):
    _, path, rollouts = policy
    searched = rollouts.plans.take(np.arange(96, len(rollouts)))
    assert set(searched.source) == {Source.SEARCH}
    hardest = set(searched.task.tolist())
    assert len(hardest) == 2
    assert len(searched) == 2 * 4 * 4
    planned = rollouts.plans.take(np.arange(0, 96, 6))
    flown = trajectories(WORLD, TINY.seed, planned)
    expected = load_model(path).predict_max_error_m(flown.durations_s, flown.coefficients).reshape(2, 8)
    assert {int(planned.task[8 * n + e.argmax()]) for n, e in enumerate(expected)} == hardest
    for task in hardest:
        start, rows = planned.z[planned.task == task][0], searched.z[searched.task == task]
        assert np.array_equal(rows[0], start)
        still = not planned.theta[planned.task == task].any()
        assert still == (not searched.theta[searched.task == task].any())


def test_a_block_does_not_depend_on_those_beside_it(policy, sim, tmp_path):
    config, path, rollouts = policy
    alone = policy_rollouts(config, load_model(path), config.tasks(8, 8), sim)
    assert np.allclose(alone.plans.z[:48], rollouts.plans.z[48:96], atol=1e-5)
    made = collect_policy(config, path, 2, tmp_path, sim)
    assert np.array_equal(made.read(0).plans.z, rollouts.plans.z)


def test_the_split_is_by_task():
    task = np.repeat(np.arange(2_000), 3)
    split = trains(0, task)
    assert np.array_equal(split[0::3], split[2::3])
    assert split.mean() == pytest.approx(0.8, abs=0.03)


@pytest.mark.parametrize("segments", [1, 2, 5])
def test_windows_are_those_of_planning(segments):
    features = np.random.default_rng(0).normal(size=(4, segments, 7)).astype(np.float32)
    assert np.array_equal(windows_of(torch.from_numpy(features)).numpy(), INPUTS["windows"].arrange(features))


def test_one_network_serves_one_vehicle_and_one_loop():
    with pytest.raises(InputError, match="not of one vehicle, one loop"):
        TrainConfig("both", (WORLD, load_world("hummingbird-paper")))
    with pytest.raises(InputError, match="at least one world"):
        TrainConfig("none", ())


def test_the_recipes_are_as_large_as_they_say():
    worlds = (WORLD, load_world("crazyflie-paper"))
    assert RECIPES["small"]("m", worlds).capacity == pytest.approx(1.0e6, rel=0.05)
    assert RECIPES["full"]("m", worlds).capacity == pytest.approx(4.1e6, rel=0.05)


def test_a_missing_extra_is_one_clear_line(monkeypatch, sim, tmp_path):
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(InputError, match=r"this needs torch.*pip install 'lcd-flight\[train\]'"):
        train(TINY, tmp_path, tmp_path / "m.safetensors", sim)
