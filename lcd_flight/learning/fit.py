"""Train the members of an ensemble in torch.

What comes out are plain arrays for `lcd_flight.planning.cost.network`, its twin without torch.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from threading import Lock
from typing import TypeAlias

import numpy as np

from lcd_flight.learning.extras import require_torch
from lcd_flight.learning.torch_network import Module, Tensor, network_of, project, torch_network
from lcd_flight.learning.training_set import TrainingSet
from lcd_flight.model import IntArray
from lcd_flight.planning.cost.model_card import CurvePoint
from lcd_flight.planning.cost.network import Activation, Network

Report: TypeAlias = Callable[[int], None]
"""Told how many rollouts were just learned from."""

CURVE_POINTS = 40
_HELD_OUT_ROWS = 8192
"""That a point of the learning curve is taken on."""


@dataclass(frozen=True, slots=True)
class FitSettings:
    """How a member is trained."""

    hidden: tuple[int, ...] = (128, 128, 32)
    activation: Activation = "silu"
    convex: bool = False
    """Whether the network is convex in its inputs; wants an activation that is (elu, relu)."""
    epochs: int = 3
    batch: int = 4096
    """Rollouts in a step."""
    learning_rate: float = 3e-3
    """Highest, of the one-cycle schedule."""
    weight_decay: float = 1e-2
    gradient_clip: float = 5.0
    huber_delta: float = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """What training gives."""

    network: Network
    curve: tuple[CurvePoint, ...]
    """Of the first member."""


def fit(data: TrainingSet, settings: FitSettings, members: int, seed: int, report: Report) -> Fitted:
    """Train `members` networks on the training tasks of `data`, each with a start and an order of its own.

    Side by side, one core each: networks this small gain nothing from sharing theirs, and lose much where others work.

    Raises:
        InputError: torch is not installed.
    """
    torch = require_torch()
    torch.set_num_threads(1)
    modules = [_module(data, settings, seed * 1000 + member) for member in range(members)]
    crew = _Crew(report)
    with ThreadPoolExecutor(members) as pool:
        work = [pool.submit(_train, m, data, settings, seed * 1000 + i, crew) for i, m in enumerate(modules)]
        try:
            curves = [member.result() for member in work]
        except BaseException:
            crew.stop = True
            raise
    return Fitted(network_of(modules, settings.activation), tuple(curves[0]))


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


def _train(module: Module, data: TrainingSet, settings: FitSettings, seed: int, crew: _Crew) -> list[CurvePoint]:
    """Train one member; returns its learning curve."""
    torch = require_torch()
    rows = data.rows(training=True)
    optimiser = torch.optim.AdamW(module.parameters(), settings.learning_rate, weight_decay=settings.weight_decay)
    steps = settings.epochs * -(-len(rows) // settings.batch)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, settings.learning_rate, total_steps=steps)
    curve, losses, learned = [], [], 0
    for step, chosen in enumerate(_batches(rows, settings, np.random.default_rng(seed)), start=1):
        optimiser.zero_grad(set_to_none=True)
        loss = _loss(module, data, chosen, settings)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(module.parameters(), settings.gradient_clip)
        optimiser.step()
        schedule.step()
        project(module)
        losses.append(float(loss.detach()))
        learned += len(chosen)
        if step % max(1, steps // CURVE_POINTS) == 0 or step == steps:
            curve.append((float(learned), float(np.mean(losses)), _held_out_loss(module, data, settings)))
            losses = []
        crew.learned(len(chosen))
        if crew.stop:
            break
    return curve


def _held_out_loss(module: Module, data: TrainingSet, settings: FitSettings) -> float:
    """On some rollouts of tasks that are not trained on."""
    rows = data.rows(training=False)
    rows = rows[:: max(1, len(rows) // _HELD_OUT_ROWS)]
    with require_torch().no_grad():
        return float(_loss(module, data, rows, settings))


def _module(data: TrainingSet, settings: FitSettings, seed: int) -> Module:
    """One member, untrained; its output begins near the mean of the targets."""
    rows = data.rows(training=True)
    inputs = data.inputs.arrange(data.features[:1]).shape[2]
    mean = float(data.wanted[rows][data.kept[rows]].mean())
    widths = (inputs, *settings.hidden)
    return torch_network(widths, settings.activation, convex=settings.convex, seed=seed, mean=mean)


def _batches(rows: IntArray, settings: FitSettings, generator: np.random.Generator) -> Iterator[IntArray]:
    """The rows of each step: every epoch all of them, in a new order."""
    for _ in range(settings.epochs):
        order = generator.permutation(rows)
        for first in range(0, len(order), settings.batch):
            yield np.sort(order[first : first + settings.batch])


def _loss(module: Module, data: TrainingSet, rows: IntArray, settings: FitSettings) -> Tensor:
    """Huber loss over the rows of the chosen rollouts."""
    torch = require_torch()
    inputs = _arranged(torch.from_numpy(data.features[rows]).float(), windows=data.inputs.name == "windows")
    kept = torch.from_numpy(data.kept[rows])
    wanted = torch.from_numpy(data.wanted[rows])[kept]
    with torch.autocast("cpu", torch.bfloat16, enabled=_has_bfloat16()):
        predicted = module(inputs)
    return torch.nn.functional.huber_loss(predicted.float()[kept], wanted, delta=settings.huber_delta)


@cache
def _has_bfloat16() -> bool:
    """Whether the processor multiplies bfloat16: twice as fast, and as good to the fourth digit of the loss.

    Elsewhere it would be emulated, slower than float32.
    """
    torch = require_torch()
    return bool(torch.backends.mkldnn.is_available() and torch.ops.mkldnn._is_mkldnn_bf16_supported())


def _arranged(features: Tensor, *, windows: bool) -> Tensor:
    return windows_of(features) if windows else features


def windows_of(features: Tensor) -> Tensor:
    """(B, S, F) to (B, S, 3 F + 2), as `planning.cost.inputs.Windows.arrange`."""
    torch = require_torch()
    rollouts, segments, width = features.shape
    out = torch.zeros((rollouts, segments, 3 * width + 2))
    out[:, 1:, :width] = features[:, :-1]
    out[:, :, width : 2 * width] = features
    out[:, :-1, 2 * width : 3 * width] = features[:, 1:]
    out[:, 0, 3 * width] = 1.0
    out[:, -1, 3 * width + 1] = 1.0
    return out
