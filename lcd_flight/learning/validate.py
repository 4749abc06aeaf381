"""How good a trained network is on tasks that it never saw: the figures on a model's card."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from lcd_flight.learning.training_set import TrainingSet
from lcd_flight.model import CRASH_ERROR_M, BoolArray, FloatArray, IntArray
from lcd_flight.planning.cost.network import Network
from lcd_flight.planning.cost.tracking_cost import windows

MOST_ROLLOUTS = 100_000
"""Validated on; spread evenly over all that were held out."""
CALIBRATION_BINS_M = (0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 2.0)
"""Edges of the bins of predicted largest error."""
_LEAST_IN_BIN = 20


def validate(data: TrainingSet, network: Network, huber_delta: float) -> dict[str, float]:
    """Figures on the held-out tasks, by name; there must be some.

    `huber`: loss over segments; `huber_of_mean`: of always predicting the training mean, to compare with;
    `correlation`: of predicted and measured log error of rollouts; `median_m_at_<edge>_m`: median measured error of
    rollouts predicted to stay below that edge and above the one before; `crash_share_at_<edge>_m`: likewise.
    """
    held_out = data.rows(training=False)
    rows = held_out[:: max(1, len(held_out) // MOST_ROLLOUTS)]
    predicted = predict(data, network, rows)
    kept, wanted = data.kept[rows], data.segment[rows].astype(np.float64)
    train = data.rows(training=True)
    mean = float(data.segment[train][data.kept[train]].mean())
    of_rollout, measured = predicted.max(axis=1), data.rollout[rows]
    return {
        "rollouts": float(len(rows)),
        "huber": _huber((predicted - wanted)[kept], huber_delta),
        "huber_of_mean": _huber((mean - wanted)[kept], huber_delta),
        "correlation": float(np.corrcoef(of_rollout, measured)[0, 1]),
        **_calibration(np.exp(of_rollout), np.exp(measured)),
    }


def predict(data: TrainingSet, network: Network, rows: IntArray) -> FloatArray:
    """(R, S) mean over the members of the predicted log error of each segment."""
    parts = []
    for first in range(0, len(rows), 4096):
        inputs = windows(data.features[rows[first : first + 4096]].astype(network.dtype))
        outputs, _ = network.forward(inputs.reshape(-1, inputs.shape[2]))
        parts.append(outputs.mean(axis=0, dtype=np.float64).reshape(inputs.shape[:2]))
    return np.concatenate(parts)


def _huber(error: FloatArray, delta: float) -> float:
    size = np.abs(error)
    return float(np.where(size < delta, 0.5 * size**2, delta * (size - 0.5 * delta)).mean())


def _calibration(predicted_m: FloatArray, measured_m: FloatArray) -> dict[str, float]:
    """Measured against predicted largest error, bin by bin; bins with hardly a rollout are left out."""
    figures = {}
    edges = (0.0, *CALIBRATION_BINS_M)
    for low, high in pairwise(edges):
        chosen: BoolArray = (low <= predicted_m) & (predicted_m < high)
        if chosen.sum() >= _LEAST_IN_BIN:
            figures[f"median_m_at_{high:g}_m"] = float(np.median(measured_m[chosen]))
            figures[f"crash_share_at_{high:g}_m"] = float((measured_m[chosen] > CRASH_ERROR_M).mean())
    return figures
