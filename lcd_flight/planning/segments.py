"""A chain of polynomials of order 7 in the coordinates of its knots, and its snap.

A segment of duration T is fixed by position, velocity, acceleration and jerk at both of its ends (Hermite form):
whatever the derivatives are, the chain goes through the waypoints and is continuous to jerk. Its snap is quadratic
in them, and each segment couples its own two knots only, so the Hessian is banded.

Derivatives at the knots are `knots` (3 K, 4): rows v, a, j of each waypoint in turn, axes x, y, z, yaw. Every entry
of the maps below is a constant times a power of T, which is what makes their derivatives by T one line each.

Plain functions on arrays, compiled by their callers (`lcd_flight.jit`).
"""

from __future__ import annotations

import math

import numpy as np

from lcd_flight.model import FloatArray
from lcd_flight.planning.banded import factor, solve_lower, solve_upper

AXES = 4


def _unit_hermite() -> FloatArray:
    """(8, 8) coefficients of a segment with T = 1 from p, v, a, j at its start and at its end."""
    ends = np.zeros((8, 8))
    for order in range(4):
        for k in range(order, 8):
            ends[4 + order, k] = math.factorial(k) / math.factorial(k - order)
        ends[order, order] = math.factorial(order)
    return np.round(6.0 * np.linalg.inv(ends)) / 6.0  # the entries are multiples of 1/6


def _unit_gram() -> FloatArray:
    """(4, 4) snap of a segment with T = 1 as a quadratic form in its coefficients 4 to 7."""
    ratios = np.array([math.factorial(k) / math.factorial(k - 4) for k in range(4, 8)])
    exponents = np.arange(4)
    return np.asarray(np.outer(ratios, ratios) / (exponents[:, None] + exponents[None, :] + 1.0))


_DERIVATIVES = [1, 2, 3, 5, 6, 7]
GRAM = _unit_gram()
HERMITE = _unit_hermite()[4:, _DERIVATIVES]
"""(4, 6) coefficients 4 to 7 from v, a, j at the start and at the end, T = 1."""
HERMITE_STEP = _unit_hermite()[4:, 4].copy()
"""(4,) the same from the step of position, which is all that the positions contribute."""
SNAP = np.round(HERMITE.T @ GRAM @ HERMITE)
"""(6, 6) Hessian of the snap in v, a, j at the start and at the end, T = 1; the entries are whole numbers."""
SNAP_STEP = np.round(HERMITE.T @ GRAM @ HERMITE_STEP)
"""(6,) the same, coupling to the step of position."""


def inverse_powers(duration: float, out: FloatArray) -> None:
    """Fill `out` (8,) with T^0, T^-1 ... T^-7."""
    inverse = 1.0 / duration
    out[0] = 1.0
    for exponent in range(1, out.shape[0]):
        out[exponent] = out[exponent - 1] * inverse


def assemble(
    waypoints: FloatArray, durations: FloatArray, powers: FloatArray, band: FloatArray, rhs: FloatArray
) -> None:
    """Snap's Hessian (half of it) and minus its gradient at D = 0, by the derivatives D at ALL knots.

    waypoints (K, 4), durations (K - 1,), powers (8,) is scratch; band (3 K, 6) and rhs (3 K, 4) are written.
    """
    band[:] = 0.0
    rhs[:] = 0.0
    for i in range(durations.shape[0]):
        inverse_powers(durations[i], powers)
        for a in range(6):
            row, order = 3 * i + a, 1 + a % 3
            for axis in range(AXES):
                rhs[row, axis] -= SNAP_STEP[a] * powers[7 - order] * (waypoints[i + 1, axis] - waypoints[i, axis])
            for b in range(a + 1):
                band[row, a - b] += SNAP[a, b] * powers[6 - order - b % 3]


def optimal_knots(
    waypoints: FloatArray, durations: FloatArray, powers: FloatArray, band: FloatArray, knots: FloatArray
) -> None:
    """The derivatives of least snap, at rest at both ends, into `knots` (3 K, 4).

    band (3 K, 6) holds in rows 3 to -3 the factor of the Hessian by the derivatives at the inner knots: leaving out
    the rows of the first and the last waypoint is what pins those to zero.
    """
    assemble(waypoints, durations, powers, band, knots)
    inner = band[3:-3]
    factor(inner)
    solve_lower(inner, knots[3:-3])
    solve_upper(inner, knots[3:-3])
    knots[:3] = 0.0
    knots[-3:] = 0.0


