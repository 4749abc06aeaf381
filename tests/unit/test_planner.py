"""The projected solve: better by its own judgement, exact at the waypoints, honest where it falls back."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import cost_models
import numpy as np
import pytest

from lcd_flight.model import FloatArray, InputError, Tasks, Trajectories
from lcd_flight.planning.cost.proxy import ANALYTIC_SNAP_WEIGHT, ThrustProxy
from lcd_flight.planning.cost.tracking_cost import RANGE_TOLERANCE
from lcd_flight.planning.knots import Whitening
from lcd_flight.planning.minimum_snap import minimum_snap_batch, snap
from lcd_flight.planning.planner import (
    ErrorPredictor,
    PlannerOptions,
    PlanObjective,
    PlanResult,
    TrackingCost,
    plan_batch,
    plan_task,
)

COST = cost_models.thrust_model()
RANDOM = replace(
    cost_models.random_model(sizes=(128, 128, 32)), feature_low=COST.feature_low, feature_high=COST.feature_high
)
SPEED = 2.4


def some_tasks(count: int, waypoints: int = 4, seed: int = 0, yaw: float = 0.5) -> Tasks:
    """Random walks of 1 to 3 m a step."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(size=(count, waypoints - 1, 3))
    steps *= rng.uniform(1.0, 3.0, (count, waypoints - 1, 1)) / np.linalg.norm(steps, axis=2, keepdims=True)
    points = np.concatenate([np.zeros((count, 1, 3)), np.cumsum(steps, axis=1)], axis=1)
    return Tasks(points, rng.uniform(-yaw, yaw, (count, waypoints)))


def plan(tasks: Tasks, cost: TrackingCost = COST, **options: Any) -> PlanResult:
    return plan_batch(tasks, tasks.durations_s(SPEED), cost, PlannerOptions(**options))


def objective(tasks: Tasks, z: FloatArray, theta: FloatArray, cost: TrackingCost = COST) -> FloatArray:
    """(N,) what the planner says it lowers, with its default weights."""
    plans = Whitening.of(tasks.poses, tasks.durations_s(SPEED)).plan(z, theta)
    value, _, _ = cost.value_and_gradient(plans.durations_s, plans.coefficients)
    return value + 0.1 * (z**2).sum(axis=(1, 2, 3)) + 0.05 * (theta**2).sum(axis=1)


def knots(plans: Trajectories) -> FloatArray:
    return np.stack([p.waypoints() for p in plans])


@pytest.mark.parametrize("timing", ["fixed", "retimed"])
@pytest.mark.parametrize("cost", [COST, ThrustProxy()], ids=["learned", "analytic"])
def test_plans_cost_less_than_minimum_snap(cost: TrackingCost, timing: str) -> None:
    tasks = some_tasks(20)
    result = plan(tasks, cost, timing=timing)
    assert result.fallback == (None,) * 20
    assert np.all(result.cost < result.minimum_snap_cost)
    assert np.all(objective(tasks, result.z, result.theta, cost) < result.minimum_snap_cost)
    again, _, _ = cost.value_and_gradient(result.plans.durations_s, result.plans.coefficients)
    np.testing.assert_allclose(result.cost, again, atol=1e-6)


