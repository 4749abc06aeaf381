"""Physics features: what a segment of a trajectory asks of the vehicle, 114 numbers a segment, and their pullback.

They see derivatives of the position only, and directions in the body frame only: moving a plan, or turning the
whole of it about z, changes none of them.

| columns   | at each of 12 midpoints (channel by channel)                                         |
|-----------|--------------------------------------------------------------------------------------|
| 0 - 11    | log(|F| / g), specific force F = a + g e3                                              |
| 12 - 23   | b3_z, the cosine of the tilt                                                           |
| 24 - 35   | rate of the thrust direction along body x, compressed above 4 rad/s                    |
| 36 - 47   | along body y                                                                           |
| 48 - 59   | acceleration of the thrust direction along body x, compressed above 40 rad/s^2         |
| 60 - 71   | along body y                                                                           |
| 72 - 83   | yaw rate, compressed above 10 rad/s                                                    |
| 84 - 95   | yaw acceleration, compressed above 50 rad/s^2                                          |
| 96 - 107  | log(1 + |v|^2), v in m/s                                                               |
| columns   | over the segment                                                                       |
| 108       | log of the mean of the 8th powers of |F| / g, divided by 8                             |
| 109, 110  | mean soft excess of |F| / g over 1.5 and over 1.9                                      |
| 111       | log(1 + mean of the squared rate of the thrust direction) / 2                          |
| 112       | log(1 + mean of the 4th power of its acceleration) / 4                                 |
| 113       | log of the duration T in s                                                             |

Midpoint k is at (k + 1/2) T / 12. |F|, b3 and the body axes: `thrust_motion`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from lcd_flight.jit import Compiler
from lcd_flight.model import FloatArray
from lcd_flight.planning.cost import feature_kernels, thrust_motion
from lcd_flight.planning.cost.feature_kernels import FEATURES, MIDPOINTS

FEATURE_VERSION = 1
"""Raised whenever the meaning of a feature changes; a model is good for one version only."""

_CHANNEL_NAMES = (
    "log thrust",
    "tilt cosine",
    "tilt rate x",
    "tilt rate y",
    "tilt acceleration x",
    "tilt acceleration y",
    "yaw rate",
    "yaw acceleration",
    "log speed",
)
FEATURE_NAMES = (
    *(f"{name} at midpoint {k + 1}" for name in _CHANNEL_NAMES for k in range(MIDPOINTS)),
    "p8 thrust",
    "thrust excess over 1.5 g",
    "thrust excess over 1.9 g",
    "mean tilt rate",
    "mean tilt acceleration",
    "log duration",
)
"""A name for each column, for messages and figures."""


def segment_features(durations_s: FloatArray, coefficients: FloatArray) -> FloatArray:
    """The features of every segment of N plans.

    Args:
        durations_s: (N, S) s, all > 0.
        coefficients: (N, 4, S, 8), laid out as in `Trajectories`.

    Returns:
        (N, S, 114). Rows depend on their own plan alone. The global interpreter lock is released meanwhile, so that
        a caller with threads can hand out slices of the rows.
    """
    features = np.empty((*durations_s.shape, FEATURES))
    forward, _ = _kernels()
    forward(np.ascontiguousarray(durations_s), np.ascontiguousarray(coefficients), features)
    return features


def segment_features_pullback(
    durations_s: FloatArray, coefficients: FloatArray, grad_features: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Reverse mode of `segment_features`.

    Args:
        durations_s: (N, S) s.
        coefficients: (N, 4, S, 8).
        grad_features: (N, S, 114) derivative of a scalar of each plan with respect to the features.

    Returns:
        Its derivatives with respect to the durations (N, S), coefficients held, and the coefficients (N, 4, S, 8).
    """
    grad_durations, grad_coefficients = np.empty(durations_s.shape), np.empty(coefficients.shape)
    _, reverse = _kernels()
    reverse(
        np.ascontiguousarray(durations_s),
        np.ascontiguousarray(coefficients),
        np.ascontiguousarray(grad_features),
        grad_durations,
        grad_coefficients,
    )
    return grad_durations, grad_coefficients


@cache
def _kernels() -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Forward and reverse, compiled on first use."""
    sources = (Path(feature_kernels.__file__), Path(thrust_motion.__file__))
    fastmath = {"contract", "nsz", "reassoc"}  # nothing that would hide a NaN
    compiler = Compiler(*sources, nogil=True, error_model="numpy", fastmath=fastmath)
    return compiler.kernel(feature_kernels.forward), compiler.kernel(feature_kernels.reverse)
