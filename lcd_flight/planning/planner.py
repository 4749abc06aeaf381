"""The projected solve: waypoints held exactly, tracking cost against extra snap, downhill from a good start.

    min over z, theta of   weight * cost(plan) + lambda |z|^2 + mu |theta|^2,   plan = Whitening.plan(z, theta)

This is the paper's problem 3 in variables that satisfy its constraints whatever they are, with its c'Hc counted
relative to the least snap there is: |z|^2. Each row is solved by Adam, first on the analytic cost from minimum snap
(zeros), then on the given one from there (decision 0049). It keeps its best iterate, and falls back to minimum snap,
saying why, where that did not lead to a better plan. A row's plan depends on that row alone, to the bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from itertools import chain
from typing import Any, Literal, Protocol, TypeAlias, runtime_checkable

import numpy as np

from lcd_flight.model import BoolArray, FloatArray, InputError, IntArray, Tasks, Trajectories
from lcd_flight.planning.cost.proxy import ANALYTIC_SNAP_WEIGHT, ThrustProxy
from lcd_flight.planning.descent import descend
from lcd_flight.planning.knots import Whitening
from lcd_flight.planning.minimum_snap import snap

Timing: TypeAlias = Literal["fixed", "retimed"]
"""`fixed`: the durations as given. `retimed`: moved between segments at equal total time."""

_SEGMENTS_OF_STEP = 3
"""What `PlannerOptions.step` is meant for."""
_BLOCK_SEGMENTS = 192
"""Segments that are planned at a time: what a walk holds of them stays in a core's cache."""


