"""From nothing to a model of the tracking cost: collect, train, then rounds of planning, flying and training anew.

    base data -> model 0 -> plans of model 0, flown -> model 1 -> plans of model 1, flown -> model 2 ...

Every stage leaves its files in the work folder and is skipped where they are there already, so an interrupted
training goes on where it stopped. The networks are trained from scratch in each round, on all data so far.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from lcd_flight.files import writing
from lcd_flight.learning.collect import collect
from lcd_flight.learning.dataset import Dataset
from lcd_flight.learning.extras import require_pyarrow, require_torch
from lcd_flight.learning.fingerprint import described, fingerprint, versions
from lcd_flight.learning.fit import Fitted, fit
from lcd_flight.learning.mix import shard_rows
from lcd_flight.learning.policy import PolicyConfig, collect_policy, sha256_of
from lcd_flight.learning.progress import Meter, ProgressCallback, ignore
from lcd_flight.learning.rebuild import trajectories
from lcd_flight.learning.recipes import TrainConfig
from lcd_flight.learning.rollouts import Rollouts
from lcd_flight.learning.training_set import Normalisation, TrainingSet, features
from lcd_flight.learning.validate import calibration, validate
from lcd_flight.model import InputError, Simulator, Trajectories, World
from lcd_flight.planning.cost.inputs import INPUTS
from lcd_flight.planning.cost.model_card import ModelCard
from lcd_flight.planning.cost.model_file import load_model, save_model
from lcd_flight.planning.cost.tracking_cost import CostModel, training_range
from lcd_flight.worlds import fingerprint as vehicle_fingerprint

_RANGE_ROLLOUTS = 100_000
"""From which the range of what was trained on is taken."""
_TEST_PLANS = 16


def train(
    config: TrainConfig, work: Path, out: Path, simulator: Simulator, progress: ProgressCallback = ignore
) -> ModelCard:
    """Train a model and write it to `out` (`*.safetensors`); data and the models of the rounds stay in `work`.

    Raises:
        InputError: the extra `train` is not installed, a file in `work` is damaged or of another configuration, or a
            folder cannot be written to.
    """
    require_torch()
    require_pyarrow()
    training = _Training(config, work, simulator, progress)
    model = training.first_model()
    for number in range(1, config.rounds + 1):
        model = training.next_model(number)
    _copy(training.model_path(config.rounds), out)
    assert model.card is not None  # noqa: S101 - a saved model has one
    return model.card


class _Training:
    """One training under way; data are loaded only once there is something to be trained on them."""

    def __init__(self, config: TrainConfig, work: Path, simulator: Simulator, progress: ProgressCallback) -> None:
        self._config, self._work, self._simulator, self._progress = config, work, simulator, progress
        self._waiting: list[tuple[World, Dataset, int]] = []
        self._data: TrainingSet | None = None
        self._test_plans: Trajectories | None = None

    def model_path(self, number: int) -> Path:
        """Of the model that round `number` ends with."""
        return self._work / f"round-{number}.safetensors"

    def first_model(self) -> CostModel:
        """Collect the base data and train on them."""
        config = self._config
        for world in config.worlds:
            folder = self._work / "base" / world.name
            base = collect(config.collecting(world), config.count_of_each, folder, self._simulator, self._progress)
            self._waiting.append((world, base, config.count_of_each))
        return self._model(0)

    def next_model(self, number: int) -> CostModel:
        """Fly what the last model plans, and train anew on everything so far."""
        config, last = self._config, self.model_path(number - 1)
        blocks = config.policy_blocks_of_each
        for world in config.worlds:
            policy = PolicyConfig(config.collecting(world), number, sha256_of(last), config.snap_weight, config.policy)
            folder = self._work / f"round-{number}" / world.name
            flown = collect_policy(policy, last, blocks, folder, self._simulator, self._progress)
            self._waiting.append((world, flown, blocks * config.policy.rows))
        return self._model(number)

    def _model(self, number: int) -> CostModel:
        """The model of a round: the one in the work folder, or a new one."""
        path, stamp = self.model_path(number), self._stamp(number)
        if path.exists():
            model = load_model(path)
            if model.card is None or model.card.data_hash != stamp:
                raise InputError(f"{path}: made by another configuration; give another work folder")
            return model
        data = self._loaded()
        members = self._config.members if number == self._config.rounds else 1
        seed = 1000 * self._config.seed + number
        learned = self._config.fit.epochs * members * len(data.rows(training=True))
        meter = Meter(self._progress, learned, "rollouts learned", 0)
        fitted = fit(data, self._config.fit, members, seed, lambda n: meter.advance(n, f"round {number}"))
        scale, sample = data.normalisation, data.features[:: max(1, len(data) // _RANGE_ROLLOUTS)]
        low, high = training_range(sample * scale.spread + scale.mean)
        model = CostModel(fitted.network, scale.mean, scale.spread, low, high, data.inputs)
        assert self._test_plans is not None  # noqa: S101 - taken when the data were loaded
        return save_model(path, model, self._card(stamp, data, fitted), self._test_plans)

    def _stamp(self, number: int) -> str:
        """Hash of all that the model of a round is a function of."""
        return fingerprint({"training": described(self._config), "round": number})

    def _loaded(self) -> TrainingSet:
        """All data so far."""
        for world, dataset, rows in self._waiting:
            meter = Meter(self._progress, rows, "rollouts loaded")
            for number, count in enumerate(_rows_of_shards(dataset, rows)):
                rollouts = dataset.read(number).take(slice(0, count))
                self._begun(world, rollouts).add(world, self._config.seed, rollouts)
                meter.advance(count, world.name)
        self._waiting.clear()
        assert self._data is not None  # noqa: S101 - there is at least one world
        return self._data

    def _begun(self, world: World, rollouts: Rollouts) -> TrainingSet:
        """The training set; its scales come from the first shard."""
        if self._data is None:
            plans = trajectories(world, self._config.seed, rollouts.plans)
            inputs = INPUTS[self._config.inputs]
            first = features(plans, inputs)
            scale = Normalisation.of(first)
            self._data = TrainingSet(self._config.capacity, first, inputs, self._config.target, scale)
            self._test_plans = plans.take(np.linspace(0, len(plans) - 1, _TEST_PLANS).astype(np.int64))
        return self._data

    def _card(self, stamp: str, data: TrainingSet, fitted: Fitted) -> ModelCard:
        config, first = self._config, self._config.worlds[0]
        return ModelCard(
            name=config.name,
            vehicle=first.base_vehicle.name,
            vehicle_fingerprint=vehicle_fingerprint(first.base_vehicle, first.loop),
            loop=first.loop,
            worlds=tuple(f"{w.name} v{w.version}" for w in config.worlds),
            parasitic_drag=tuple(first.drag_configurations[d - 1] for d in config.drags),
            speeds=tuple(w.speed for w in config.worlds),
            rollouts=len(data),
            data_hash=stamp,
            snap_weight=config.snap_weight,
            target=config.target,
            validation=validate(data, fitted.network, config.fit.huber_delta),
            learning_curve=fitted.curve,
            calibration=calibration(data, fitted.network),
            versions=versions("numpy", "torch"),
        )


def _rows_of_shards(dataset: Dataset, rows: int) -> list[int]:
    """How many rows to take of each shard, from the first on, `rows` together."""
    whole = dataset.rows(0)
    return shard_rows(rows, whole)


def _copy(source: Path, out: Path) -> None:
    """Whole or not at all."""
    with writing(out) as partial:
        shutil.copyfile(source, partial)
