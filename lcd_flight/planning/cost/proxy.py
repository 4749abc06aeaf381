"""The analytic tracking cost: how hard the thrust must work, without any learning.

    cost = log of the p = 8 mean over time of |a + k v + g e3| / g,   k = 0.3 / s

The p = 8 mean is a smooth stand-in for the largest; k v stands for drag. Same call as the learned cost, so that the
planner takes either; zero at hover, and yaw does not matter to it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from lcd_flight.jit import Compiler
from lcd_flight.model import COEFFICIENTS, GRAVITY_M_PER_S2, FloatArray

SAMPLES = 16
"""Instants in each segment, at the midpoints of as many equal parts."""
AXES = 3


def _derivative_table(order: int) -> FloatArray:
    """(8, SAMPLES) the derivatives of u^k at the midpoints of the unit interval."""
    midpoints = (np.arange(SAMPLES) + 0.5) / SAMPLES
    rows = [math.perm(k, order) * midpoints ** max(k - order, 0) for k in range(COEFFICIENTS)]
    return np.array(rows)


_UNIT_1, _UNIT_2, _UNIT_3 = _derivative_table(1), _derivative_table(2), _derivative_table(3)
_MIDPOINTS = (np.arange(SAMPLES) + 0.5) / SAMPLES

ANALYTIC_SNAP_WEIGHT = 0.05
"""lambda that suits this cost (decision 0049)."""


@dataclass(frozen=True, slots=True)
class ThrustProxy:
    """The analytic cost as an object, beside the learned one."""

    drag_per_s: float = 0.3
    """k: how much of the velocity adds to the specific force."""

    def value_and_gradient(
        self, durations_s: FloatArray, coefficients: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The cost (N,) of N plans and its gradients.

        Args:
            durations_s: (N, S) s, all > 0.
            coefficients: (N, 4, S, 8), laid out as in `Trajectories`.

        Returns:
            The costs (N,), their gradients by the durations (N, S) with the coefficients held, and by the
            coefficients (N, 4, S, 8).
        """
        durations_s, coefficients = np.ascontiguousarray(durations_s), np.ascontiguousarray(coefficients)
        values, grad_durations = np.empty(len(durations_s)), np.empty(durations_s.shape)
        grad_coefficients = np.zeros(coefficients.shape)
        _kernel()(durations_s, coefficients, self.drag_per_s, values, grad_durations, grad_coefficients)
        return values, grad_durations, grad_coefficients


@cache
def _kernel() -> Callable[[FloatArray, FloatArray, float, FloatArray, FloatArray, FloatArray], None]:
    options = {"error_model": "numpy", "nogil": True, "fastmath": {"contract", "nsz", "reassoc"}}
    return Compiler(Path(__file__), **options).kernel(_costs)


def _costs(
    durations: FloatArray,
    coefficients: FloatArray,
    drag: float,
    values: FloatArray,
    grad_durations: FloatArray,
    grad_coefficients: FloatArray,
) -> None:
    """Fill the costs and their gradients; `grad_coefficients` comes as zeros."""
    weights, slopes = np.empty((COEFFICIENTS, SAMPLES)), np.empty((COEFFICIENTS, SAMPLES))
    force, rate = np.empty((AXES, SAMPLES)), np.empty((AXES, SAMPLES))
    for n in range(durations.shape[0]):
        total, time = 0.0, 0.0
        for i in range(durations.shape[1]):
            _tables(durations[n, i], drag, weights, slopes)
            _combine(coefficients[n, :, i], weights, force)
            _combine(coefficients[n, :, i], slopes, rate)
            force[2] += GRAVITY_M_PER_S2
            mean, grad_durations[n, i] = _eighth_powers(force, rate, durations[n, i])
            _spread(force, weights, grad_coefficients[n, :, i])
            total += durations[n, i] * mean
            time += durations[n, i]
        values[n] = math.log(total / time) / 8.0
        grad_durations[n] = grad_durations[n] / (8.0 * total) - 1.0 / (8.0 * time)
        grad_coefficients[n] /= 8.0 * total


def _tables(duration: float, drag: float, weights: FloatArray, slopes: FloatArray) -> None:
    """Both (8, SAMPLES): what each coefficient gives to a + k v, and to its change with the duration."""
    scale = 1.0 / (duration * duration)
    for k in range(COEFFICIENTS):
        for m in range(SAMPLES):
            weights[k, m] = (_UNIT_2[k, m] + drag * duration * _UNIT_1[k, m]) * scale
            slopes[k, m] = (_UNIT_3[k, m] + drag * duration * _UNIT_2[k, m]) * scale / duration * _MIDPOINTS[m]
        scale *= duration


def _combine(coefficients: FloatArray, table: FloatArray, out: FloatArray) -> None:
    """The three axes of position at the samples, (3, SAMPLES)."""
    out[:] = 0.0
    for axis in range(AXES):
        for k in range(1, COEFFICIENTS):
            for m in range(SAMPLES):
                out[axis, m] += coefficients[axis, k] * table[k, m]


def _eighth_powers(force: FloatArray, rate: FloatArray, duration: float) -> tuple[float, float]:
    """The mean of (|F| / g)^8 over a segment, and the slope by its duration of duration times that mean.

    `force` becomes the gradient of duration times mean by the force.
    """
    mean = slope = 0.0
    for m in range(SAMPLES):
        square = (force[0, m] ** 2 + force[1, m] ** 2 + force[2, m] ** 2) / GRAVITY_M_PER_S2**2
        push = 8.0 * square**3 / (GRAVITY_M_PER_S2**2 * SAMPLES) * duration
        mean += square**4 / SAMPLES
        for axis in range(AXES):
            force[axis, m] *= push
            slope += force[axis, m] * rate[axis, m]
    return mean, mean + slope


def _spread(grad_force: FloatArray, weights: FloatArray, grad_coefficients: FloatArray) -> None:
    """The adjoint of `_combine`."""
    for axis in range(AXES):
        for k in range(1, COEFFICIENTS):
            value = 0.0
            for m in range(SAMPLES):
                value += grad_force[axis, m] * weights[k, m]
            grad_coefficients[axis, k] = value
