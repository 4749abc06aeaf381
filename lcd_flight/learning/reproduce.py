"""The paper's table and figures from nothing: data, training, evaluation, and a page that says what came out.

Every stage leaves files in the work folder and finds them there again, so an interrupted run goes on where it stopped:
trainings as `train` does, evaluations method by method and drag by drag.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from lcd_flight.learning.evaluate import evaluate, problem_of, refusals, tasks_of
from lcd_flight.learning.evaluation import Evaluation, EvaluationOptions
from lcd_flight.learning.evaluation_files import Parts
from lcd_flight.learning.experiments import Experiment, Group, experiments
from lcd_flight.learning.progress import ProgressCallback
from lcd_flight.learning.recipes import TrainConfig
from lcd_flight.learning.reproduction_models import BASELINES, model_name, trainings
from lcd_flight.learning.reproduction_settings import DRAGS, ReproduceSettings
from lcd_flight.learning.stages import Stage, StageCallback, Stages
from lcd_flight.learning.train import train
from lcd_flight.model import InputError, Simulator
from lcd_flight.planning.cost.model_file import SUFFIX

_BOOK = "seconds.json"
_SECONDS_PER_ROLLOUT = 4.0e-5
_SECONDS_PER_LESSON = 4.0e-6
"""One rollout learned from once by one network."""
_SECONDS_PER_PLAN = 2.0e-3
"""Of an average method on two cores. These three only share out the time that is left; the run itself corrects them."""


@dataclass(frozen=True, slots=True, eq=False)
class Reproduction:
    """What came out."""

    settings: ReproduceSettings
    experiments: list[Experiment]
    evaluations: dict[str, Evaluation]
    """By the experiment's name."""
    seconds: float
    """That all of it took, interrupted runs included."""

    def in_group(self, group: Group) -> list[Experiment]:
        """The experiments of one group, in order."""
        return [experiment for experiment in self.experiments if experiment.group == group]


def reproduce(settings: ReproduceSettings, work: Path, simulator: Simulator, progress: StageCallback) -> Reproduction:
    """Train and evaluate all there is; `results_page.write_results` makes the page from what this returns.

    Raises:
        InputError: the extra `train` is not installed, a model does not fit, or a file in `work` is damaged or cannot
            be written.
    """
    work = work / "quick" if settings.quick else work
    models, tables = trainings(settings), experiments(settings)
    stages = Stages([*map(_training, models), *(_flights(settings, e) for e in tables)], work / _BOOK, progress)
    shop = _Shop(settings, work, simulator)
    for experiment in tables:
        if experiment.group == "paper":
            shop.check(experiment)
    for number, config in enumerate(models):
        with stages.run(number) as report:
            shop.train(config, report)
    evaluations = {}
    for number, experiment in enumerate(tables, start=len(models)):
        with stages.run(number) as report:
            evaluations[experiment.name] = shop.evaluate(experiment, report)
    return Reproduction(settings, tables, evaluations, stages.seconds)


@dataclass(frozen=True, slots=True)
class _Shop:
    """Where things are made and kept."""

    settings: ReproduceSettings
    work: Path
    simulator: Simulator

    def check(self, experiment: Experiment) -> None:
        """Try out what needs no model of this run, so that nothing is refused after an hour of training.

        Raises:
            InputError: a method cannot be flown.
        """
        waits = (*BASELINES, "learned", "learned-polished") if experiment.trained else ()
        names = [name for name in experiment.methods if name not in waits]
        for error in self._refusals(experiment, experiment.options, names).values():
            raise error

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

    def _refusals(
        self, experiment: Experiment, options: EvaluationOptions, methods: Sequence[str]
    ) -> dict[str, InputError]:
        """Methods that cannot be flown there, and why."""
        one = tasks_of(experiment.world, 1, options)
        return refusals(methods, problem_of(experiment.world, one, self.simulator, options, options.drags[0]))

    def _model(self, experiment: Experiment, drags: tuple[int, ...]) -> str:
        return str(self._path(model_name(self.settings, experiment.world, drags, experiment.recipe)))

    def _path(self, name: str) -> Path:
        return self.work / "models" / f"{name}{SUFFIX}"

    def _flown(self, experiment: Experiment, options: EvaluationOptions, report: ProgressCallback) -> Evaluation:
        tasks = tasks_of(experiment.world, self.settings.count, options)
        parts = Parts.of(self.work / "flights", experiment.world, tasks, options, self.simulator)
        refused = self._refusals(experiment, options, experiment.methods) if experiment.group == "beyond" else {}
        methods = [name for name in experiment.methods if name not in refused]
        return evaluate(experiment.world, methods, tasks, self.simulator, options, report, parts)


def _training(config: TrainConfig) -> Stage:
    lessons = config.capacity * config.fit.epochs * config.members * (config.rounds + 1)
    expected_s = config.capacity * _SECONDS_PER_ROLLOUT + lessons * _SECONDS_PER_LESSON
    return Stage(f"train {config.name}", f"train {config.name}", expected_s)


def _flights(settings: ReproduceSettings, experiment: Experiment) -> Stage:
    plans = settings.count * len(experiment.methods) * len(experiment.options.drags)
    key = f"evaluate {experiment.name}, {settings.count} tasks of seed {settings.seed}, {settings.command}"
    return Stage(f"evaluate {experiment.name}", key, plans * _SECONDS_PER_PLAN)
