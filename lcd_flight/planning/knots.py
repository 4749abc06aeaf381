"""The planner's variables: derivatives at the inner knots, whitened, and log-durations at equal total time.

    D(z, theta) = D_min(T(theta)) + L0'^-1 (s z)

D_min(T) is the minimum-snap optimum for the durations T, L0 the Cholesky factor of the snap's Hessian at the INITIAL
durations and s the square root of the minimum snap there, positions and yaw apart. So, with theta = 0, |z|^2 over the
position axes is the relative extra snap of the position, and |z|^2 over yaw that of yaw. The waypoints hold whatever
z is. A yaw that never changes has no snap: s is zero there and it stays as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from lcd_flight.jit import Compiler
from lcd_flight.model import COEFFICIENTS, FloatArray, IntArray, Trajectories
from lcd_flight.planning.banded import WIDTH, solve_lower, solve_upper
from lcd_flight.planning.minimum_snap import KERNEL_SOURCES, check_held, snap
from lcd_flight.planning.segments import (
    AXES,
    largest_miss,
    optimal_knots,
    optimum_pullback,
    polynomials,
    polynomials_pullback,
)
from lcd_flight.planning.times import checked_durations, checked_waypoints, retime, retime_pullback


@dataclass(frozen=True, slots=True, eq=False)
class Whitening:
    """The variables of N tasks of S segments; zeros stand for minimum snap at the initial durations.

    z: (N, S - 1, 3, 4), rows v, a, j at each inner knot, axes x, y, z, yaw; theta: (N, S).
    """

    waypoints: FloatArray
    """(N, S + 1, 4)"""
    durations_s: FloatArray
    """(N, S) initial."""
    factored: FloatArray
    """(N, 3 (S - 1), 6) L0 as `banded.factor` leaves it."""
    scales: FloatArray
    """(N, 4) s for each axis: the same for x, y and z, its own for yaw."""
    minimum: Trajectories
    """Minimum snap at the initial durations: the plan at zero."""

    @staticmethod
    def of(waypoints: FloatArray, durations_s: FloatArray) -> Whitening:
        """The variables around minimum snap for waypoints (N, K, 4) and durations_s (N, K - 1).

        Raises:
            InputError: as `minimum_snap`.
        """
        waypoints = checked_waypoints(waypoints)
        durations_s = checked_durations(durations_s, waypoints)
        tasks, segments = durations_s.shape
        coefficients = np.empty((tasks, AXES, segments, COEFFICIENTS))
        factored = np.empty((tasks, 3 * (segments - 1), WIDTH))
        misses = np.empty(tasks)
        _kernel(_solve)(waypoints, durations_s, factored, coefficients, misses)
        check_held(misses, durations_s)
        minimum = Trajectories(durations_s, coefficients)
        snaps = snap(minimum)
        scales = np.sqrt(np.stack([*[snaps[:, :3].sum(axis=1)] * 3, snaps[:, 3]], axis=1))
        return Whitening(waypoints, durations_s, factored, scales, minimum)

    def __len__(self) -> int:
        """How many tasks there are."""
        return len(self.durations_s)

    @property
    def z_shape(self) -> tuple[int, int, int, int]:
        """(N, S - 1, 3, 4)."""
        tasks, segments = self.durations_s.shape
        return (tasks, segments - 1, 3, AXES)

    def take(self, indices: IntArray | Sequence[int]) -> Whitening:
        """The chosen tasks, repeated where an index is (a copy)."""
        chosen = np.asarray(indices)
        return Whitening(
            self.waypoints[chosen],
            self.durations_s[chosen],
            self.factored[chosen],
            self.scales[chosen],
            self.minimum.take(chosen),
        )

    def plan(self, z: FloatArray, theta: FloatArray) -> Trajectories:
        """The plans at z (N, S - 1, 3, 4) and theta (N, S), in double precision; NaN where the variables are."""
        retimed = retime(self.durations_s, theta)
        coefficients = np.empty_like(self.minimum.coefficients)
        _kernel(_plan)(self.waypoints, retimed, self.factored, self._shifts(z), coefficients)
        return Trajectories(retimed, coefficients)

    def pullback(
        self, z: FloatArray, theta: FloatArray, grad_durations: FloatArray, grad_coefficients: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Gradients by z and theta of a function of the plans at (z, theta).

        Its gradients by their durations (N, S) and coefficients (N, 4, S, 8), each with the other held, are given.
        """
        retimed = retime(self.durations_s, theta)
        grad_z = np.empty(self.z_shape)
        grad_retimed = np.array(grad_durations, dtype=np.float64)
        arrays = (self.waypoints, retimed, self.factored, self._shifts(z))
        grads = (
            np.ascontiguousarray(grad_coefficients),
            grad_retimed,
            grad_z.reshape(len(self), self.factored.shape[1], AXES),
        )
        _kernel(_pullback)(*arrays, *grads)
        return grad_z * self.scales[:, None, None, :], retime_pullback(retimed, theta, grad_retimed)

    def _shifts(self, z: FloatArray) -> FloatArray:
        """s z as columns, (N, 3 (S - 1), 4)."""
        return np.asarray(z * self.scales[:, None, None, :]).reshape(len(self), self.factored.shape[1], AXES)


