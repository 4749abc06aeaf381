"""Plans bend to keep limits: in the solve, in the search, and in a mission that minimum snap could not fly."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from lcd_flight.learning.sampling import first_tasks
from lcd_flight.mission import load_mission
from lcd_flight.mission.airframe import vehicle_of
from lcd_flight.mission.plan_mission import plan_mission
from lcd_flight.mission.task_mission import task_mission
from lcd_flight.model import RefusedError, RolloutOptions
from lcd_flight.planning.cost.limit_cost import LimitCost
from lcd_flight.planning.cost.model_file import load_model
from lcd_flight.planning.cost.proxy import ThrustProxy
from lcd_flight.planning.knots import Whitening
from lcd_flight.planning.limited import limited
from lcd_flight.planning.limits import peaks
from lcd_flight.planning.planner import ErrorPredictor, PlannerOptions, plan_batch
from lcd_flight.planning.polish import candidates_of, polish
from lcd_flight.planning.search import Arena
from lcd_flight.plugins import simulator
from lcd_flight.worlds import load_vehicle, load_world

MODEL = load_model("crazyflie-flight")
WORLD = load_world("crazyflie-flight")
TASKS = first_tasks(WORLD.sampler, 513, 12)
DURATIONS_S = TASKS.durations_s(1.6)
VEHICLE = load_vehicle("crazyflie")
LIMIT_DEG = 36.0
TILT = LimitCost(max_tilt_rad=math.radians(LIMIT_DEG))


def largest_tilt_deg(plans: object) -> np.ndarray:
    return np.degrees([peaks(plan, VEHICLE).tilt.value for plan in plans])  # type: ignore[attr-defined]


@pytest.mark.parametrize("cost", [MODEL, ThrustProxy()])
def test_the_solve_keeps_a_limit_that_it_would_break(cost: object) -> None:
    bent = limited(cost, TILT)  # type: ignore[arg-type]
    assert isinstance(bent, ErrorPredictor) == isinstance(cost, ErrorPredictor)
    free = plan_batch(TASKS, DURATIONS_S, cost, PlannerOptions())  # type: ignore[arg-type]
    kept = plan_batch(TASKS, DURATIONS_S, bent, PlannerOptions())
    before, after = largest_tilt_deg(free.plans), largest_tilt_deg(kept.plans)
    assert (before > LIMIT_DEG).sum() >= 6
    assert (after > LIMIT_DEG).sum() <= 2
    assert np.all(after < np.maximum(before, LIMIT_DEG) + 1e-9)


def test_without_a_limit_the_plans_are_the_same_to_the_bit() -> None:
    free = plan_batch(TASKS, DURATIONS_S, MODEL, PlannerOptions())
    same = plan_batch(TASKS, DURATIONS_S, limited(MODEL, LimitCost()), PlannerOptions())
    assert np.array_equal(free.plans.coefficients, same.plans.coefficients)
    assert free.fallback == same.fallback


def test_a_plan_outside_the_range_is_named_as_before() -> None:
    far = plan_batch(TASKS, DURATIONS_S, MODEL, PlannerOptions()).plans
    durations, coefficients = 0.02 * far.durations_s, far.coefficients
    bent = limited(MODEL, TILT)
    assert isinstance(bent, ErrorPredictor)
    assert bent.out_of_range(durations, coefficients) == MODEL.out_of_range(durations, coefficients)
    assert not bent.judged(durations, coefficients)[3].any()


def test_a_polish_keeps_it_too() -> None:
    tasks, durations = TASKS.take(np.arange(4)), DURATIONS_S[:4]
    space = Whitening.of(tasks.poses, durations)
    solved = plan_batch(tasks, durations, limited(MODEL, TILT), PlannerOptions())
    options = RolloutOptions(loop="flight")
    arenas = (Arena(simulator(), VEHICLE, options), Arena(simulator(), VEHICLE, options, TILT))
    free, kept = (
        polish(space, candidates_of(space, solved), arena, seed=1, tasks=np.arange(4)) for arena in arenas
    )  # fmt: skip
    assert (largest_tilt_deg(free.plans) > LIMIT_DEG).any()
    tilt_deg = largest_tilt_deg(kept.plans)
    assert (tilt_deg > LIMIT_DEG).sum() <= 1  # the second is a hard task: without a limit, 64 deg
    assert (tilt_deg <= 1.05 * LIMIT_DEG).all()


def test_a_mission_that_minimum_snap_cannot_fly_is_bent_to_its_limits(tmp_path: Path) -> None:
    def planned(planner: str) -> float:
        text = task_mission("a task", "bent", TASKS.poses[6], 1.4, vehicle="crazyflie", planner=planner)
        wide = "max_thrust_ratio: 3.0, max_tilt_deg: 180, max_body_rate_deg: 7200"
        assert wide in text
        path = tmp_path / f"{planner}.yaml"
        path.write_text(text.replace(wide, "max_thrust_ratio: 0.95, max_tilt_deg: 35, max_body_rate_deg: 400"))
        mission = load_mission(path)
        return math.degrees(plan_mission(mission, vehicle_of(mission)).summaries[0].peaks.tilt.value)

    with pytest.raises(RefusedError, match=r"planned tilt .* raise planner\.limits\.max_tilt_deg"):
        planned("minimum-snap")
    assert planned("learned") <= 35.0
