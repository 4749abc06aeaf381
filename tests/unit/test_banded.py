"""The banded Cholesky factor against numpy's dense one."""

import numpy as np
import pytest

from lcd_flight.planning.banded import WIDTH, factor, solve_lower, solve_upper


def banded_matrix(rows, seed=0):
    rng = np.random.default_rng(seed)
    lower = np.tril(rng.normal(size=(rows, rows)))
    lower = np.where(np.subtract.outer(np.arange(rows), np.arange(rows)) < WIDTH, lower, 0.0)
    lower[np.diag_indices(rows)] = rng.uniform(1.0, 2.0, rows)
    return lower @ lower.T, lower


def as_band(matrix):
    rows = len(matrix)
    return np.array([[matrix[r, r - d] if r >= d else np.nan for d in range(WIDTH)] for r in range(rows)])


@pytest.mark.parametrize("rows", [1, 2, 6, 7, 15])
def test_factor_and_solves_are_those_of_the_dense_matrix(rows):
    matrix, lower = banded_matrix(rows)
    band = as_band(matrix)
    factor(band)
    expected = as_band(lower)
    expected[:, 0] = 1.0 / expected[:, 0]
    np.testing.assert_allclose(band, expected, rtol=1e-9, atol=1e-12)

    rhs = np.random.default_rng(1).normal(size=(rows, 3))
    half, whole = rhs.copy(), rhs.copy()
    solve_lower(band, half)
    np.testing.assert_allclose(lower @ half, rhs, atol=1e-12)
    solve_upper(band, whole)
    np.testing.assert_allclose(lower.T @ whole, rhs, atol=1e-12)


def test_nothing_to_solve_is_no_error():
    band, rhs = np.empty((0, WIDTH)), np.empty((0, 4))
    factor(band)
    solve_lower(band, rhs)
    solve_upper(band, rhs)


def test_a_matrix_that_is_not_positive_gives_no_factor():
    with pytest.raises(ValueError, match=r"math domain|nonnegative"):
        factor(as_band(-np.eye(2)))
