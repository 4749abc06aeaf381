"""Evaluation against rates worked out by hand, with a simulator whose every answer is known."""

import json
from dataclasses import replace

import numpy as np
import pytest
from known_simulator import KnownSimulator, tasks_with_errors

from lcd_flight.learning import methods
from lcd_flight.learning.evaluate import evaluate, problem_of, refusals
from lcd_flight.learning.evaluation import Evaluation, EvaluationOptions
from lcd_flight.learning.methods import Planned, Problem
from lcd_flight.learning.sampling import first_tasks
from lcd_flight.model import InputError, Tasks, TaskSampler, World
from lcd_flight.model.streams import Stream
from lcd_flight.planning.minimum_snap import minimum_snap_batch
from lcd_flight.worlds import load_world

WORLD: World = load_world("crazyflie-saturated")


def test_rates_and_errors_by_hand():
    """4 of 10 tasks above 1.5 m: 40 %, standard error 100 sqrt(0.24 / 9); the rollouts of a task count once."""
    errors = [0.1, 0.2, 0.3, 0.4, 0.5, 1.5, 1.6, 1.7, 1.8, 9.0]
    figures = evaluate(WORLD, ["minimum-snap"], tasks_with_errors(errors), KnownSimulator()).methods["minimum-snap"]
    assert figures.crash_rate == pytest.approx(40.0)
    assert figures.crash_rate_error == pytest.approx(100.0 * np.sqrt(0.24 / 9.0))
    assert figures.tasks == 10
    assert figures.noise_seeds == 3
    assert figures.median_max_error_m == pytest.approx(1.0)
    assert figures.largest_max_error_m == pytest.approx(9.0)
    assert figures.median_waypoint_error_m == pytest.approx(0.5)
    assert figures.median_relative_snap == pytest.approx(1.0)
    assert figures.saturation_share == pytest.approx(0.25)
    assert figures.fell_back == 0


def test_a_rollout_that_left_the_models_validity_is_a_crash():
    run = evaluate(WORLD, ["minimum-snap"], tasks_with_errors([0.1, 0.2, 0.3, 0.4]), KnownSimulator(broken_from=0.25))
    assert run.methods["minimum-snap"].crash_rate == pytest.approx(50.0)
    assert run.runs["minimum-snap"].crashed.tolist() == [[[False] * 3]] * 2 + [[[True] * 3]] * 2


def test_one_task_has_no_standard_error():
    figures = evaluate(WORLD, ["minimum-snap"], tasks_with_errors([0.1]), KnownSimulator()).methods["minimum-snap"]
    assert figures.crash_rate_error is None


@pytest.fixture
def stiff(monkeypatch):
    """A second method: minimum snap in twice the time, which falls back on every odd task."""

    def plan(problem: Problem) -> Planned:
        plans = minimum_snap_batch(problem.tasks.poses, 2.0 * problem.durations_s)
        return Planned(plans, problem.indices % 2 == 1)

    monkeypatch.setitem(methods.METHODS, "stiff", plan)


def test_methods_share_tasks_and_noise_whatever_the_chunks(stiff, monkeypatch):
    simulator = KnownSimulator()
    run = evaluate(WORLD, ["minimum-snap", "stiff"], 7, simulator, EvaluationOptions(seed=4))
    (plans, vehicle, seeds, options), (_, _, other_seeds, _) = simulator.calls
    assert np.array_equal(seeds, other_seeds)
    assert len(np.unique(seeds)) == 21
    assert vehicle == WORLD.vehicle(3)
    assert options.loop == WORLD.loop
    assert options.start_aligned == WORLD.start_aligned
    assert np.allclose(plans.coefficients[::3, :3, 0, 0], first_tasks(WORLD.sampler, 4, 7).waypoints_m[:, 0])
    assert run.methods["stiff"].fell_back == 3
    assert run.methods["stiff"].median_relative_snap == pytest.approx(2.0**-7)

    monkeypatch.setattr("lcd_flight.learning.evaluate._CHUNK", 2)
    again = KnownSimulator()
    pieces = evaluate(WORLD, ["minimum-snap", "stiff"], 7, again, EvaluationOptions(seed=4))
    assert np.array_equal(again.calls[0][2], seeds)
    assert np.array_equal(pieces.runs["stiff"].max_error_m, run.runs["stiff"].max_error_m)
    assert np.array_equal(pieces.runs["stiff"].fell_back, run.runs["stiff"].fell_back)


