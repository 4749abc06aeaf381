"""Cholesky factor and solves of a banded symmetric matrix, several right-hand sides at once.

Plain functions on arrays, compiled by their callers (`lcd_flight.jit`). A matrix H of n rows with `WIDTH - 1`
diagonals below its own is kept as `band` (n, WIDTH), `band[r, d] = H[r, r - d]`; entries left of the matrix are
never read.
"""

from __future__ import annotations

import math

from lcd_flight.model import FloatArray

WIDTH = 6
"""A block-tridiagonal matrix of 3 x 3 blocks has five diagonals below its own."""


def factor(band: FloatArray) -> None:
    """Turn H into its factor L, H = L L', in place; on the diagonal stand the reciprocals of L's."""
    for row in range(band.shape[0]):
        first = max(0, row - WIDTH + 1)
        for column in range(first, row):
            entry = band[row, row - column]
            for k in range(first, column):
                entry -= band[row, row - k] * band[column, column - k]
            band[row, row - column] = entry * band[column, 0]
        pivot = band[row, 0]
        for k in range(first, row):
            pivot -= band[row, row - k] * band[row, row - k]
        band[row, 0] = 1.0 / math.sqrt(pivot)


def solve_lower(factored: FloatArray, rhs: FloatArray) -> None:
    """Solve L y = rhs in place; `factored` as `factor` leaves it, rhs (n, columns)."""
    for row in range(factored.shape[0]):
        for k in range(max(0, row - WIDTH + 1), row):
            for column in range(rhs.shape[1]):
                rhs[row, column] -= factored[row, row - k] * rhs[k, column]
        for column in range(rhs.shape[1]):
            rhs[row, column] *= factored[row, 0]


def solve_upper(factored: FloatArray, rhs: FloatArray) -> None:
    """Solve L' x = rhs in place; `factored` as `factor` leaves it, rhs (n, columns)."""
    for row in range(factored.shape[0] - 1, -1, -1):
        for column in range(rhs.shape[1]):
            rhs[row, column] *= factored[row, 0]
        for k in range(max(0, row - WIDTH + 1), row):
            for column in range(rhs.shape[1]):
                rhs[k, column] -= factored[row, row - k] * rhs[row, column]
