"""The released code's planner, rewritten: snap as it is, plus the exponential of a network on raw coefficients.

    min over c   c'Hc + exp(g(c))   subject to   A c = b,   times fixed

Here A c = b holds by the choice of variables (`knots`), where the released projected gradient lets it go; and the
hundred steps are Adam's, since its line search has nothing to say about exp(g). What it shows stays: c'Hc is so
large a number (m^2/s^7 of all axes) that the network hardly moves the plan.
"""

from __future__ import annotations

import numpy as np

from lcd_flight.model import BoolArray, FloatArray, Tasks, Trajectories
from lcd_flight.planning.descent import descend
from lcd_flight.planning.knots import Whitening
from lcd_flight.planning.planner import TrackingCost

ITERATIONS = 100
"""As released."""
_STEP = 0.08


def plan_released(tasks: Tasks, durations_s: FloatArray, cost: TrackingCost) -> tuple[Trajectories, BoolArray]:
    """Plans of N tasks at the durations (N, S), and where the solve failed and gave minimum snap (N,).

    cost: g, the logarithm of a tracking cost.

    Raises:
        InputError: waypoints or durations that make no trajectory.
    """
    space = Whitening.of(tasks.poses, durations_s)
    objective = ReleasedObjective(space, cost)
    start = np.zeros((len(space), int(np.prod(space.z_shape[1:]))))
    descent = descend(objective, start, ITERATIONS, _STEP)
    best = np.where(descent.failed[:, None], 0.0, descent.best)
    return space.plan(best.reshape(space.z_shape), np.zeros(durations_s.shape)), descent.failed


class ReleasedObjective:
    """c'Hc + exp(g) for variables z, flattened, each row divided by its least c'Hc of the position."""

    def __init__(self, space: Whitening, cost: TrackingCost) -> None:
        self._space, self._cost = space, cost
        self._theta = np.zeros(space.durations_s.shape)
        self._unit = np.maximum(space.scales[:, 0] ** 2, np.finfo(float).tiny)
        self._weights = (space.scales**2 / self._unit[:, None])[:, None, None, :]

    def __call__(self, variables: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Values (N,), gradients (N, V); every row is trusted, as the released code has it."""
        z = variables.reshape(self._space.z_shape)
        plans = self._space.plan(z, self._theta)
        g, grad_durations, grad_coefficients = self._cost.value_and_gradient(plans.durations_s, plans.coefficients)
        grad_z, _ = self._space.pullback(z, self._theta, grad_durations, grad_coefficients)
        snap = 1.0 + (self._weights * z**2).sum(axis=(1, 2, 3))
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is found by the descent
            tracking = np.exp(g) / self._unit
            grad = tracking[:, None, None, None] * grad_z + 2.0 * self._weights * z
        return snap + tracking, grad.reshape(variables.shape), np.ones(len(variables), dtype=bool)
