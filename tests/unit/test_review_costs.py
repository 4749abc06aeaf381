"""The measured cost is what the planner's cost was trained on, segment by segment."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import synthetic_flight
from synthetic_flight import SEGMENT_S, Pair, log_of

from lcd_flight.learning import targets
from lcd_flight.model.frames import from_yaw, multiply
from lcd_flight.record.plan_file import Prediction
from lcd_flight.review.costs import SegmentFigures, cost_error_m, segment_figures

FIRST = 20 + 300
"""The first tick of the trajectory."""
LEG = 2


def facing(pairs: list[Pair], off_rad: float) -> list[Pair]:
    """The same flight, turned away from its heading by so much."""
    turned = []
    for inputs, tick in pairs:
        state = inputs.pose.state
        assert state is not None
        yaw = 0.0 if tick.reference is None else tick.reference.yaw_rad
        pose = replace(inputs.pose, state=replace(state, q_WB=multiply(from_yaw(yaw + off_rad), (0.0, 0.0, 0.0, 1.0))))
        turned.append((replace(inputs, pose=pose), tick))
    return turned


def measured(rows: tuple[SegmentFigures, ...]) -> list[float | None]:
    return [row.measured_m for row in rows]


def test_it_means_what_the_cost_is_trained_on() -> None:
    errors = np.array([0.0, 0.004, 0.3, 1.2, 40.0])
    for yaw_cost in (0.0, 0.2):
        np.testing.assert_allclose(
            np.log(cost_error_m(errors, yaw_cost)), targets.log_error(errors, np.full(5, yaw_cost)), rtol=1e-12
        )


def test_each_segment_has_its_largest_error() -> None:
    def off(time_s: float) -> tuple[float, float, float]:
        along = time_s - FIRST / 100
        return (0.1 + 0.1 * (along // SEGMENT_S), 0.0, 0.0)

    pairs = facing(synthetic_flight.flight(off), 0.0)
    rows = segment_figures(log_of(pairs))
    assert [(row.leg, row.segment) for row in rows] == [(LEG, 0), (LEG, 1), (LEG, 2)]
    assert measured(rows)[1:] == pytest.approx([0.3, 0.3], abs=1e-6)  # a knot's tick belongs to both its segments
    assert measured(rows)[0] == pytest.approx(0.2, abs=1e-6)
    assert rows[0].begin_s == pytest.approx(FIRST / 100)
    assert rows[2].end_s == pytest.approx(FIRST / 100 + 3 * SEGMENT_S)


def test_the_yaw_has_its_share() -> None:
    rows = segment_figures(log_of(facing(synthetic_flight.flight(), 0.5)))
    expected = np.sqrt(0.1**2 + 0.1 * 2.0 * (1.0 - np.cos(0.5)))
    assert measured(rows) == pytest.approx([expected] * 3, rel=1e-6)


def test_segments_that_were_not_flown_to_their_end_have_none() -> None:
    rows = segment_figures(log_of(synthetic_flight.flight()[: FIRST + 200]))
    assert [value is None for value in measured(rows)] == [False, True, True]
    assert [row.begin_s is None for row in rows] == [False, False, True]
    assert measured(segment_figures(log_of(synthetic_flight.flight()[:30]))) == [None] * 3


def test_a_flight_without_pose_has_none() -> None:
    blind = [(inputs, replace(tick, position_error_W=None)) for inputs, tick in synthetic_flight.flight()]
    assert measured(segment_figures(log_of(blind))) == [None] * 3


def test_predictions_stand_beside() -> None:
    prediction = Prediction(
        leg=LEG,
        method="learned",
        segment_errors_m=(0.1, 0.2, 0.3),
        minimum_snap_segment_errors_m=(0.5, 0.6, 0.7),
    )
    rows = segment_figures(log_of(synthetic_flight.flight(), predictions=(prediction,)))
    assert [row.predicted_m for row in rows] == [0.1, 0.2, 0.3]
    assert [row.minimum_snap_predicted_m for row in rows] == [0.5, 0.6, 0.7]


def test_without_a_learned_cost_nothing_was_predicted() -> None:
    for predictions in ((), (Prediction(leg=LEG, method="minimum-snap"),)):
        rows = segment_figures(log_of(synthetic_flight.flight(), predictions=predictions))
        assert {row.predicted_m for row in rows} == {None}
        assert None not in measured(rows)