@pytest.mark.parametrize("timing", ["fixed", "retimed"])
def test_the_objective_is_the_stated_one_with_its_slopes(timing: str) -> None:
    tasks, rng = some_tasks(5), np.random.default_rng(1)
    lowered = PlanObjective(Whitening.of(tasks.poses, tasks.durations_s(SPEED)), COST, PlannerOptions(timing=timing))
    variables, along = rng.normal(size=(2, 5, lowered.size)) * 0.1
    value, grad, in_range = lowered(variables)
    assert in_range.all()
    np.testing.assert_allclose(value, objective(tasks, *lowered.unpack(variables)), rtol=1e-12)
    if timing == "fixed":
        lowered.unpack(along)[1][:] = 0.0
        assert np.all(lowered.unpack(grad)[1] == 0.0)
    step = 1e-6
    slope = (lowered(variables + step * along)[0] - lowered(variables - step * along)[0]) / (2.0 * step)
    np.testing.assert_allclose((grad * along).sum(axis=1), slope, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("waypoints", [3, 4, 10, 60])
def test_waypoints_hold_whatever_is_planned(waypoints: int) -> None:
    tasks = some_tasks(3, waypoints)
    result = plan(tasks)
    assert result.fallback == (None,) * 3
    assert np.abs(knots(result.plans) - tasks.poses).max() < 1e-9
    ends = np.stack([p.derivative(np.array([0.0, p.duration_s]), d) for p in result.plans for d in (1, 2, 3)])
    assert np.abs(ends).max() < 1e-6


def test_the_total_time_stays_and_fixed_times_stay_each() -> None:
    tasks = some_tasks(8)
    durations = tasks.durations_s(SPEED)
    np.testing.assert_array_equal(plan(tasks, timing="fixed").plans.durations_s, durations)
    retimed = plan(tasks, timing="retimed").plans.durations_s
    np.testing.assert_allclose(retimed.sum(axis=1), durations.sum(axis=1))
    assert np.abs(retimed - durations).max() > 0.01


def test_retiming_finds_more_than_fixed_times() -> None:
    tasks = some_tasks(20)
    assert plan(tasks, timing="retimed").cost.mean() < plan(tasks, timing="fixed").cost.mean()


def test_minimum_snap_is_what_the_result_compares_with() -> None:
    tasks = some_tasks(5)
    result = plan(tasks, timing="fixed")
    wanted = minimum_snap_batch(tasks.poses, tasks.durations_s(SPEED))
    np.testing.assert_allclose(result.minimum_snap.coefficients, wanted.coefficients, atol=1e-9)
    np.testing.assert_allclose(
        result.relative_snap, snap(result.plans)[:, :3].sum(axis=1) / snap(wanted)[:, :3].sum(axis=1)
    )
    assert np.all(result.relative_snap > 1.0)


def test_more_snap_weight_means_less_extra_snap_and_more_cost_weight_more() -> None:
    tasks = some_tasks(10)
    plain, stiff, keen = (plan(tasks, timing="fixed", **o) for o in ({}, {"snap_weight": 1.0}, {"cost_weight": 4.0}))
    assert stiff.relative_snap.mean() < plain.relative_snap.mean() < keen.relative_snap.mean()
    assert stiff.cost.mean() > plain.cost.mean() > keen.cost.mean()


def test_the_predicted_error_is_given_in_metres_and_goes_down() -> None:
    result = plan(some_tasks(10))
    after = COST.predict_max_error_m(result.plans.durations_s, result.plans.coefficients)
    np.testing.assert_allclose(result.predicted_max_error_m, after)
    assert np.all(result.predicted_max_error_m < result.minimum_snap_predicted_max_error_m)


def test_a_cost_that_predicts_no_error_gives_none() -> None:
    assert not isinstance(ThrustProxy(), ErrorPredictor)
    result = plan(some_tasks(2), ThrustProxy())
    assert np.isnan(result.predicted_max_error_m).all()


def test_planning_twice_gives_the_same_bits() -> None:
    tasks = some_tasks(6)
    cost = replace(RANDOM, network=RANDOM.network.astype(np.float32))
    first, second = plan(tasks, cost), plan(tasks, cost)
    assert np.array_equal(first.plans.coefficients, second.plans.coefficients)
    assert np.array_equal(first.plans.durations_s, second.plans.durations_s)
    assert np.array_equal(first.cost, second.cost)


@pytest.mark.parametrize("waypoints", [4, 12])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_row_gives_the_same_bits_alone_and_in_a_batch(waypoints: int, dtype: type) -> None:
    tasks = some_tasks(7, waypoints)
    cost = replace(RANDOM, network=RANDOM.network.astype(dtype))
    together = plan(tasks, cost)
    assert sum(reason is None for reason in together.fallback) > 3
    for n in range(len(tasks)):
        alone = plan_task(tasks.poses[n], tasks.durations_s(SPEED)[n], cost)
        assert np.array_equal(alone.plans.coefficients[0], together.plans.coefficients[n])
        assert np.array_equal(alone.plans.durations_s[0], together.plans.durations_s[n])
        assert alone.cost[0] == together.cost[n]
        assert alone.fallback[0] == together.fallback[n]


def test_batches_beyond_one_block_are_whole_and_reported() -> None:
    tasks = some_tasks(700)
    seen: list[tuple[int, int]] = []
    options = PlannerOptions(iterations=2)
    result = plan_batch(tasks, tasks.durations_s(SPEED), ThrustProxy(), options, lambda *at: seen.append(at))
    assert seen[-1] == (700, 700)
    assert len(seen) > 1
    assert {len(getattr(result, f.name)) for f in fields(PlanResult)} == {700}
    part = plan_batch(tasks.take(slice(600, 700)), tasks.durations_s(SPEED)[600:], ThrustProxy(), options)
    assert np.array_equal(part.cost, result.cost[600:])


def test_planning_can_be_interrupted_between_blocks() -> None:
    def stop(done: int, of: int) -> None:
        raise KeyboardInterrupt

    tasks = some_tasks(700)
    with pytest.raises(KeyboardInterrupt):
        plan_batch(tasks, tasks.durations_s(SPEED), ThrustProxy(), PlannerOptions(iterations=1), stop)


def test_two_waypoints_are_minimum_snap() -> None:
    tasks = some_tasks(3, waypoints=2)
    result = plan(tasks)
    assert result.fallback == ("two waypoints leave nothing to choose",) * 3
    assert np.array_equal(result.plans.coefficients, result.minimum_snap.coefficients)


def test_no_tasks_are_no_trouble() -> None:
    assert len(plan(some_tasks(0))) == 0


class Broken:
    """A cost that is not finite for chosen rows of the batch."""

    def __init__(self, rows: list[int], value: float = 0.0, gradient: float = 0.0) -> None:
        self.rows, self.value, self.gradient = rows, value, gradient

    def value_and_gradient(
        self, durations_s: FloatArray, coefficients: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        value, grad_durations, grad_coefficients = COST.value_and_gradient(durations_s, coefficients)
        rows = self.rows if len(value) > max(self.rows) else slice(None)  # a broken row that is tried again, alone
        value[rows] += self.value
        grad_durations[rows] += self.gradient
        return value, grad_durations, grad_coefficients


@pytest.mark.parametrize("broken", [Broken([1], value=np.nan), Broken([1], value=np.inf), Broken([1], gradient=np.nan)])
def test_a_row_that_is_not_finite_falls_back_alone(broken: Broken) -> None:
    result = plan(some_tasks(3), broken)
    assert result.fallback == (None, "the cost or its gradient was not finite", None)
    assert np.array_equal(result.plans.coefficients[1], result.minimum_snap.coefficients[1])
    assert np.array_equal(result.plans.durations_s[1], result.minimum_snap.durations_s[1])
    assert result.best_iteration[1] == 0
    healthy = plan(some_tasks(3))
    np.testing.assert_allclose(result.plans.coefficients[[0, 2]], healthy.plans.coefficients[[0, 2]])


def test_where_nothing_is_better_minimum_snap_is_kept() -> None:
    class Flat:
        def value_and_gradient(
            self, durations_s: FloatArray, coefficients: FloatArray
        ) -> tuple[FloatArray, FloatArray, FloatArray]:
            return np.zeros(len(durations_s)), np.zeros_like(durations_s), np.zeros_like(coefficients)

    result = plan(some_tasks(2), Flat())
    assert result.fallback == ("no plan was predicted to be better than minimum snap",) * 2
    assert np.array_equal(result.plans.coefficients, result.minimum_snap.coefficients)
    assert np.all(result.relative_snap == 1.0)


def test_a_plan_whose_predicted_error_is_not_lower_is_not_taken() -> None:
    class Worse(cost_models.CostModel):
        def predict(self, durations_s: FloatArray, coefficients: FloatArray) -> tuple[FloatArray, FloatArray]:
            value, errors_m = super().predict(durations_s, coefficients)
            return value, np.ones_like(errors_m)

    worse = Worse(*(getattr(COST, f.name) for f in fields(COST)))
    assert plan(some_tasks(2), worse).fallback == ("no plan was predicted to be better than minimum snap",) * 2


def bounded(low: float, high: float) -> cost_models.CostModel:
    """The test cost, believed for segments between two durations."""
    column = cost_models.FEATURE_NAMES.index("log duration")
    narrow = replace(COST, feature_low=COST.feature_low.copy(), feature_high=COST.feature_high.copy())
    tolerated = RANGE_TOLERANCE * np.log(high / low) / (1.0 + 2.0 * RANGE_TOLERANCE)
    narrow.feature_low[column], narrow.feature_high[column] = np.log(low) + tolerated, np.log(high) - tolerated
    return narrow


def test_it_begins_with_what_the_analytic_cost_gives() -> None:
    """With a cost that is flat everywhere the start itself is what is left, and minimum snap is what is flown."""
    tasks = some_tasks(4)
    begun = plan(tasks, ThrustProxy(), snap_weight=ANALYTIC_SNAP_WEIGHT)
    one = plan(tasks, iterations=1, step=1e-9)
    again = plan(tasks, ThrustProxy(), snap_weight=ANALYTIC_SNAP_WEIGHT, iterations=1, step=1e-9)
    np.testing.assert_allclose(one.z, again.z, atol=1e-7)
    assert np.abs(begun.z).max() > 0.05
    assert np.abs(plan(tasks, iterations=1, step=1e-9, start="minimum-snap").z).max() < 1e-6


def test_the_best_plan_within_the_training_range_is_kept() -> None:
    tasks = some_tasks(10, seed=3)
    durations = tasks.durations_s(SPEED)
    free = plan(tasks)
    assert free.plans.durations_s.max() > durations.max() + 0.02
    narrow = bounded(0.1, durations.max() + 0.01)
    result = plan(tasks, narrow)
    assert result.fallback == (None,) * 10
    assert result.plans.durations_s.max() <= durations.max() + 0.01
    assert narrow.in_range(result.plans.durations_s, result.plans.coefficients).all()
    inside = free.plans.durations_s.max(axis=1) <= durations.max() + 0.01
    assert inside.any()
    assert not inside.all()
    assert np.array_equal(result.plans.durations_s[inside], free.plans.durations_s[inside])


def test_where_only_plans_outside_the_training_range_are_better_it_falls_back_and_says_by_what() -> None:
    tasks = some_tasks(4, seed=3)
    durations = tasks.durations_s(SPEED)[1]
    result = plan(tasks, bounded(durations.min() - 1e-9, durations.max() + 1e-9))
    reason = result.fallback[1]
    assert reason is not None
    assert reason.startswith("better plans are outside what the cost was trained on: log duration of segment")
    assert np.array_equal(result.plans.coefficients[1], result.minimum_snap.coefficients[1])
    assert result.cost[1] == result.minimum_snap_cost[1]
    assert result.predicted_max_error_m[1] == result.minimum_snap_predicted_max_error_m[1]


@pytest.mark.parametrize(
    ("name", "value"),
    [("snap_weight", 0.0), ("snap_weight", float("nan")), ("cost_weight", -1.0), ("step", float("inf"))],
)
def test_impossible_options_are_refused(name: str, value: float) -> None:
    with pytest.raises(InputError, match=f"{name} is"):
        PlannerOptions(**{name: value})


def test_no_iterations_are_refused() -> None:
    with pytest.raises(InputError, match="iterations is 0"):
        PlannerOptions(iterations=0)


def test_equal_waypoints_are_refused() -> None:
    with pytest.raises(InputError, match="waypoint"):
        plan_task(np.zeros((3, 4)), np.ones(2), COST)
