"""Figures of merit on made-up flights whose answers are known."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
import synthetic_flight
from synthetic_flight import log_of

from lcd_flight.model import FlightPlan, LegKind, Outcome, Phase
from lcd_flight.review import FlightFigures, figures_of

TRACK_FIRST = 20 + 200 + 100
"""Number of the first tick on the trajectory."""


def test_a_flight_that_lies_10_cm_beside_its_reference() -> None:
    figures = figures_of(log_of(synthetic_flight.flight(synthetic_flight.beside(0.1))))
    assert figures.outcome is Outcome.LANDED
    assert figures.position_rmse_m == pytest.approx(0.1)
    assert figures.max_position_error_m == pytest.approx(0.1)
    assert figures.overall_rmse_m == pytest.approx(0.1)
    assert figures.waypoint_errors_m[:3] == pytest.approx([0.1] * 3, abs=1e-3)
    assert figures.predicted_max_error_m == 0.25
    assert figures.duration_s == pytest.approx(9.5)
    assert (figures.ticks, figures.missed_ticks) == (20 + 950 + 1, 0)
    assert figures.loop_rate_hz == pytest.approx(100.0)


def test_errors_off_the_trajectory_count_overall_only() -> None:
    def mostly_on_take_off(time_s: float) -> tuple[float, float, float]:
        return (0.5, 0.0, 0.0) if time_s < 2.2 else (0.0, 0.2, 0.0)

    figures = figures_of(log_of(synthetic_flight.flight(mostly_on_take_off)))
    assert figures.position_rmse_m == pytest.approx(0.2)
    assert figures.max_position_error_m == pytest.approx(0.2)
    assert figures.overall_max_error_m == pytest.approx(0.5)
    assert figures.overall_rmse_m == pytest.approx(math.sqrt((200 * 0.25 + 750 * 0.04) / 950))


def test_ways_between_do_not_count_as_the_missions_trajectories() -> None:
    legs = list(synthetic_flight.plan().legs)
    legs[1] = replace(legs[1], kind=LegKind.TRANSFER)
    pairs = [
        (i, replace(t, phase=Phase.TRACK, position_error_W=(0.9, 0.0, 0.0)) if t.leg == 1 else t)
        for i, t in synthetic_flight.flight()
    ]
    figures = figures_of(log_of(pairs, plan=FlightPlan(tuple(legs))))
    assert figures.max_position_error_m == pytest.approx(0.1)
    assert figures.overall_max_error_m == pytest.approx(0.9)
    assert [row.name for row in figures.phases][3:5] == ["transfer", "trajectory"]


def test_waypoints_are_measured_at_their_planned_instants() -> None:
    def lagging(time_s: float) -> tuple[float, float, float]:
        return (0.0, 0.0, 0.01 * (time_s - TRACK_FIRST / 100))

    figures = figures_of(log_of(synthetic_flight.flight(lagging)))
    planned_s = np.arange(4) * synthetic_flight.SEGMENT_S
    assert figures.waypoint_errors_m == pytest.approx((0.01 * planned_s).tolist(), abs=1e-4)


def test_waypoints_that_were_not_reached_have_no_error() -> None:
    figures = figures_of(log_of(synthetic_flight.flight()[: TRACK_FIRST + 200]))
    reached = [error is not None for error in figures.waypoint_errors_m]
    assert reached == [True, True, False, False]
    assert figures.outcome is None


def test_a_leg_that_settles_is_measured_when_its_time_ends_and_not_after() -> None:
    """During the wait the vehicle drifts away; the last waypoint's error is that of its own instant."""
    pairs = synthetic_flight.flight(synthetic_flight.beside(0.0))
    end = TRACK_FIRST + 450
    landing = pairs[end]
    waiting = []
    for extra in range(100):
        inputs, tick = pairs[end - 1]
        late_ns = (extra + 1) * synthetic_flight.TICK_NS
        assert inputs.pose.state is not None
        state = replace(inputs.pose.state, p_WB=(9.0, 9.0, 9.0)) if extra else landing[0].pose.state
        waiting.append(
            (
                replace(inputs, now_ns=inputs.now_ns + late_ns, pose=replace(inputs.pose, state=state)),
                replace(tick, now_ns=tick.now_ns + late_ns, leg_time_s=4.5),
            )
        )
    figures = figures_of(log_of(pairs[:end] + waiting))
    assert figures.waypoint_errors_m[-1] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("end", "outcome"),
    [
        ([Phase.LANDED], Outcome.LANDED),
        ([Phase.LAND_NOW, Phase.LANDED], Outcome.ABORTED),
        ([Phase.DESCEND_BLIND, Phase.LANDED], Outcome.ABORTED),
        ([Phase.LANDED, Phase.KILL], Outcome.LANDED),
        ([Phase.LAND_NOW, Phase.KILL], Outcome.CUT),
        ([Phase.CRASHED], Outcome.CRASHED),
        ([], None),
    ],
)
def test_the_phases_say_how_it_ended(end: list[Phase], outcome: Outcome | None) -> None:
    assert figures_of(log_of(synthetic_flight.flight(end=end))).outcome is outcome


