"""The released code's planner as it was meant, on jaxopt: a peer for the cost of a plan.

    min over c   c'Hc + exp(g(c))   subject to   A c = b

by `jaxopt.ProjectedGradient`, 100 iterations, `projection_affine_set`; g is an ELU network 96-100-100-20-1. The
released code cannot run as published (imports, data and weights are missing); weights are random here, which costs as
much as any.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from lcd_flight.model import FloatArray

ITERATIONS = 100
_LAYERS = (100, 100, 20, 1)
_CONTINUOUS_ORDERS = 5
"""The released code is continuous to snap."""


def planner(start: FloatArray) -> Callable[[FloatArray, FloatArray], Any]:
    """A function that plans waypoints (K, 4) with durations (K - 1,) from coefficients like `start` (4, S, 8).

    Raises:
        ImportError: jaxopt is not installed.
    """
    import jax
    import jax.numpy as jnp
    import jaxopt

    jax.config.update("jax_enable_x64", True)
    layers = _network(start.size)

    def objective(c: Any, hessian: Any) -> Any:
        x = c
        for i, (weights, bias) in enumerate(layers):
            x = x @ weights + bias
            x = x if i == len(layers) - 1 else jax.nn.elu(x)
        return c @ hessian @ c + jnp.exp(x[0])

    solver = jaxopt.ProjectedGradient(
        fun=objective, projection=jaxopt.projection.projection_affine_set, maxiter=ITERATIONS
    )

    def plan(waypoints: FloatArray, durations_s: FloatArray) -> Any:
        a, b = constraints(waypoints, durations_s)
        hessian = np.kron(np.eye(4), _snap(durations_s))
        run = solver.run(start.reshape(-1), hyperparams_proj=(a, b), hessian=hessian)
        return np.asarray(run.params)

    return plan


def constraints(waypoints: FloatArray, durations_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A and b for coefficients (4, S, 8) in one row: waypoints, rest at both ends, continuity in between."""
    segments = len(durations_s)
    rows, values = [], []
    for i, t in enumerate(durations_s):
        rows += [_row(segments, {i: _at(0.0, 0)}), _row(segments, {i: _at(t, 0)})]
        values += [waypoints[i], waypoints[i + 1]]
    for order in (1, 2, 3):
        rows += [_row(segments, {0: _at(0.0, order)}), _row(segments, {segments - 1: _at(durations_s[-1], order)})]
        values += [np.zeros(4), np.zeros(4)]
    for i in range(segments - 1):
        for order in range(1, _CONTINUOUS_ORDERS):
            rows.append(_row(segments, {i: _at(durations_s[i], order), i + 1: -_at(0.0, order)}))
            values.append(np.zeros(4))
    return np.kron(np.eye(4), np.array(rows)), np.array(values).T.reshape(-1)


def _row(segments: int, entries: dict[int, FloatArray]) -> FloatArray:
    row = np.zeros((segments, 8))
    for segment, powers in entries.items():
        row[segment] = powers
    return row.reshape(-1)


def _at(t: float, order: int) -> FloatArray:
    """What each coefficient gives to a derivative at a time of its segment."""
    return np.array([math.perm(k, order) * t ** (k - order) if k >= order else 0.0 for k in range(8)])


def _snap(durations_s: FloatArray) -> FloatArray:
    """Gram matrix of the snap of one axis, (8 S, 8 S)."""
    blocks = np.zeros((len(durations_s), 8, len(durations_s), 8))
    for i, t in enumerate(durations_s):
        for j in range(4, 8):
            for k in range(4, 8):
                blocks[i, j, i, k] = math.perm(j, 4) * math.perm(k, 4) * t ** (j + k - 7) / (j + k - 7)
    return blocks.reshape(8 * len(durations_s), -1)


def _network(inputs: int) -> list[tuple[FloatArray, FloatArray]]:
    rng = np.random.default_rng(0)
    return [(rng.normal(size=(a, b)) / np.sqrt(a), np.zeros(b)) for a, b in pairwise((inputs, *_LAYERS))]
