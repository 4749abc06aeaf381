"""Small tracking costs for tests: one of random weights, and one that means something without any training."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import tracking_cost_torch as reference

from lcd_flight.planning.cost.features import FEATURE_NAMES, segment_features
from lcd_flight.planning.cost.inputs import INPUTS, InputsName
from lcd_flight.planning.cost.model_card import ModelCard
from lcd_flight.planning.cost.network import Activation, Network
from lcd_flight.planning.cost.tracking_cost import CostModel, training_range

CARD = ModelCard(
    name="test-model",
    vehicle="crazyflie",
    vehicle_fingerprint="0123456789abcdef",
    loop="paper",
    worlds=("crazyflie-saturated v1",),
    parasitic_drag=((0.005, 0.005, 0.01),),
    speeds=(2.37,),
    rollouts=1000,
    data_hash="feedbeef",
    snap_weight=0.1,
    validation={"huber": 0.1},
    versions={"numpy": "2"},
)


def random_model(
    members: int = 2, sizes: tuple[int, ...] = (24, 12), activation: Activation = "silu", seed: int = 0
) -> CostModel:
    """Random float64 weights, normalised on random plans."""
    peers = [reference.network([344, *sizes, 1], activation, seed + i) for i in range(members)]
    features = segment_features(*reference.random_plans(200, 3, seed=99))
    mean, spread = features.mean(axis=(0, 1)), features.std(axis=(0, 1))
    return CostModel(Network.of(*reference.stacked(peers), activation), mean, spread, *training_range(features))


def random_whole_model(inputs: InputsName, seed: int = 0, segments: int = 3, *, convex: bool = False) -> CostModel:
    """Random float64 weights on inputs that show whole trajectories, normalised on random plans."""
    raw = INPUTS[inputs].features(*reference.random_plans(200, segments, seed=99))
    mean, spread = raw.mean(axis=(0, 1)), np.maximum(raw.std(axis=(0, 1)), 1e-3)
    network = random_network((raw.shape[2], 16, 8), "elu", seed, convex=convex)
    return CostModel(network, mean, spread, *training_range(raw), INPUTS[inputs])


def random_network(widths: tuple[int, ...], activation: Activation, seed: int, *, convex: bool) -> Network:
    """Two members of random weights; a convex one has skips and no negative weight between its layers."""
    rng = np.random.default_rng(seed)
    pairs = list(pairwise((*widths, 1)))
    weights = [rng.normal(size=(2, a, b)) / np.sqrt(a) for a, b in pairs]
    biases = [rng.normal(size=(2, b)) for _, b in pairs]
    if not convex:
        return Network.of(weights, biases, activation)
    skips = [rng.normal(size=(2, widths[0], b)) / np.sqrt(widths[0]) for _, b in pairs[1:]]
    return Network.of([weights[0], *(np.abs(w) for w in weights[1:])], biases, activation, skips)


def thrust_model(threshold: float = 0.0) -> CostModel:
    """Two members that see one feature, the p8 thrust, and call the excess of its logarithm an error.

    y = softplus-like in log(|F| / g): rising with the thrust, flat below `threshold`. No plan is out of its range.
    """
    column = FEATURE_NAMES.index("p8 thrust")
    weights = np.zeros((2, 344, 1))
    weights[:, 114 + column, 0] = 4.0, 4.4
    biases = np.full((2, 1), -4.0 * threshold)
    network = Network.of([weights, np.ones((2, 1, 1))], [biases, np.full((2, 1), -1.5)], "silu")
    everything = np.full(114, 1e6)
    return CostModel(network, np.zeros(114), np.ones(114), -everything, everything)
