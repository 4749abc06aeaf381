"""Axes with round ticks, and traces that lose points but no peak."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lcd_flight.drawing.scale import Axis, axis_around, label, runs, visible


@pytest.mark.parametrize(
    ("low", "high", "ticks"),
    [
        (0.0, 1.0, [0.0, 0.25, 0.5, 0.75, 1.0]),
        (-0.3, 2.7, [0.0, 1.0, 2.0]),
        (0.0, 13.0, [0.0, 5.0, 10.0]),
        (-50.0, 50.0, [-50.0, -25.0, 0.0, 25.0, 50.0]),
    ],
)
def test_ticks_are_round(low: float, high: float, ticks: list[float]) -> None:
    assert Axis(low, high).ticks(4) == pytest.approx(ticks)


def test_ticks_of_a_logarithmic_axis_are_powers_of_ten() -> None:
    assert Axis(1e-3, 2.0, log=True).ticks(4) == pytest.approx([1e-3, 1e-2, 1e-1, 1.0])


def test_places_are_shares_of_the_axis_and_never_outside() -> None:
    assert Axis(-1.0, 3.0).place(np.array([-2.0, -1.0, 0.0, 3.0, 9.0])).tolist() == [0.0, 0.0, 0.25, 1.0, 1.0]
    assert Axis(1e-2, 1.0, log=True).place(np.array([0.0, 1e-2, 0.1, 1.0])).tolist() == [0.0, 0.0, 0.5, 1.0]


def test_an_axis_holds_what_is_known_and_has_a_least_span() -> None:
    axis = axis_around(np.array([1.0, np.nan, 3.0]), np.array([[2.0, 4.0]]), least=0.1)
    assert axis.low < 1.0
    assert axis.high > 4.0
    flat = axis_around(np.array([5.0, 5.0]), least=2.0)
    assert flat.high - flat.low >= 2.0
    nothing = axis_around(np.array([np.nan]), least=2.0)
    assert nothing.low < 0.0 < nothing.high


@settings(deadline=None)
@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6), st.integers(2, 8))
def test_ticks_are_within_and_not_too_many(low: float, span: float, count: int) -> None:
    axis = Axis(low, low + span)
    if not axis.high > axis.low:
        return
    ticks = axis.ticks(count)
    assert all(axis.low - 1e-6 * span <= tick <= axis.high + 1e-6 * span for tick in ticks)
    assert len(ticks) <= count + 1


def test_labels_are_short() -> None:
    assert [label(v) for v in (0.0, -0.25, 2.5, 100.0, 1e-17)] == ["0", "\N{MINUS SIGN}0.25", "2.5", "100", "0"]


def test_runs_are_the_stretches_without_gaps() -> None:
    values = np.array([np.nan, 1.0, 2.0, np.nan, np.nan, 3.0])
    assert [(run.start, run.stop) for run in runs(values)] == [(1, 3), (5, 6)]
    assert runs(np.array([np.nan])) == []
    assert runs(np.array([])) == []


@settings(deadline=None)
@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=3000), st.integers(4, 200))
def test_thinning_keeps_the_ends_and_the_peaks(values: list[float], most: int) -> None:
    column = np.array(values)
    chosen = visible(column, most)
    assert len(chosen) <= max(most + 2, 4)
    assert (np.diff(chosen) > 0).all()
    assert (chosen[0], chosen[-1]) == (0, len(column) - 1)
    assert column[chosen].max() == column.max()
    assert column[chosen].min() == column.min()
