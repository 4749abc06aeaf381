"""The paper's table and figures from nothing: data, training, evaluation, and a page that says what came out.

Every stage leaves files in the work folder and finds them there again, so an interrupted run goes on where it stopped:
trainings as `train` does, evaluations method by method and drag by drag.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

from lcd_flight.learning.evaluate import evaluate, tasks_of
from lcd_flight.learning.evaluation import Evaluation, EvaluationOptions
from lcd_flight.learning.evaluation_files import Parts
from lcd_flight.learning.experiments import Experiment, Group, experiments
from lcd_flight.learning.progress import Progress, ProgressCallback
from lcd_flight.learning.recipes import TrainConfig
from lcd_flight.learning.reproduction_models import model_name, trainings
from lcd_flight.learning.reproduction_settings import DRAGS, ReproduceSettings
from lcd_flight.learning.train import train
from lcd_flight.model import Simulator
from lcd_flight.planning.cost.model_file import SUFFIX

_SECONDS_PER_ROLLOUT = 4.0e-5
_SECONDS_PER_LESSON = 4.0e-6
"""One rollout learned from once by one network."""
_SECONDS_PER_PLAN = 2.0e-3
"""Of an average method on two cores. These three only share out the time that is left; the run itself corrects them."""
_FOUND_SHARE = 0.05
"""A stage that took less of what was expected was found done."""


@dataclass(frozen=True, slots=True)
class StageProgress:
    """Where a reproduction stands."""

    stage: int
    """Counted from 1."""
    stages: int
    name: str
    seconds_left: float
    """Of all stages together, from how long those so far took."""
    within: Progress | None = None
    """Where the stage itself stands."""


StageCallback: TypeAlias = Callable[[StageProgress], None]


@dataclass(frozen=True, slots=True, eq=False)
class Reproduction:
    """What came out."""

    settings: ReproduceSettings
    experiments: list[Experiment]
    evaluations: dict[str, Evaluation]
    """By the experiment's name."""
    seconds: float
    """Of this run; less than all where it went on from an earlier one."""

    def in_group(self, group: Group) -> list[Experiment]:
        """The experiments of one group, in order."""
        return [experiment for experiment in self.experiments if experiment.group == group]


def reproduce(settings: ReproduceSettings, work: Path, simulator: Simulator, progress: StageCallback) -> Reproduction:
    """Train and evaluate all there is; `results_page.write_results` makes the page from what this returns.

    Raises:
        InputError: the extra `train` is not installed, a model does not fit, or a file in `work` is damaged or cannot
            be written.
    """
    models, tables = trainings(settings), experiments(settings)
    clock = _Clock([_training_s(config) for config in models] + [_evaluation_s(settings, e) for e in tables], progress)
    shop = _Shop(settings, work / "quick" if settings.quick else work, simulator)
    for config in models:
        with clock.stage(f"train {config.name}") as report:
            shop.train(config, report)
    evaluations = {}
    for experiment in tables:
        with clock.stage(f"evaluate {experiment.name}") as report:
            evaluations[experiment.name] = shop.evaluate(experiment, report)
    return Reproduction(settings, tables, evaluations, clock.elapsed_s)


@dataclass(frozen=True, slots=True)
class _Shop:
    """Where things are made and kept."""

    settings: ReproduceSettings
    work: Path
    simulator: Simulator

    def train(self, config: TrainConfig, report: ProgressCallback) -> None:
        """Make a model, or find it made."""
        folder = self.work / "training" / config.name
        train(config, folder, self._path(config.name), self.simulator, report)

    def evaluate(self, experiment: Experiment, report: ProgressCallback) -> Evaluation:
        """Fly one table; drag by drag where each configuration has a model of its own."""
        options = experiment.options
        if not experiment.trained:
            return self._flown(experiment, options, report)
        if not self.settings.per_drag or experiment.recipe:
            return self._flown(experiment, replace(options, model=self._model(experiment, DRAGS)), report)
        single = [replace(options, drags=(d,), model=self._model(experiment, (d,))) for d in options.drags]
        return Evaluation.beside([self._flown(experiment, o, report) for o in single])

    def _model(self, experiment: Experiment, drags: tuple[int, ...]) -> str:
        return str(self._path(model_name(self.settings, experiment.world, drags, experiment.recipe)))

    def _path(self, name: str) -> Path:
        return self.work / "models" / f"{name}{SUFFIX}"

    def _flown(self, experiment: Experiment, options: EvaluationOptions, report: ProgressCallback) -> Evaluation:
        tasks = tasks_of(experiment.world, self.settings.count, options)
        parts = Parts.of(self.work / "flights", experiment.world, tasks, options, self.simulator)
        return evaluate(experiment.world, experiment.methods, tasks, self.simulator, options, report, parts)


class _Clock:
    """Tells stages and the time that is left; what earlier runs had done does not count into the pace."""

    def __init__(self, expected_s: list[float], tell: StageCallback) -> None:
        self._expected_s, self._tell = expected_s, tell
        self._stage = 0
        self._took_s = self._counted_s = 0.0
        self._began_s = time.monotonic()

    @property
    def elapsed_s(self) -> float:
        """Since this run began."""
        return time.monotonic() - self._began_s

    @contextmanager
    def stage(self, name: str) -> Iterator[ProgressCallback]:
        """The next stage; gives what the stage tells its own progress to."""
        began_s, expected_s = time.monotonic(), self._expected_s[self._stage]
        self._stage += 1

        def report(within: Progress | None) -> None:
            left_s = self._left_s(time.monotonic() - began_s)
            self._tell(StageProgress(self._stage, len(self._expected_s), name, left_s, within))

        report(None)
        yield report
        took_s = time.monotonic() - began_s
        if took_s > _FOUND_SHARE * expected_s:
            self._took_s, self._counted_s = self._took_s + took_s, self._counted_s + expected_s

    def _left_s(self, in_stage_s: float) -> float:
        pace = self._took_s / self._counted_s if self._counted_s else 1.0
        present_s = pace * self._expected_s[self._stage - 1]
        return max(present_s - in_stage_s, 0.1 * present_s) + pace * sum(self._expected_s[self._stage :])


def _training_s(config: TrainConfig) -> float:
    lessons = config.capacity * config.fit.epochs * config.members * (config.rounds + 1)
    return config.capacity * _SECONDS_PER_ROLLOUT + lessons * _SECONDS_PER_LESSON


def _evaluation_s(settings: ReproduceSettings, experiment: Experiment) -> float:
    return settings.count * len(experiment.methods) * len(experiment.options.drags) * _SECONDS_PER_PLAN