def test_drags_and_the_number_of_noise_seeds_are_options():
    simulator = KnownSimulator()
    options = EvaluationOptions(drags=(5, 2), noise_seeds=2)
    run = evaluate(WORLD, ["minimum-snap"], tasks_with_errors([0.1, 1.6, 1.7]), simulator, options)
    assert [call[1] for call in simulator.calls] == [WORLD.vehicle(5), WORLD.vehicle(2)]
    assert np.array_equal(simulator.calls[0][2], simulator.calls[1][2])
    assert run.runs["minimum-snap"].crashed.shape == (3, 2, 2)
    assert run.methods["minimum-snap"] == run.at(2)["minimum-snap"]
    with pytest.raises(ValueError, match="not in tuple"):
        run.at(3)


def test_tasks_are_the_clusters_not_flights():
    """The same tasks in five drag configurations are no more evidence than in one, if all fly alike."""
    tasks = tasks_with_errors([0.1, 0.2, 1.6, 1.7])
    one, five = (
        evaluate(WORLD, ["minimum-snap"], tasks, KnownSimulator(), EvaluationOptions(drags=drags)).methods
        for drags in ((3,), (1, 2, 3, 4, 5))
    )
    assert one["minimum-snap"].crash_rate_error == pytest.approx(five["minimum-snap"].crash_rate_error)
    assert one["minimum-snap"].crash_rate_low == pytest.approx(five["minimum-snap"].crash_rate_low)


def test_a_weaker_vehicle_is_flown_but_not_planned_for(monkeypatch):
    seen = []

    def plan(problem: Problem) -> Planned:
        seen.append(problem.vehicle)
        return methods.minimum_snap(problem)

    monkeypatch.setitem(methods.METHODS, "watched", plan)
    simulator = KnownSimulator()
    evaluate(WORLD, ["watched"], tasks_with_errors([0.1]), simulator, EvaluationOptions(thrust_share=0.95))
    ((_, flown, _, options),) = simulator.calls
    believed = WORLD.vehicle(3)
    assert set(seen) == {believed}
    assert options.nominal == believed
    assert flown.k_eta == pytest.approx(0.95 * believed.k_eta)
    assert flown.parasitic_drag == believed.parasitic_drag


def test_a_method_says_which_controller_flies_its_plans(monkeypatch):
    monkeypatch.setitem(methods.METHODS, "other", lambda p: replace(methods.minimum_snap(p), controller="another-law"))
    simulator = KnownSimulator()
    evaluate(WORLD, ["minimum-snap", "other"], tasks_with_errors([0.1]), simulator)
    assert [call[3].controller for call in simulator.calls] == ["geometric", "another-law"]


def test_yaw_by_the_short_way_turns_less_than_half_a_turn():
    given = tasks_with_errors([0.1])
    long = Tasks(given.waypoints_m, np.array([[0.0, 5.0, -1.0, 3.0]]))
    flown = {}
    for yaw in ("as-sampled", "short"):
        simulator = KnownSimulator()
        evaluate(WORLD, ["minimum-snap"], long, simulator, EvaluationOptions(yaw=yaw))
        flown[yaw] = simulator.calls[0][0][0].waypoints()[:, 3]
    assert np.allclose(flown["as-sampled"], long.yaws_rad[0])
    assert (np.abs(np.diff(flown["short"])) < np.pi).all()
    assert np.allclose(np.sin(flown["short"] - long.yaws_rad[0]), 0.0, atol=1e-9)


def test_methods_are_compared_task_by_task(monkeypatch):
    """Moved by 1 m in x, tasks 0.6 and 0.7 crash too: two tasks worse, none better."""

    def moved(problem: Problem) -> Planned:
        poses = problem.tasks.poses.copy()
        poses[..., 0] += 1.0
        return Planned(minimum_snap_batch(poses, problem.durations_s), np.zeros(len(poses), bool))

    monkeypatch.setitem(methods.METHODS, "moved", moved)
    tasks = tasks_with_errors([0.1, 0.2, 0.6, 0.7, 1.6])
    run = evaluate(WORLD, ["moved", "minimum-snap"], tasks, KnownSimulator())
    pair = run.compare("moved", "minimum-snap")
    assert pair.difference == pytest.approx(40.0)
    assert (pair.tasks_better, pair.tasks_worse) == (0, 2)
    with pytest.raises(InputError, match="method learned was not evaluated"):
        run.compare("moved", "learned")


def test_evaluations_by_models_of_their_own_are_put_side_by_side():
    tasks, simulator = tasks_with_errors([0.1, 1.6]), KnownSimulator()
    single = [evaluate(WORLD, ["minimum-snap"], tasks, simulator, EvaluationOptions(drags=(drag,))) for drag in (2, 4)]
    whole = evaluate(WORLD, ["minimum-snap"], tasks, simulator, EvaluationOptions(drags=(2, 4)))
    together = Evaluation.beside(single)
    assert together.options == whole.options
    for name in ("crashed", "max_error_m", "relative_snap", "fell_back"):
        assert np.array_equal(getattr(together.runs["minimum-snap"], name), getattr(whole.runs["minimum-snap"], name))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"drags": ()}, "give at least one"),
        ({"drags": (3, 3)}, "each once"),
        ({"noise_seeds": 0}, "0 noise seeds"),
        ({"thrust_share": 0.0}, "thrust share 0"),
        ({"thrust_share": float("nan")}, "thrust share nan"),
    ],
)
def test_options_that_cannot_be_flown_are_refused(options, message):
    with pytest.raises(InputError, match=message):
        EvaluationOptions(**options)


