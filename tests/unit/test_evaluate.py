"""Evaluation against rates worked out by hand, with a simulator whose every answer is known."""

import json

import numpy as np
import pytest

from lcd_flight.learning import methods
from lcd_flight.learning.evaluate import evaluate
from lcd_flight.learning.evaluation import EvaluationOptions
from lcd_flight.learning.methods import Planned, Problem
from lcd_flight.learning.sampling import first_tasks
from lcd_flight.model import InputError, RolloutLabels, Tasks, TaskSampler, World
from lcd_flight.model.streams import Stream
from lcd_flight.planning.minimum_snap import minimum_snap_batch
from lcd_flight.worlds import load_world

WORLD: World = load_world("crazyflie-saturated")


class KnownSimulator:
    """Errors that are a plain function of the plan: its largest error is x of the first waypoint, in m."""

    def __init__(self, broken_from=None):
        self.broken_from = broken_from
        self.calls = []

    def rollout(self, plans, vehicle, seeds, options):
        self.calls.append((plans, vehicle, seeds, options))
        n, segments = plans.durations_s.shape
        error = plans.coefficients[:, 0, 0, 0].copy()
        waypoint = np.tile(error[:, None], (1, segments + 1)) * 0.5
        waypoint[:, -1] = np.nan
        flat = np.zeros(n)
        valid = np.ones(n, bool) if self.broken_from is None else error < self.broken_from
        return RolloutLabels(
            error, flat, flat, flat, flat, np.zeros((n, segments)), waypoint, flat, flat, flat, flat + 0.25, flat, valid
        )


def tasks_with_errors(errors):
    waypoints = np.zeros((len(errors), 4, 3))
    waypoints[:, :, 0] = np.asarray(errors)[:, None]
    waypoints[:, :, 1] = np.arange(4) * 2.0
    return Tasks(waypoints, np.zeros((len(errors), 4)))


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


def test_the_drag_and_the_number_of_noise_seeds_are_options():
    simulator = KnownSimulator()
    options = EvaluationOptions(drags=(5,), noise_seeds=2)
    assert evaluate(WORLD, ["minimum-snap"], 4, simulator, options).methods["minimum-snap"].noise_seeds == 2
    assert simulator.calls[0][1] == WORLD.vehicle(5)


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


def test_a_world_without_that_drag_configuration_says_so():
    with pytest.raises(InputError, match="drag configuration 6"):
        evaluate(WORLD, ["minimum-snap"], 5, KnownSimulator(), EvaluationOptions(drags=(6,)))


def test_tasks_of_any_number_of_waypoints():
    sampler = TaskSampler(7, WORLD.sampler.box_m, WORLD.sampler.distance_m, 1.0)
    run = evaluate(WORLD, ["minimum-snap"], first_tasks(sampler, 0, 3), KnownSimulator())
    assert run.methods["minimum-snap"].tasks == 3