class TrackingCost(Protocol):
    """How well a plan will be tracked: lower is better, smooth in the plan. Learned or analytic."""

    def value_and_gradient(
        self, durations_s: FloatArray, coefficients: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Costs (N,) of plans (N, S), (N, 4, S, 8), and the gradients by both, each with the other held."""
        ...


@runtime_checkable
class ErrorPredictor(TrackingCost, Protocol):
    """A cost that can say how far the vehicle will stray, and where it should not be asked."""

    def predict(self, durations_s: FloatArray, coefficients: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The costs (N,), and the largest position error in each part of each plan in m (N, parts)."""
        ...

    def judged(
        self, durations_s: FloatArray, coefficients: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
        """As `value_and_gradient`, and whether the predictions are good for each plan (N,)."""
        ...

    def out_of_range(self, durations_s: FloatArray, coefficients: FloatArray) -> tuple[str | None, ...]:
        """For each plan None, or why it is not in range."""
        ...


@dataclass(frozen=True, slots=True)
class PlannerOptions:
    """How the solve weighs and walks."""

    timing: Timing = "retimed"
    snap_weight: float = 0.1
    """lambda; a learned model's card holds the one that suits it."""
    time_weight: float = 0.05
    """mu; less than this, and long missions end in time allocations that the network is wrong about."""
    cost_weight: float = 1.0
    """What the tracking cost is multiplied by; a mission's `weight`."""
    iterations: int = 32
    step: float = 0.1
    """Adam's first step for three segments; it decays to zero along a cosine."""
    start: Literal["analytic", "minimum-snap"] = "analytic"
    """Where the solve begins; `analytic` is the same solve on the analytic cost, with as many iterations."""

    def __post_init__(self) -> None:
        """Refuse what no solve can use.

        Raises:
            InputError: a weight or step that is not positive and finite, or fewer than one iteration.
        """
        for name in ("snap_weight", "time_weight", "cost_weight", "step"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise InputError(f"{name} is {value}: it must be above 0 and finite")
        if self.iterations < 1:
            raise InputError(f"iterations is {self.iterations}: it must be at least 1")


@dataclass(frozen=True, slots=True, eq=False)
class PlanResult:
    """What became of N tasks."""

    plans: Trajectories
    minimum_snap: Trajectories
    """What the solve began with, at the durations as given."""
    cost: FloatArray
    """(N,) tracking cost of the plans, in the cost's own unit."""
    minimum_snap_cost: FloatArray
    """(N,) never below `cost`."""
    predicted_max_error_m: FloatArray
    """(N,) of the plans; NaN where the cost does not predict errors."""
    minimum_snap_predicted_max_error_m: FloatArray
    """(N,) never below `predicted_max_error_m`."""
    relative_snap: FloatArray
    """(N,) snap of the position over the least possible at the durations as given."""
    best_iteration: IntArray
    """(N,) the iterate that was kept; 0 is where the solve began, or minimum snap where it fell back."""
    z: FloatArray
    """(N, S - 1, 3, 4) what the solve found (`Whitening.plan`), also where it fell back: data for training."""
    theta: FloatArray
    """(N, S) likewise."""
    start_z: FloatArray
    """(N, S - 1, 3, 4) where the solve first began: what the analytic cost gave, or zeros."""
    start_theta: FloatArray
    """(N, S) likewise."""
    fallback: tuple[str | None, ...]
    """For each row None, or why it is minimum snap."""

    def __len__(self) -> int:
        """How many tasks there are."""
        return len(self.plans)


def plan_batch(
    tasks: Tasks,
    durations_s: FloatArray,
    cost: TrackingCost,
    options: PlannerOptions = PlannerOptions(),
    progress: Callable[[int, int], None] | None = None,
) -> PlanResult:
    """Plan N tasks, each on its own.

    Args:
        tasks: of K >= 2 waypoints; two leave nothing to choose and give minimum snap.
        durations_s: (N, K - 1) s.
        cost: what to lower.
        options: how.
        progress: called with tasks done and all tasks; what it raises stops the planning.

    Raises:
        InputError: waypoints or durations that make no trajectory.
    """
    step = max(1, _BLOCK_SEGMENTS // max(1, durations_s.shape[1]))
    parts = []
    for first in range(0, max(1, len(tasks)), step):
        rows = slice(first, first + step)
        parts.append(_plan(Whitening.of(tasks.poses[rows], durations_s[rows]), cost, options))
        if progress is not None:
            progress(min(first + step, len(tasks)), len(tasks))
    return _joined(parts)


def plan_task(
    waypoints: FloatArray, durations_s: FloatArray, cost: TrackingCost, options: PlannerOptions = PlannerOptions()
) -> PlanResult:
    """`plan_batch` for one task: waypoints (K, 4) x, y, z in m and yaw in rad, durations_s (K - 1,)."""
    return _plan(Whitening.of(np.asarray(waypoints)[None], np.asarray(durations_s)[None]), cost, options)


def _plan(whitening: Whitening, cost: TrackingCost, options: PlannerOptions) -> PlanResult:
    """Solve; rows that come to nothing from the analytic start, once more from minimum snap."""
    result = _solved(whitening, cost, options)
    again = np.array([reason is not None for reason in result.fallback])
    if options.start == "minimum-snap" or not again.any() or whitening.durations_s.shape[1] == 1:
        return result
    rows = np.flatnonzero(again)
    return _patched(result, rows, _solved(whitening.take(rows), cost, replace(options, start="minimum-snap")))


def _solved(whitening: Whitening, cost: TrackingCost, options: PlannerOptions) -> PlanResult:
    """Solve, then judge every row."""
    objective = PlanObjective(whitening, cost, options)
    start = _start(whitening, cost, options, objective.size)
    descent = descend(objective, start, options.iterations, objective.first_step, safe_start=not start.any())
    z, theta = objective.unpack(descent.best)
    found, minimum = whitening.plan(z, theta), whitening.minimum
    before, after = _Judgement.of(cost, minimum), _Judgement.of(cost, found)
    improved = after.below(before) & descent.trusted
    strange = _strangeness(cost, whitening.plan(*objective.unpack(descent.last)), descent.mistrusted & ~improved)
    verdicts = zip(descent.failed, improved, descent.mistrusted, strange, strict=True)
    reasons = tuple(
        _why_not(segments=found.segments, failed=failed, improved=improved, mistrusted=mistrusted, strange=why)
        for failed, improved, mistrusted, why in verdicts
    )
    kept = np.array([reason is None for reason in reasons])
    plans = Trajectories(
        np.where(kept[:, None], found.durations_s, minimum.durations_s),
        np.where(kept[:, None, None, None], found.coefficients, minimum.coefficients),
    )
    return PlanResult(
        plans=plans,
        minimum_snap=minimum,
        cost=np.where(kept, after.cost, before.cost),
        minimum_snap_cost=before.cost,
        predicted_max_error_m=np.where(kept, after.max_error_m, before.max_error_m),
        minimum_snap_predicted_max_error_m=before.max_error_m,
        relative_snap=_position_snap(plans) / np.maximum(_position_snap(minimum), np.finfo(float).tiny),
        best_iteration=np.where(kept, descent.best_iteration, 0),
        z=z,
        theta=theta,
        start_z=objective.unpack(start)[0],
        start_theta=objective.unpack(start)[1],
        fallback=reasons,
    )


def _start(whitening: Whitening, cost: TrackingCost, options: PlannerOptions, size: int) -> FloatArray:
    """(N, V) minimum snap, or what the analytic cost makes of it."""
    zeros = np.zeros((len(whitening), size))
    if options.start == "minimum-snap" or isinstance(cost, ThrustProxy):
        return zeros
    analytic = replace(options, snap_weight=ANALYTIC_SNAP_WEIGHT, cost_weight=1.0)
    objective = PlanObjective(whitening, ThrustProxy(), analytic)
    return descend(objective, zeros, options.iterations, objective.first_step).best


class PlanObjective:
    """What a descent lowers: variables are z, flattened, then theta, for each row."""

    def __init__(self, whitening: Whitening, cost: TrackingCost, options: PlannerOptions) -> None:
        self._whitening, self._cost, self._options = whitening, cost, options
        self._predictor = cost if isinstance(cost, ErrorPredictor) else None
        self._z_size = math.prod(whitening.z_shape[1:])
        self.size = self._z_size + whitening.durations_s.shape[1]

    @property
    def first_step(self) -> float:
        """Adam moves every variable by as much: less where there are more, since |z|^2 is a share of all the snap."""
        return self._options.step * math.sqrt(_SEGMENTS_OF_STEP / self._whitening.durations_s.shape[1])

    def unpack(self, variables: FloatArray) -> tuple[FloatArray, FloatArray]:
        """z (N, S - 1, 3, 4) and theta (N, S)."""
        return variables[:, : self._z_size].reshape(self._whitening.z_shape), variables[:, self._z_size :]

    def __call__(self, variables: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Values (N,), gradients (N, V), and which rows are in the cost's range (N,)."""
        z, theta = self.unpack(variables)
        plans = self._whitening.plan(z, theta)
        cost, grad_durations, grad_coefficients, trusted = self._judge(plans)
        grad_z, grad_theta = self._whitening.pullback(z, theta, grad_durations, grad_coefficients)
        weights = np.full(self.size, self._options.snap_weight)
        weights[self._z_size :] = self._options.time_weight
        value = self._options.cost_weight * cost + (variables**2 * weights).sum(axis=1)
        grad = np.concatenate([grad_z.reshape(len(variables), self._z_size), grad_theta], axis=1)
        grad = self._options.cost_weight * grad + 2.0 * weights * variables
        if self._options.timing == "fixed":
            grad[:, self._z_size :] = 0.0
        return value, grad, trusted

    def _judge(self, plans: Trajectories) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
        """What the cost says of plans; one that does not know its limits is trusted everywhere."""
        if self._predictor is not None:
            return self._predictor.judged(plans.durations_s, plans.coefficients)
        answer = self._cost.value_and_gradient(plans.durations_s, plans.coefficients)
        return *answer, np.ones(len(plans), dtype=bool)


@dataclass(frozen=True, slots=True, eq=False)
class _Judgement:
    """What a cost says of plans."""

    cost: FloatArray
    max_error_m: FloatArray

    @staticmethod
    def of(cost: TrackingCost, plans: Trajectories) -> _Judgement:
        if isinstance(cost, ErrorPredictor):
            value, errors_m = cost.predict(plans.durations_s, plans.coefficients)
            return _Judgement(value, errors_m.max(axis=1))
        value, _, _ = cost.value_and_gradient(plans.durations_s, plans.coefficients)
        return _Judgement(value, np.full(len(plans), np.nan))

    def below(self, other: _Judgement) -> BoolArray:
        """(N,) whether the cost is lower, and the predicted error too where there is one."""
        return (self.cost < other.cost) & ~(self.max_error_m >= other.max_error_m)


def _strangeness(cost: TrackingCost, plans: Trajectories, asked: BoolArray) -> list[str | None]:
    """For each plan that is asked about: why it is out of the cost's range."""
    reasons: list[str | None] = [None] * len(plans)
    rows = np.flatnonzero(asked)
    if len(rows) and isinstance(cost, ErrorPredictor):
        there = plans.take(rows)
        for row, reason in zip(rows, cost.out_of_range(there.durations_s, there.coefficients), strict=True):
            reasons[row] = reason
    return reasons


def _why_not(*, segments: int, failed: bool, improved: bool, mistrusted: bool, strange: str | None) -> str | None:
    """Why a row is minimum snap; None where its plan is good. `strange` is about the last iterate."""
    if segments == 1:
        return "two waypoints leave nothing to choose"
    if failed:
        return "the cost or its gradient was not finite"
    if improved:
        return None
    if mistrusted:
        return "better plans are outside what the cost was trained on" + (f": {strange}" if strange else "")
    return "no plan was predicted to be better than minimum snap"


def _position_snap(plans: Trajectories) -> FloatArray:
    return np.asarray(snap(plans)[:, :3].sum(axis=1))


def _joined(parts: list[PlanResult]) -> PlanResult:
    """The blocks of a batch, one after another."""
    values = {f.name: _concatenated([getattr(part, f.name) for part in parts]) for f in fields(PlanResult)}
    return PlanResult(**values)


def _patched(result: PlanResult, rows: IntArray, other: PlanResult) -> PlanResult:
    """`result` with these rows taken from `other`, but for where the first solve began."""
    order = np.arange(len(result))
    order[rows] = len(result) + np.arange(len(rows))
    both = _joined([result, other])
    patched = PlanResult(**{f.name: _taken(getattr(both, f.name), order) for f in fields(PlanResult)})
    return replace(patched, start_z=result.start_z, start_theta=result.start_theta)


def _taken(values: Any, order: IntArray) -> Any:
    if isinstance(values, tuple):
        return tuple(values[row] for row in order)
    return values.take(order) if isinstance(values, Trajectories) else values[order]


def _concatenated(parts: list[Any]) -> Any:
    if isinstance(parts[0], tuple):
        return tuple(chain.from_iterable(parts))
    if isinstance(parts[0], Trajectories):
        return Trajectories(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Trajectories)))
    return np.concatenate(parts)