def test_a_model_of_another_vehicle_is_refused_before_any_flight():
    simulator = KnownSimulator()
    with pytest.raises(InputError, match="trained for another vehicle"):
        evaluate(
            load_world("hummingbird-paper"),
            ["minimum-snap", "learned"],
            5,
            simulator,
            EvaluationOptions(model="crazyflie-paper"),
        )
    assert not simulator.calls


def test_another_seed_means_other_tasks_and_other_noise():
    one, other = KnownSimulator(), KnownSimulator()
    evaluate(WORLD, ["minimum-snap"], 3, one, EvaluationOptions(seed=1))
    evaluate(WORLD, ["minimum-snap"], 3, other, EvaluationOptions(seed=2))
    assert not np.intersect1d(one.calls[0][2], other.calls[0][2]).size


def test_evaluation_never_sees_the_noise_of_training():
    simulator = KnownSimulator()
    evaluate(WORLD, ["minimum-snap"], 3, simulator, EvaluationOptions(seed=1))
    rows = np.arange(3)[:, None] * (1 << 20) + np.arange(3)
    assert not np.isin(Stream(1, "training/noise").seeds(rows.reshape(-1)), simulator.calls[0][2]).any()


def test_no_method_that_flies_while_it_plans_ever_sees_the_noise_that_it_is_judged_by():
    """Whatever task a seed was drawn for, and in both timings."""
    for timing in ("fixed", "retimed"):
        simulator = KnownSimulator()
        found = evaluate(
            WORLD,
            ["search", "analytic-polished"],
            6,
            simulator,
            EvaluationOptions(seed=1, timing=timing, noise_seeds=2),
        )
        judged = [call for call in simulator.calls if np.array_equal(call[2], found.noise.reshape(-1))]
        others = np.concatenate([call[2] for call in simulator.calls if not np.array_equal(call[2], judged[0][2])])
        assert len(judged) == 2
        assert len(others) > 1000
        assert not np.isin(found.noise, others).any()


def test_the_json_table():
    run = evaluate(WORLD, ["minimum-snap"], tasks_with_errors([0.1, 2.0]), KnownSimulator())
    table = json.loads(json.dumps(run.as_json(), allow_nan=False))
    assert table["methods"]["minimum-snap"]["crash_rate"] == pytest.approx(50.0)
    assert table["methods"]["minimum-snap"]["tasks"] == 2
    assert table["world"] == "crazyflie-saturated"


def test_progress_tells_each_method():
    seen = []
    evaluate(WORLD, ["minimum-snap"], 5, KnownSimulator(), progress=seen.append)
    assert [(p.done, p.total, p.unit, p.note) for p in seen] == [(5, 5, "plans", "crazyflie-saturated minimum-snap")]


def test_an_unknown_method_is_named_before_any_work():
    simulator = KnownSimulator()
    with pytest.raises(InputError, match="no method `minimal`; there are minimum-snap"):
        evaluate(WORLD, ["minimum-snap", "minimal"], 5, simulator)
    assert not simulator.calls


def test_who_cannot_plan_is_told_beforehand(monkeypatch):
    def refuse(problem: Problem) -> Planned:
        raise InputError("not today")

    monkeypatch.setitem(methods.METHODS, "tired", refuse)
    problem = problem_of(WORLD, tasks_with_errors([0.1]), KnownSimulator(), EvaluationOptions(), 3)
    assert {name: str(error) for name, error in refusals(["minimum-snap", "tired"], problem).items()} == {
        "tired": "not today"
    }
    simulator = KnownSimulator()
    with pytest.raises(InputError, match="not today"):
        evaluate(WORLD, ["minimum-snap", "tired"], tasks_with_errors([0.1]), simulator)
    assert not simulator.calls


def test_a_world_without_that_drag_configuration_says_so():
    with pytest.raises(InputError, match="drag configuration 6"):
        evaluate(WORLD, ["minimum-snap"], 5, KnownSimulator(), EvaluationOptions(drags=(6,)))


def test_tasks_of_any_number_of_waypoints():
    sampler = TaskSampler(7, WORLD.sampler.box_m, WORLD.sampler.distance_m, 1.0)
    run = evaluate(WORLD, ["minimum-snap"], first_tasks(sampler, 0, 3), KnownSimulator())
    assert run.methods["minimum-snap"].tasks == 3
