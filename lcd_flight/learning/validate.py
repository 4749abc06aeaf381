"""How good a trained network is on tasks that it never saw: the figures on a model's card."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from lcd_flight.learning.rollouts import Source
from lcd_flight.learning.training_set import TrainingSet
from lcd_flight.model import FloatArray, IntArray
from lcd_flight.planning.cost.model_card import CalibrationBin
from lcd_flight.planning.cost.network import Network

MOST_ROLLOUTS = 100_000
"""Validated on; spread evenly over all that were held out."""
MOST_BINS = 12
"""Of predicted cost, as many rollouts in each."""
_LEAST_IN_BIN = 20


def validate(data: TrainingSet, network: Network, huber_delta: float) -> dict[str, float]:
    """Figures on the held-out tasks, by name; there must be some.

    `huber`: the loss; `huber_of_mean`: of always predicting the training mean, to compare with; `correlation`: of
    predicted and measured logarithm, rollout by rollout.
    """
    rows = _held_out(data)
    predicted = predict(data, network, rows)
    kept, wanted = data.kept[rows], data.wanted[rows].astype(np.float64)
    train = data.rows(training=True)
    mean = float(data.wanted[train][data.kept[train]].mean())
    return {
        "rollouts": float(len(rows)),
        "huber": _huber((predicted - wanted)[kept], huber_delta),
        "huber_of_mean": _huber((mean - wanted)[kept], huber_delta),
        "correlation": float(np.corrcoef(predicted.max(axis=1), data.rollout[rows])[0, 1]),
    }


def calibration(data: TrainingSet, network: Network) -> dict[str, tuple[CalibrationBin, ...]]:
    """Measured against predicted cost of held-out rollouts, by where their plans came from.

    Minimum-snap optima tell whether the network knows what it began with; given plans, those that a planner made
    with an earlier network and jitters around them, tell whether it still does where a planner goes.
    """
    rows = data.rows(training=False)
    found = {}
    for name, source in (("optima", Source.OPTIMUM), ("planned", Source.GIVEN)):
        of_source = rows[data.source[rows] == source]
        chosen = of_source[:: max(1, len(of_source) // MOST_ROLLOUTS)]
        if len(chosen) >= _LEAST_IN_BIN:
            found[name] = _bins(predict(data, network, chosen).max(axis=1), data.rollout[chosen].astype(np.float64))
    return found


def predict(data: TrainingSet, network: Network, rows: IntArray) -> FloatArray:
    """(N, R) mean over the members of the predicted logarithm of each row."""
    parts = []
    for first in range(0, len(rows), 4096):
        inputs = data.inputs.arrange(data.features[rows[first : first + 4096]].astype(network.dtype))
        outputs, _ = network.forward(inputs.reshape(-1, inputs.shape[2]))
        parts.append(outputs.mean(axis=0, dtype=np.float64).reshape(inputs.shape[:2]))
    return np.concatenate(parts)


def _held_out(data: TrainingSet) -> IntArray:
    rows = data.rows(training=False)
    return rows[:: max(1, len(rows) // MOST_ROLLOUTS)]


def _huber(error: FloatArray, delta: float) -> float:
    size = np.abs(error)
    return float(np.where(size < delta, 0.5 * size**2, delta * (size - 0.5 * delta)).mean())


def _bins(predicted: FloatArray, measured: FloatArray) -> tuple[CalibrationBin, ...]:
    """As many rollouts in each: mean prediction, then 10 %, median and 90 % of what was measured."""
    order = np.argsort(predicted, kind="stable")
    count = min(MOST_BINS, len(order) // _LEAST_IN_BIN)
    edges = np.linspace(0, len(order), count + 1).astype(int)
    bins = []
    for first, last in pairwise(edges):
        chosen = order[first:last]
        spread = np.quantile(measured[chosen], [0.1, 0.5, 0.9])
        low, middle, high = (float(q) for q in spread)
        bins.append((float(predicted[chosen].mean()), low, middle, high, float(len(chosen))))
    return tuple(bins)
