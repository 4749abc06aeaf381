"""Train the members of a segment-window network in torch, which lives in this file alone.

What comes out are plain arrays for `lcd_flight.planning.cost.network`, its twin without torch; a test holds one to
the other.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from threading import Lock
from typing import Any, Literal, TypeAlias

import numpy as np

from lcd_flight.learning.extras import require_torch
from lcd_flight.learning.training_set import TrainingSet
from lcd_flight.model import IntArray
from lcd_flight.planning.cost.network import Activation, Network
from lcd_flight.planning.cost.tracking_cost import SHARPNESS

Tensor: TypeAlias = Any
Report: TypeAlias = Callable[[int], None]
"""Told how many rollouts were just learned from."""


@dataclass(frozen=True, slots=True)
class FitSettings:
    """How a member is trained."""

    hidden: tuple[int, ...] = (128, 128, 32)
    activation: Activation = "silu"
    epochs: int = 3
    batch: int = 4096
    """Rollouts in a step."""
    learning_rate: float = 3e-3
    """Highest, of the one-cycle schedule."""
    weight_decay: float = 1e-2
    gradient_clip: float = 5.0
    huber_delta: float = 0.5
    loss: Literal["segment", "rollout"] = "segment"
    """What is compared: the error of each segment, or that of the rollout by the smooth maximum over segments."""


def fit(data: TrainingSet, settings: FitSettings, members: int, seed: int, report: Report) -> Network:
    """Train `members` networks on the training tasks of `data`, each with a start and an order of its own.

    Side by side, one core each: small networks gain little from sharing one.

    Raises:
        InputError: torch is not installed.
    """
    torch = require_torch()
    torch.set_num_threads(max(1, (os.cpu_count() or 1) // members))
    models = [_network(data, settings, seed * 1000 + member) for member in range(members)]
    crew = _Crew(report)
    with ThreadPoolExecutor(members) as pool:
        work = [pool.submit(_train, m, data, settings, seed * 1000 + i, crew) for i, m in enumerate(models)]
        try:
            for member in work:
                member.result()
        except BaseException:
            crew.stop = True
            raise
    layers = [[layer for layer in model if hasattr(layer, "weight")] for model in models]
    weights = [np.stack([one.weight.detach().numpy().T for one in same]) for same in zip(*layers, strict=True)]
    biases = [np.stack([one.bias.detach().numpy() for one in same]) for same in zip(*layers, strict=True)]
    return Network.of(weights, biases, settings.activation)


class _Crew:
    """What members that are trained side by side share: one report, and the word to stop."""

    def __init__(self, report: Report) -> None:
        self.stop = False
        self._report = report
        self._lock = Lock()

    def learned(self, rollouts: int) -> None:
        """Tell the caller, one member at a time."""
        with self._lock:
            self._report(rollouts)


def _train(model: Any, data: TrainingSet, settings: FitSettings, seed: int, crew: _Crew) -> None:
    """Train one member."""
    torch = require_torch()
    rows = data.rows(training=True)
    optimiser = torch.optim.AdamW(model.parameters(), settings.learning_rate, weight_decay=settings.weight_decay)
    steps = settings.epochs * -(-len(rows) // settings.batch)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, settings.learning_rate, total_steps=steps)
    for chosen in _batches(rows, settings, np.random.default_rng(seed)):
        optimiser.zero_grad(set_to_none=True)
        _loss(model, data, chosen, settings).backward()
        torch.nn.utils.clip_grad_norm_(model.parameters(), settings.gradient_clip)
        optimiser.step()
        schedule.step()
        crew.learned(len(chosen))
        if crew.stop:
            return


def _network(data: TrainingSet, settings: FitSettings, seed: int) -> Any:
    """Linear layers with the activation between them; one output, which begins near the mean of the targets."""
    torch = require_torch()
    torch.manual_seed(seed)
    activation = {"silu": torch.nn.SiLU, "elu": torch.nn.ELU, "relu": torch.nn.ReLU}[settings.activation]
    widths = [3 * data.features.shape[2] + 2, *settings.hidden, 1]
    layers: list[Any] = []
    for before, after in pairwise(widths):
        layers += [torch.nn.Linear(before, after), activation()]
    model = torch.nn.Sequential(*layers[:-1])
    rows = data.rows(training=True)
    with torch.no_grad():
        model[-1].bias.fill_(float(data.segment[rows][data.kept[rows]].mean()))
    return model


def _batches(rows: IntArray, settings: FitSettings, generator: np.random.Generator) -> Iterator[IntArray]:
    """The rows of each step: every epoch all of them, in a new order."""
    for _ in range(settings.epochs):
        order = generator.permutation(rows)
        for first in range(0, len(order), settings.batch):
            yield np.sort(order[first : first + settings.batch])


def _loss(model: Any, data: TrainingSet, rows: IntArray, settings: FitSettings) -> Tensor:
    """Huber loss of the chosen rollouts."""
    torch = require_torch()
    predicted = model(windows_of(torch.from_numpy(data.features[rows]).float()))[..., 0]
    if settings.loss == "segment":
        kept = torch.from_numpy(data.kept[rows])
        predicted, wanted = predicted[kept], torch.from_numpy(data.segment[rows])[kept]
    else:
        predicted = torch.logsumexp(SHARPNESS * predicted, dim=1) / SHARPNESS
        wanted = torch.from_numpy(data.rollout[rows])
    return torch.nn.functional.huber_loss(predicted, wanted, delta=settings.huber_delta)


def windows_of(features: Tensor) -> Tensor:
    """(B, S, F) to (B, S, 3 F + 2), as `planning.cost.tracking_cost.windows`."""
    torch = require_torch()
    rollouts, segments, width = features.shape
    out = torch.zeros((rollouts, segments, 3 * width + 2))
    out[:, 1:, :width] = features[:, :-1]
    out[:, :, width : 2 * width] = features
    out[:, :-1, 2 * width : 3 * width] = features[:, 1:]
    out[:, 0, 3 * width] = 1.0
    out[:, -1, 3 * width + 1] = 1.0
    return out