def polynomials(
    waypoints: FloatArray, durations: FloatArray, knots: FloatArray, powers: FloatArray, coefficients: FloatArray
) -> None:
    """Coefficients (4, S, 8) of the chain with the derivatives `knots` (3 K, 4)."""
    for i in range(durations.shape[0]):
        inverse_powers(durations[i], powers)
        for axis in range(AXES):
            segment = coefficients[axis, i]
            segment[0] = waypoints[i, axis]
            segment[1] = knots[3 * i, axis]
            segment[2] = knots[3 * i + 1, axis] / 2.0
            segment[3] = knots[3 * i + 2, axis] / 6.0
            step = waypoints[i + 1, axis] - waypoints[i, axis]
            for k in range(4):
                value = HERMITE_STEP[k] * step * powers[4 + k]
                for a in range(6):
                    value += HERMITE[k, a] * knots[3 * i + a, axis] * powers[3 + k - a % 3]
                segment[4 + k] = value


def largest_miss(waypoints: FloatArray, durations: FloatArray, coefficients: FloatArray) -> float:
    """How far any segment's polynomial ends from its waypoint, over the axes: rounding, or NaN if anything is."""
    miss = 0.0
    for axis in range(AXES):
        for i in range(durations.shape[0]):
            value = 0.0
            for k in range(coefficients.shape[2] - 1, -1, -1):
                value = value * durations[i] + coefficients[axis, i, k]
            distance = abs(value - waypoints[i + 1, axis])
            if not distance <= miss:
                miss = distance
    return miss


def polynomials_pullback(
    waypoints: FloatArray,
    durations: FloatArray,
    knots: FloatArray,
    powers: FloatArray,
    grad_coefficients: FloatArray,
    grad_knots: FloatArray,
    grad_durations: FloatArray,
) -> None:
    """Gradient by knots and durations from the gradient by coefficients of `polynomials`.

    grad_coefficients (4, S, 8); grad_knots (3 K, 4) is written; to grad_durations (S,) is added.
    """
    grad_knots[:] = 0.0
    for i in range(durations.shape[0]):
        inverse_powers(durations[i], powers)
        for axis in range(AXES):
            grad = grad_coefficients[axis, i]
            grad_knots[3 * i, axis] += grad[1]
            grad_knots[3 * i + 1, axis] += grad[2] / 2.0
            grad_knots[3 * i + 2, axis] += grad[3] / 6.0
            step = waypoints[i + 1, axis] - waypoints[i, axis]
            for k in range(4):
                slope = -(4 + k) * HERMITE_STEP[k] * step * powers[4 + k]
                for a in range(6):
                    exponent = 3 + k - a % 3
                    entry = HERMITE[k, a] * powers[exponent]
                    grad_knots[3 * i + a, axis] += grad[4 + k] * entry
                    slope -= exponent * entry * knots[3 * i + a, axis]
                grad_durations[i] += grad[4 + k] * slope * powers[1]


def optimum_pullback(
    waypoints: FloatArray,
    durations: FloatArray,
    knots: FloatArray,
    powers: FloatArray,
    adjoint: FloatArray,
    grad_durations: FloatArray,
) -> None:
    """Add to grad_durations (S,) what flows through the optimum's dependence on the durations.

    The optimum solves H(T) D = r(T); with H(T) adjoint = gradient by D, the gradient by T is
    -adjoint' (dH/dT D - dr/dT). knots: the optimum; adjoint: its (3 K, 4), zero at both ends.
    """
    for i in range(durations.shape[0]):
        inverse_powers(durations[i], powers)
        for axis in range(AXES):
            step = waypoints[i + 1, axis] - waypoints[i, axis]
            for a in range(6):
                exponent = 6 - a % 3
                slope = exponent * SNAP_STEP[a] * step * powers[exponent]
                for b in range(6):
                    inner = exponent - 1 - b % 3
                    slope += inner * SNAP[a, b] * knots[3 * i + b, axis] * powers[inner]
                grad_durations[i] += adjoint[3 * i + a, axis] * slope * powers[1]
