"""Rehearsals on a simulator that says what it is told to: what is asked of it, and what is made of its answers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lcd_flight.mission import Mission
from lcd_flight.mission.plan_mission import plan_mission
from lcd_flight.model import (
    FlightPlan,
    LegKind,
    RefusedError,
    RolloutLabels,
    RolloutOptions,
    SeedArray,
    Trajectories,
    Vehicle,
)
from lcd_flight.rehearsal import Rehearsal, rehearse
from lcd_flight.rehearsal.faults import noise_seeds, pose_gaps
from lcd_flight.rehearsal.rehearse import judge
from lcd_flight.worlds import load_vehicle

VEHICLE = load_vehicle("crazyflie")


def mission(**sections: Any) -> Mission:
    data: dict[str, Any] = {
        "version": 1,
        "name": "t",
        "seed": 5,
        "vehicle": {"type": "crazyflie"},
        "planner": {"type": "minimum-snap"},
        "plan": [
            {"takeoff": {"height": 1.0, "duration": 2.0}},
            {"trajectory": {"waypoints": [{"position": [0, 0, 1]}, {"position": [1, 0, 1]}, {"position": [1, 2, 1]}]}},
            {"land": {}},
        ],
        "safety": {"geofence": {"min": [-3, -3, 0], "max": [3, 3, 3]}},
    }
    return Mission.model_validate(data | sections)


PLAN: FlightPlan = plan_mission(mission(), VEHICLE).plan


class Told:
    """A simulator that answers `errors_m` in turn and keeps what it was asked."""

    def __init__(self, errors_m: list[float], time_s: float = 0.0, valid: bool = True) -> None:
        self.errors_m, self.time_s, self.valid = errors_m, time_s, valid
        self.asked: list[tuple[Trajectories, Vehicle, SeedArray, RolloutOptions]] = []

    def rollout(
        self, plans: Trajectories, vehicle: Vehicle, seeds: SeedArray, options: RolloutOptions
    ) -> RolloutLabels:
        """Labels with the errors wanted; the other figures are zero."""
        done = sum(len(plans) for plans, *_ in self.asked)
        self.asked.append((plans, vehicle, seeds, options))
        count, segments = plans.durations_s.shape
        errors = np.resize(np.array(self.errors_m), done + count)[done:]
        zeros = dict.fromkeys(RolloutLabels.__dataclass_fields__, np.zeros(count))
        reached = np.searchsorted(plans[0].knot_times_s[1:-1], self.time_s)
        by_segment = np.where(np.arange(segments) == reached, errors[:, None], np.minimum(errors[:, None], 0.01))
        shapes = {
            "segment_max_error_m": by_segment,
            "waypoint_error_m": np.zeros((count, segments + 1)),
        }
        said = {
            "max_error_m": errors,
            "max_error_time_s": np.full(count, self.time_s),
            "longest_saturation_s": 0.01 * np.arange(count),
            "valid": np.full(count, self.valid),
        }
        return RolloutLabels(**(zeros | shapes | said))


def told(
    errors_m: list[float], *, runs: int = 20, time_s: float = 0.0, valid: bool = True, **sections: Any
) -> Rehearsal:
    return rehearse(PLAN, mission(**sections), VEHICLE, Told(errors_m, time_s, valid), runs=runs)


def test_small_errors_pass() -> None:
    found = told([0.1, 0.2, 0.3])
    assert found.passed
    found.require()
    assert found.text == (
        "20/20 runs completed, max error 0.30 m (p95 0.30, limit 0.75), longest saturation 190 ms: pass"
    )


def test_one_run_in_twenty_may_exceed_the_limit_but_not_two() -> None:
    found = told([0.1] * 19 + [1.0])
    assert found.passed
    assert (found.p95_error_m, found.max_error_m) == (0.1, 1.0)
    found = told([0.1] * 18 + [1.0, 1.0])
    assert not found.passed
    assert (found.p95_error_m, found.max_error_m) == (1.0, 1.0)


@pytest.mark.parametrize("share", [0.75, 0.7500001])
def test_the_limit_itself_is_allowed(share: float) -> None:
    assert told([share]).passed is (share == 0.75)


def test_the_limit_is_the_missions() -> None:
    fence = {"geofence": {"min": [-3, -3, 0], "max": [3, 3, 3]}}
    assert not told([0.3], safety=fence | {"max_predicted_error": 0.2}).passed


def test_any_crash_is_refused() -> None:
    found = told([0.1] * 199 + [1.6], runs=200)
    assert found.p95_error_m == 0.1
    assert not found.passed
    assert found.text.startswith("199/200 runs completed, max error 1.60 m (p95 0.10, limit 0.75)")


def test_a_run_at_whose_error_the_flight_would_land_is_not_completed() -> None:
    fence = {"geofence": {"min": [-3, -3, 0], "max": [3, 3, 3]}}
    found = told([0.1] * 199 + [0.9], runs=200, safety=fence | {"max_position_error": 0.8})
    assert not found.passed
    assert int(found.completed.sum()) == 199


def test_leaving_the_models_validity_is_refused_however_small_the_error() -> None:
    found = told([0.1], valid=False)
    assert not found.passed
    assert found.text.startswith("0/20 runs completed")


def test_an_error_that_is_no_number_is_refused() -> None:
    found = told([0.1, float("nan")])
    assert not found.passed
    assert int(found.completed.sum()) == 10
    assert found.max_error_m == found.p95_error_m == np.inf


@pytest.mark.parametrize(
    ("time_s", "leg", "segment", "leg_time_s"),
    [(0.5, 0, 0, 0.5), (3.1, 2, 0, 0.1), (4.5, 2, 1, 1.5), (6.5, 3, 0, 0.5), (1e9, 4, 0, 2.0)],
)
def test_where_it_was_worst(time_s: float, leg: int, segment: int, leg_time_s: float) -> None:
    # take-off 2 s, transfer 1 s, trajectory 1 s + 2 s, transfer, landing
    spot = told([0.9], time_s=time_s).where
    assert (spot.leg, spot.segment) == (leg, segment)
    assert spot.leg_time_s == pytest.approx(leg_time_s)
    assert spot.p_W == PLAN.legs[leg].trajectory.reference(spot.leg_time_s).p_W


def test_a_refusal_says_where_and_what_helps() -> None:
    with pytest.raises(RefusedError) as caught:
        told([0.9], time_s=5.0).require()
    assert str(caught.value) == (
        "rehearsal: 20/20 runs completed, max error 0.90 m (p95 0.90, limit 0.75), longest saturation 190 ms: refused; "
        "trouble begins in plan[1].trajectory at 2.00 s, between waypoints 2 and 3, near (1.45, 1.39, 1.00); "
        "lower planner.speed, let planner.type be learned, or look at the faults in rehearse.faults"
    )


def test_what_is_flown() -> None:
    simulator = Told([0.1])
    rehearse(PLAN, mission(rehearse={"runs": 7}), VEHICLE, simulator)
    ((plans, vehicle, seeds, options),) = simulator.asked
    assert len(plans) == len(seeds) == 7
    assert np.array_equal(plans[3].coefficients, PLAN.joined().coefficients)
    assert len(np.unique(seeds)) == 7
    assert vehicle == VEHICLE
    assert (options.loop, options.nominal, options.start_aligned) == ("flight", None, True)
    assert options.pose_gap_ticks is not None


def test_faults_are_switched_one_by_one() -> None:
    for faults in ([], ["motor_noise"], ["mocap_dropout"]):
        simulator = Told([0.1])
        rehearse(PLAN, mission(rehearse={"faults": faults}), VEHICLE, simulator)
        ((_, vehicle, _, options),) = simulator.asked
        assert (vehicle.motor_noise > 0.0) is ("motor_noise" in faults)
        assert (options.pose_gap_ticks is not None) is ("mocap_dropout" in faults)


def test_gaps_fall_into_trajectories_and_last_one_to_four_ticks() -> None:
    gaps = pose_gaps(PLAN, 5, 0, 4000)
    assert set(gaps[:, 1]) == {1.0, 2.0, 3.0, 4.0}
    ends = np.cumsum([leg.duration_s for leg in PLAN.legs])
    first, last = ends[1] * 100.0, ends[2] * 100.0
    assert PLAN.legs[2].kind is LegKind.TRAJECTORY
    assert first <= gaps[:, 0].min() < first + 5.0
    assert last - 5.0 < gaps[:, 0].max() <= last
    assert np.median(gaps[:, 0]) == pytest.approx(0.5 * (first + last), abs=10.0)


def test_gaps_of_several_trajectories_leave_out_what_lies_between() -> None:
    once = mission().model_dump(by_alias=True, exclude_none=True)["plan"]
    twice = mission(plan=[once[0], once[1], {"hold": {"duration": 5.0}}, once[1], once[2]])
    plan = plan_mission(twice, VEHICLE).plan
    times = pose_gaps(plan, 5, 0, 2000)[:, 0] / 100.0
    ends = np.cumsum([leg.duration_s for leg in plan.legs])
    kinds = np.array([leg.kind for leg in plan.legs])[np.minimum(np.searchsorted(ends, times + 0.005), len(ends) - 1)]
    assert set(kinds) == {LegKind.TRAJECTORY}
    assert 0.4 < (times < 6.5).mean() < 0.6


def test_a_flight_without_trajectories_has_gaps_anywhere() -> None:
    hovering = mission(plan=[{"takeoff": {"height": 1.0}}, {"land": {}}])
    plan = plan_mission(hovering, VEHICLE).plan
    starts = pose_gaps(plan, 5, 0, 2000)[:, 0]
    assert starts.min() < 20.0
    assert starts.max() > 100.0 * plan.duration_s - 20.0


def test_a_run_is_the_same_whatever_their_number() -> None:
    few, many = Told([0.1]), Told([0.1])
    progress: list[tuple[int, int]] = []
    rehearse(PLAN, mission(), VEHICLE, few, runs=3)
    rehearse(PLAN, mission(), VEHICLE, many, runs=1200, progress=lambda done, count: progress.append((done, count)))
    assert progress == [(512, 1200), (1024, 1200), (1200, 1200)]
    seeds = np.concatenate([seeds for _, _, seeds, _ in many.asked])
    gaps = np.concatenate([options.pose_gap_ticks for *_, options in many.asked if options.pose_gap_ticks is not None])
    assert np.array_equal(few.asked[0][2], seeds[:3])
    assert np.array_equal(few.asked[0][3].pose_gap_ticks, gaps[:3])
    assert len(np.unique(seeds)) == 1200
    assert not np.array_equal(gaps[:512], gaps[512:1024])


def test_another_seed_draws_other_runs() -> None:
    one, two = Told([0.1]), Told([0.1])
    rehearse(PLAN, mission(seed=1), VEHICLE, one)
    rehearse(PLAN, mission(seed=2), VEHICLE, two)
    assert not set(one.asked[0][2]) & set(two.asked[0][2])


def test_batches_are_judged_together() -> None:
    found = told([0.1] * 600 + [2.0], runs=601)
    assert found.runs == 601
    assert found.max_error_m == 2.0
    assert int(found.completed.sum()) == 600


def test_a_spot_off_the_trajectories_names_no_waypoints() -> None:
    assert str(told([0.9], time_s=0.5).where).startswith("plan[0].takeoff at 0.50 s, near (0.00, 0.00, ")


def test_trouble_is_told_where_it_begins_not_where_it_ends() -> None:
    """A lost vehicle is furthest off at the end of the flight."""
    simulator = Told([5.0], time_s=7.5)
    labels = simulator.rollout(Trajectories.stack([PLAN.joined()]), VEHICLE, noise_seeds(0, 0, 1), RolloutOptions())
    labels.segment_max_error_m[0] = [0.1, 0.1, 0.3, 0.9, 4.0, 5.0]
    where = judge(labels, PLAN, mission()).where
    assert (where.leg, where.segment, where.leg_time_s) == (2, 1, 3.0)
    assert where.time_s == pytest.approx(6.0)


def test_segments_that_were_never_reached_are_nowhere() -> None:
    simulator = Told([0.5], time_s=3.5, valid=False)
    labels = simulator.rollout(Trajectories.stack([PLAN.joined()]), VEHICLE, noise_seeds(0, 0, 1), RolloutOptions())
    labels.segment_max_error_m[0] = [0.1, 0.1, 0.5, np.nan, np.nan, np.nan]
    found = judge(labels, PLAN, mission())
    assert (found.where.leg, found.where.segment, found.passed) == (2, 0, False)
