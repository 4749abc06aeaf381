"""The networks of `planning.cost.network` in torch, to be trained, and back as plain arrays.

torch lives in this file and in `fit`; a test holds the two forms of a network to each other.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np

from lcd_flight.learning.extras import require_torch
from lcd_flight.planning.cost.network import Activation, Network

Tensor: TypeAlias = Any
Module: TypeAlias = Any


def torch_network(widths: tuple[int, ...], activation: Activation, *, convex: bool, seed: int, mean: float) -> Module:
    """Linear layers of the given widths (inputs first) with the activation between them, and one output.

    convex: inputs go to every layer, and `project` keeps it convex in them.
    mean: what the output begins near.
    """
    torch = require_torch()
    torch.manual_seed(seed)
    module = torch.nn.Module()
    layers = [torch.nn.Linear(before, after) for before, after in pairwise((*widths, 1))]
    skips = [torch.nn.Linear(widths[0], layer.out_features, bias=False) for layer in layers[1:]] if convex else []
    module.layers, module.skips = torch.nn.ModuleList(layers), torch.nn.ModuleList(skips)
    act = {"silu": torch.nn.SiLU, "elu": torch.nn.ELU, "relu": torch.nn.ReLU}[activation]()
    with torch.no_grad():
        layers[-1].bias.fill_(mean)
    project(module)

    def forward(inputs: Tensor) -> Tensor:
        x = layers[0](inputs)
        for i, layer in enumerate(layers[1:]):
            x = layer(act(x))
            x = x + skips[i](inputs) if skips else x
        return x[..., 0]

    module.forward = forward
    return module


def project(module: Module) -> None:
    """Back to the nearest convex network, where it is one with skips: no negative weight between its layers."""
    torch = require_torch()
    if len(module.skips):
        with torch.no_grad():
            for layer in module.layers[1:]:
                layer.weight.clamp_(min=0.0)


def network_of(modules: list[Module], activation: Activation) -> Network:
    """The trained members as the planner's network."""

    def stacked(kind: str, name: str) -> list[Any]:
        same = zip(*(getattr(module, kind) for module in modules), strict=True)
        return [np.stack([getattr(one, name).detach().numpy() for one in group]) for group in same]

    weights = [w.transpose(0, 2, 1) for w in stacked("layers", "weight")]
    skips = [w.transpose(0, 2, 1) for w in stacked("skips", "weight")]
    return Network.of(weights, stacked("layers", "bias"), activation, skips)