def test_a_hold_on_the_way_does_not_spoil_a_landing() -> None:
    held = [
        (i, replace(t, phase=Phase.BRAKE_HOLD) if 400 <= t.sequence < 450 else t) for i, t in synthetic_flight.flight()
    ]
    assert figures_of(log_of(held)).outcome is Outcome.LANDED


def test_the_worst_moment_is_one_of_the_trajectories() -> None:
    def away(time_s: float) -> tuple[float, float, float]:
        return (0.9 if time_s < 1.0 else 0.5 if abs(time_s - 5.0) < 0.004 else 0.1, 0.0, 0.0)

    figures = figures_of(log_of(synthetic_flight.flight(away)))
    assert figures.max_position_error_m == pytest.approx(0.5)
    assert figures.max_position_error_time_s == pytest.approx(5.0, abs=1e-3)
    assert figures_of(log_of(synthetic_flight.flight()[:30])).max_position_error_time_s is None


def test_the_attitude_is_held_against_its_setpoint() -> None:
    figures = figures_of(log_of(synthetic_flight.flight()))
    assert figures.max_attitude_error_rad == pytest.approx(0.0, abs=1e-6)
    assert figures.attitude_lag_s == pytest.approx(0.0, abs=1e-3)
    assert figures_of(log_of(synthetic_flight.flight()[:15])).max_attitude_error_rad is None


def test_saturation_is_a_share_of_the_ticks_in_the_air() -> None:
    pairs = [(i, replace(t, saturated=400 <= t.sequence < 495)) for i, t in synthetic_flight.flight()]
    assert figures_of(log_of(pairs)).saturation_share == pytest.approx(0.1)


def test_lateness_and_missed_ticks() -> None:
    pairs = []
    for inputs, tick in synthetic_flight.flight():
        late_ns = 5_000_000 if tick.sequence == 500 else 200_000
        pairs.append((replace(inputs, deadline_ns=inputs.now_ns - late_ns, missed=int(tick.sequence == 501)), tick))
    figures = figures_of(log_of(pairs))
    assert figures.missed_ticks == 1
    assert figures.lateness_median_s == pytest.approx(200e-6)
    assert figures.lateness_p99_s == pytest.approx(200e-6)
    assert figures.lateness_max_s == pytest.approx(5e-3)


def test_battery_and_mocap() -> None:
    figures = figures_of(log_of(synthetic_flight.flight()))
    assert figures.battery_first_V == pytest.approx(4.1)
    assert figures.battery_min_V == figures.battery_last_V == pytest.approx(4.1 - 0.097)
    assert (figures.pose_received, figures.pose_lost, figures.pose_rejected) == (971, 0, 0)
    assert figures.pose_age_max_s == pytest.approx(3e-3)


def test_each_phase_has_its_row() -> None:
    rows = {row.name: row for row in figures_of(log_of(synthetic_flight.flight())).phases}
    assert list(rows) == ["preflight", "armed", "takeoff", "hold", "trajectory", "land", "landed"]
    assert rows["preflight"].rmse_m is None
    assert rows["trajectory"].duration_s == pytest.approx(4.5)
    assert rows["trajectory"].max_error_m == pytest.approx(0.1)
    assert rows["trajectory"].saturation_share == pytest.approx(9 / 450)
    assert rows["hold"].max_speed == pytest.approx(0.0)


def test_a_flight_that_never_left_the_ground() -> None:
    figures = figures_of(log_of(synthetic_flight.flight()[:15]))
    assert figures.outcome is None
    assert figures.position_rmse_m is figures.overall_max_error_m is figures.max_speed is None
    assert figures.waypoint_errors_m == (None,) * 4
    assert figures.saturation_share == 0.0


def test_a_single_tick_has_figures_too() -> None:
    figures = figures_of(log_of(synthetic_flight.flight()[:1]))
    assert (figures.ticks, figures.loop_rate_hz) == (1, None)


def test_the_figures_are_json() -> None:
    figures = figures_of(log_of(synthetic_flight.flight()[: TRACK_FIRST + 200]))
    back = json.loads(json.dumps(figures.to_json(), allow_nan=False))
    assert back["waypoint_errors_m"][-1] is None
    assert {
        "outcome",
        "position_rmse_m",
        "max_position_error_m",
        "waypoint_errors_m",
        "ticks",
        "missed_ticks",
        "saturation_share",
        "predicted_max_error_m",
    } <= set(back)
    assert set(back) == set(FlightFigures.__dataclass_fields__)
