"""The tracking cost written a second time, in torch and in the world frame: what the kernels are held to.

Nothing is shared with the implementation but the figures in its documentation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise

import numpy as np
import torch

GRAVITY = 9.81
MIDPOINTS = 12


def compress(x: torch.Tensor, scale: float) -> torch.Tensor:
    return x / (1.0 + (x / scale) ** 2) ** 0.25


def soft_excess(x: torch.Tensor) -> torch.Tensor:
    return 0.5 * (x + torch.sqrt(x**2 + 0.1**2))


def derivatives(durations: torch.Tensor, coefficients: torch.Tensor) -> list[torch.Tensor]:
    """Orders 0 to 4 at the midpoints, each (N, 4, S, 12), by differentiating the coefficients."""
    times = durations[:, :, None] * torch.tensor([(k + 0.5) / MIDPOINTS for k in range(MIDPOINTS)])
    out = []
    for _ in range(5):
        powers = torch.stack([times**i for i in range(coefficients.shape[-1])], dim=-1)
        out.append(torch.einsum("nski,nasi->nask", powers, coefficients))
        coefficients = coefficients[..., 1:] * torch.arange(1, coefficients.shape[-1])
    return out


def features(durations: torch.Tensor, coefficients: torch.Tensor) -> torch.Tensor:
    """(N, S, 114)."""
    position, velocity, acceleration, jerk, snap = (d.movedim(1, -1) for d in derivatives(durations, coefficients))
    yaw = position[..., 3]
    force = acceleration[..., :3] + torch.tensor([0.0, 0.0, GRAVITY])
    size = torch.sqrt((force**2).sum(-1) + 0.25)
    b3 = force / size[..., None]
    heading = torch.stack([torch.cos(yaw), torch.sin(yaw), torch.zeros_like(yaw)], dim=-1)
    left = torch.linalg.cross(b3, heading)
    b2 = left / torch.sqrt((left**2).sum(-1, keepdim=True) + 0.05**2)
    b1 = torch.linalg.cross(b2, b3)
    growth = (b3 * jerk[..., :3]).sum(-1)
    rate = torch.stack([(b * jerk[..., :3]).sum(-1) / size for b in (b1, b2)], dim=-1)
    turned = torch.stack([(b * snap[..., :3]).sum(-1) for b in (b1, b2)], dim=-1)
    bend = (turned - 2.0 * growth[..., None] * rate) / size[..., None]
    ratio = size / GRAVITY
    channels = [
        torch.log(ratio),
        b3[..., 2],
        *(compress(rate[..., i], 4.0) for i in range(2)),
        *(compress(bend[..., i], 40.0) for i in range(2)),
        compress(velocity[..., 3], 10.0),
        compress(acceleration[..., 3], 50.0),
        torch.log(1.0 + (velocity[..., :3] ** 2).sum(-1)),
    ]
    summary = [
        torch.log((ratio**8).mean(-1)) / 8.0,
        soft_excess(ratio - 1.5).mean(-1),
        soft_excess(ratio - 1.9).mean(-1),
        0.5 * torch.log(1.0 + (rate**2).sum(-1).mean(-1)),
        0.25 * torch.log(1.0 + ((bend**2).sum(-1) ** 2).mean(-1)),
        torch.log(durations),
    ]
    return torch.cat([*channels, torch.stack(summary, dim=-1)], dim=-1)


def cost(
    durations: torch.Tensor,
    coefficients: torch.Tensor,
    mean: np.ndarray,
    spread: np.ndarray,
    members: list[torch.nn.Module],
) -> torch.Tensor:
    """(N,) mean plus one standard deviation over members of the logsumexp (sharpness 3) over segments."""
    normalised = (features(durations, coefficients) - torch.from_numpy(mean)) / torch.from_numpy(spread)
    plans = []
    for plan in normalised:
        nothing = torch.zeros(1, plan.shape[1])
        before, after = torch.cat([nothing, plan[:-1]]), torch.cat([plan[1:], nothing])
        flags = torch.zeros(len(plan), 2)
        flags[0, 0] = flags[-1, 1] = 1.0
        window = torch.cat([before, plan, after, flags], dim=1)
        of_member = torch.stack([torch.logsumexp(3.0 * member(window)[:, 0], 0) / 3.0 for member in members])
        variance = of_member.var(unbiased=False)
        plans.append(of_member.mean() + torch.sqrt(variance + 1e-12))
    return torch.stack(plans)


def network(sizes: list[int], activation: str, seed: int) -> torch.nn.Sequential:
    """A float64 network with torch's own initial weights."""
    torch.manual_seed(seed)
    kinds = {"silu": torch.nn.SiLU, "elu": torch.nn.ELU, "relu": torch.nn.ReLU}
    layers: list[torch.nn.Module] = []
    for i, (inputs, outputs) in enumerate(pairwise(sizes)):
        layers += [torch.nn.Linear(inputs, outputs, dtype=torch.float64)]
        if i < len(sizes) - 2:
            layers += [kinds[activation]()]
    return torch.nn.Sequential(*layers)


def stacked(members: list[torch.nn.Sequential]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Weights (M, inputs, outputs) and biases (M, outputs) of each layer, as our networks take them."""
    linear = [[layer for layer in member if isinstance(layer, torch.nn.Linear)] for member in members]
    weights = [np.stack([layer.weight.detach().numpy().T for layer in layers]) for layers in zip(*linear, strict=True)]
    biases = [np.stack([layer.bias.detach().numpy() for layer in layers]) for layers in zip(*linear, strict=True)]
    return weights, biases


def random_plans(tasks: int, segments: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Plans with lively derivatives that need not be continuous."""
    rng = np.random.default_rng(seed)
    size = np.array([3.0, 2.0, 2.0, 2.0, 1.5, 0.8, 0.4, 0.2]) * (1.0 + math.e * rng.random((tasks, 1, 1, 1)))
    return rng.uniform(0.5, 1.6, (tasks, segments)), rng.normal(size=(tasks, 4, segments, 8)) * size


@contextmanager
def double_precision() -> Iterator[None]:
    """torch's default number type for a while."""
    before = torch.get_default_dtype()
    torch.set_default_dtype(torch.float64)
    try:
        yield
    finally:
        torch.set_default_dtype(before)
