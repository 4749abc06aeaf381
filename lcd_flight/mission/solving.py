"""How a mission's trajectories are solved: its planning method, with all that it needs.

minimum-snap
analytic, learned                      the projected solve on a formula, or on a learned tracking cost
analytic-polished, learned-polished    then searched from in the simulator, with a few hundred flights
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from lcd_flight.mission.assemble import TrajectoryTask
from lcd_flight.mission.plan_key import model_hash
from lcd_flight.mission.solution import MINIMUM_SNAP, ModelStamp, Option, Predictions, Solution
from lcd_flight.model import FloatArray, RolloutOptions, Simulator, Trajectories, Trajectory, Vehicle
from lcd_flight.planning.cost.limit_cost import LimitCost
from lcd_flight.planning.cost.proxy import ANALYTIC_SNAP_WEIGHT, ThrustProxy
from lcd_flight.planning.cost.tracking_cost import CostModel
from lcd_flight.planning.knots import Whitening
from lcd_flight.planning.limited import limited
from lcd_flight.planning.minimum_snap import minimum_snap
from lcd_flight.planning.planner import ErrorPredictor, PlannerOptions, PlanResult, Timing, TrackingCost, plan_task
from lcd_flight.planning.polish import PolishSettings, candidates_of, polish
from lcd_flight.planning.search import Arena

POLISHED = "-polished"
"""What the names of methods end in that fly their plans in the simulator."""


@dataclass(frozen=True, slots=True, eq=False)
class Solver:
    """A planning method that is ready to plan."""

    method: str
    vehicle: Vehicle
    cost: TrackingCost
    """What the solve lowers; without effect for minimum snap."""
    simulator: Simulator | None = None
    """Where it polishes; others need none."""
    seed: int = 0
    """Of a polish."""
    weight: float = 1.0
    """Of the cost against extra snap."""
    settings: PolishSettings = field(default_factory=PolishSettings)
    limits: LimitCost = field(default_factory=LimitCost)
    """Of the mission, which the plan is bent to keep."""

    @property
    def polishes(self) -> bool:
        """Whether it flies plans in the simulator."""
        return self.method.endswith(POLISHED)

    @property
    def unpolished(self) -> Solver:
        """The same method without its flights."""
        return replace(self, method=self.method.removesuffix(POLISHED))

    @property
    def stamp(self) -> ModelStamp | None:
        """Which learned cost it asks; None of a cost that is no model."""
        if self.method == MINIMUM_SNAP or not isinstance(self.cost, CostModel):
            return None
        return ModelStamp(self.cost.card.name if self.cost.card else "unnamed", model_hash(self.cost))

    def options(self, task: TrajectoryTask) -> Mapping[str, Option]:
        """All that its plan of a task depends on besides task, vehicle, cost and programs."""
        found = asdict(self._options(task)) | self.limits.named()
        if self.polishes:
            search = {f"search_{key}": value for key, value in asdict(self.settings.search).items()}
            flights = asdict(self.settings)
            del flights["search"]
            found |= {**flights, **search, "seed": self.seed}
        return found

    def solve(self, task: TrajectoryTask) -> Solution:
        """Plan one trajectory."""
        if self.method == MINIMUM_SNAP:
            return Solution(minimum_snap(task.waypoints, task.durations_s), MINIMUM_SNAP)
        options = self._options(task)
        result = plan_task(task.waypoints, task.durations_s, limited(self.cost, self.limits), options)
        fallback = result.fallback[0]
        plan = result.plans[0]
        if self.polishes and task.durations_s.size > 1:
            plan, fallback = self._polished(task, result, options), None
        return Solution(
            trajectory=plan,
            method=self.method if fallback is None else MINIMUM_SNAP,
            fallback=fallback,
            options=self.options(task),
            model=self.stamp,
            predictions=_predictions(self.cost, plan, result.minimum_snap[0]),
        )

    def _options(self, task: TrajectoryTask) -> PlannerOptions:
        """Times that the mission gives are kept; a model's card knows the weight of snap that suits it."""
        timing: Timing = "fixed" if task.times_given else "retimed"
        options = PlannerOptions(timing=timing, cost_weight=self.weight)
        if isinstance(self.cost, ThrustProxy):
            return replace(options, snap_weight=ANALYTIC_SNAP_WEIGHT)
        card = self.cost.card if isinstance(self.cost, CostModel) else None
        return options if card is None else replace(options, snap_weight=card.snap_weight)

    def _polished(self, task: TrajectoryTask, result: PlanResult, options: PlannerOptions) -> Trajectory:
        """The best of this solve, the analytic one and minimum snap, searched from; as the flight loop flies it."""
        space = Whitening.of(task.waypoints[None], task.durations_s[None])
        candidates = candidates_of(space, result)
        assert self.simulator is not None  # noqa: S101 - a method that polishes is made with one
        arena = Arena(self.simulator, self.vehicle, RolloutOptions(loop="flight"), self.limits)
        numbers = np.zeros(1, dtype=np.int64)
        found = polish(
            space, candidates, arena, seed=self.seed, tasks=numbers, timing=options.timing, settings=self.settings
        )
        return found.plans[0]


def _predictions(cost: TrackingCost, plan: Trajectory, baseline: Trajectory) -> Predictions:
    """What the cost says of the plan and of minimum snap."""
    plans = Trajectories(
        np.stack([plan.durations_s, baseline.durations_s]), np.stack([plan.coefficients, baseline.coefficients])
    )
    errors_m: FloatArray = np.full(2, np.nan)
    segments: list[tuple[float, ...] | None] = [None, None]
    if isinstance(cost, ErrorPredictor):
        value, parts_m = cost.predict(plans.durations_s, plans.coefficients)
        errors_m, segments = parts_m.max(axis=1), [tuple(row) for row in parts_m.tolist()]
    else:
        value, _, _ = cost.value_and_gradient(plans.durations_s, plans.coefficients)
    return Predictions(
        cost=_number(value[0]),
        minimum_snap_cost=_number(value[1]),
        predicted_max_error_m=_number(errors_m[0]),
        minimum_snap_predicted_max_error_m=_number(errors_m[1]),
        segment_errors_m=segments[0],
        minimum_snap_segment_errors_m=segments[1],
    )


def _number(value: float) -> float | None:
    """None where there is none."""
    return float(value) if np.isfinite(value) else None
