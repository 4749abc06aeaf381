"""Descents side by side: they get down, keep their best, and a broken row breaks nobody else."""

from __future__ import annotations

import numpy as np

from lcd_flight.model import BoolArray, FloatArray
from lcd_flight.planning.descent import descend

Answer = tuple[FloatArray, FloatArray, BoolArray]
CENTRES = np.array([[1.0, -2.0], [0.3, 0.0], [-1.0, 1.0]])
SCALES = np.array([[1.0, 10.0]])


def everywhere(x: FloatArray) -> BoolArray:
    return np.ones(len(x), dtype=bool)


def bowl(x: FloatArray) -> Answer:
    offset = x - CENTRES[: len(x)]
    return (SCALES * offset**2).sum(axis=1), 2.0 * SCALES * offset, everywhere(x)


def test_a_bowl_is_walked_down() -> None:
    found = descend(bowl, np.zeros((3, 2)), iterations=200, step=0.1)
    np.testing.assert_allclose(found.best, CENTRES, atol=0.02)
    assert not found.failed.any()
    assert np.all(found.best_iteration > 20)


def test_the_first_step_has_the_size_given_in_every_variable() -> None:
    found = descend(bowl, np.zeros((1, 2)), iterations=1, step=0.05)
    np.testing.assert_allclose(found.best[0], [0.05, -0.05], rtol=1e-6)
    assert found.best_iteration.tolist() == [1]


def test_steps_shrink_along_a_cosine() -> None:
    visited: list[float] = []

    def slope(x: FloatArray) -> Answer:
        visited.append(float(x[0, 0]))
        return x[:, 0].copy(), np.ones_like(x), everywhere(x)

    descend(slope, np.zeros((1, 1)), iterations=10, step=0.1)
    wanted = 0.05 * (1.0 + np.cos(np.pi * np.arange(10) / 10))
    np.testing.assert_allclose(-np.diff(visited), wanted, rtol=1e-6)


def test_a_start_that_cannot_be_bettered_is_kept() -> None:
    found = descend(bowl, CENTRES.copy(), iterations=10, step=0.1)
    assert np.array_equal(found.best, CENTRES)
    assert found.best_iteration.tolist() == [0, 0, 0]


def test_the_best_iterate_is_kept_and_not_the_last() -> None:
    def rippled(x: FloatArray) -> Answer:
        return np.where(x[:, 0] < 0.25, -x[:, 0], 1.0), -np.ones_like(x), everywhere(x)

    found = descend(rippled, np.zeros((1, 1)), iterations=20, step=0.1)
    assert 0.1 < found.best[0, 0] < 0.25


def test_only_iterates_that_can_be_trusted_are_kept() -> None:
    def fenced(x: FloatArray) -> Answer:
        value, grad, _ = bowl(x)
        return value, grad, np.abs(x).max(axis=1) < 0.6

    found, free = (descend(f, np.zeros((3, 2)), iterations=50, step=0.1) for f in (fenced, bowl))
    assert np.abs(found.best).max() < 0.6
    assert found.mistrusted.tolist() == [True, False, True]
    assert not free.mistrusted.any()
    assert np.all(found.best_iteration > 0)
    assert np.array_equal(found.best[1], free.best[1])
    assert np.array_equal(found.last, free.last)


def test_the_start_needs_no_trust_but_nothing_else_goes_without() -> None:
    def nowhere(x: FloatArray) -> Answer:
        value, grad, _ = bowl(x)
        return value, grad, np.zeros(len(x), dtype=bool)

    found = descend(nowhere, np.zeros((3, 2)), iterations=5, step=0.1)
    assert np.all(found.best == 0.0)
    assert found.best_iteration.tolist() == [0, 0, 0]
    assert found.mistrusted.all()
    assert np.all(found.last != 0.0, axis=1)[0]


def test_rows_do_not_see_each_other() -> None:
    together = descend(bowl, np.zeros((3, 2)), iterations=30, step=0.1)
    alone = descend(bowl, np.zeros((1, 2)), iterations=30, step=0.1)
    assert np.array_equal(together.best[:1], alone.best)


def test_a_row_that_breaks_is_told_and_stops_alone() -> None:
    calls = 0

    def breaking(x: FloatArray) -> Answer:
        nonlocal calls
        calls += 1
        assert np.isfinite(x).all()
        value, grad, trusted = bowl(x)
        if calls > 3:
            value[1] = np.inf
            grad[1] = np.nan
        return value, grad, trusted

    found = descend(breaking, np.zeros((3, 2)), iterations=30, step=0.1)
    assert found.failed.tolist() == [False, True, False]
    assert found.best_iteration[1] <= 2
    assert np.isfinite(found.best).all()
    healthy = descend(bowl, np.zeros((3, 2)), iterations=30, step=0.1)
    assert np.array_equal(found.best[[0, 2]], healthy.best[[0, 2]])


def test_a_gradient_alone_that_is_not_finite_is_a_failure() -> None:
    def flat(x: FloatArray) -> Answer:
        return np.zeros(len(x)), np.full_like(x, np.nan), everywhere(x)

    assert descend(flat, np.zeros((2, 3)), iterations=3, step=0.1).failed.all()


def test_the_start_is_not_written_to() -> None:
    start = np.zeros((3, 2))
    descend(bowl, start, iterations=3, step=0.1)
    assert np.all(start == 0.0)


def test_no_rows_are_no_trouble() -> None:
    found = descend(bowl, np.zeros((0, 2)), iterations=3, step=0.1)
    assert found.best.shape == (0, 2)