_COMPILER = Compiler(*KERNEL_SOURCES, Path(__file__), error_model="numpy", nogil=True)


@cache
def _kernel(function: Callable[..., None]) -> Callable[..., Any]:
    return _COMPILER.kernel(function)


def _solve(
    waypoints: FloatArray, durations: FloatArray, factored: FloatArray, coefficients: FloatArray, misses: FloatArray
) -> None:
    """Minimum snap of each task, keeping the factor of its Hessian."""
    rows = 3 * waypoints.shape[1]
    band, knots, powers = np.empty((rows, 6)), np.empty((rows, 4)), np.empty(8)
    for n in range(waypoints.shape[0]):
        optimal_knots(waypoints[n], durations[n], powers, band, knots)
        factored[n] = band[3:-3]
        polynomials(waypoints[n], durations[n], knots, powers, coefficients[n])
        misses[n] = largest_miss(waypoints[n], durations[n], coefficients[n])


def _plan(
    waypoints: FloatArray, durations: FloatArray, factored: FloatArray, shifts: FloatArray, coefficients: FloatArray
) -> None:
    """Plans of each task; `shifts` (s z) is used up."""
    rows = 3 * waypoints.shape[1]
    band, knots, powers = np.empty((rows, 6)), np.empty((rows, 4)), np.empty(8)
    for n in range(waypoints.shape[0]):
        optimal_knots(waypoints[n], durations[n], powers, band, knots)
        solve_upper(factored[n], shifts[n])
        knots[3:-3] += shifts[n]
        polynomials(waypoints[n], durations[n], knots, powers, coefficients[n])


def _pullback(
    waypoints: FloatArray,
    durations: FloatArray,
    factored: FloatArray,
    shifts: FloatArray,
    grad_coefficients: FloatArray,
    grad_durations: FloatArray,
    grad_z: FloatArray,
) -> None:
    """The adjoint of `_plan`; writes the gradient by s z, adds to that by the durations, uses up `shifts`."""
    rows = 3 * waypoints.shape[1]
    band, optimum, powers = np.empty((rows, 6)), np.empty((rows, 4)), np.empty(8)
    knots, adjoint = np.empty((rows, 4)), np.empty((rows, 4))
    for n in range(waypoints.shape[0]):
        optimal_knots(waypoints[n], durations[n], powers, band, optimum)
        solve_upper(factored[n], shifts[n])
        knots[:] = optimum
        knots[3:-3] += shifts[n]
        polynomials_pullback(
            waypoints[n], durations[n], knots, powers, grad_coefficients[n], adjoint, grad_durations[n]
        )
        grad_z[n] = adjoint[3:-3]
        solve_lower(factored[n], grad_z[n])
        adjoint[:3] = 0.0
        adjoint[-3:] = 0.0
        solve_lower(band[3:-3], adjoint[3:-3])
        solve_upper(band[3:-3], adjoint[3:-3])
        optimum_pullback(waypoints[n], durations[n], optimum, powers, adjoint, grad_durations[n])
