"""What `lcd reproduce` trains and flies: the paper's experiment in three worlds, and what goes beyond it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

from lcd_flight.learning.evaluation import EvaluationOptions
from lcd_flight.learning.methods import METHODS, shipped_model
from lcd_flight.learning.recipes import RECIPES, TrainConfig
from lcd_flight.model import InputError, World
from lcd_flight.planning.cost.model_file import model_names
from lcd_flight.planning.planner import Timing
from lcd_flight.worlds import load_world

WORLDS = ("crazyflie-paper", "crazyflie-saturated", "hummingbird-paper")
"""The paper's setting as written, the same where minimum snap crashes as often as reported, the released code's."""
DRAGS = (1, 2, 3, 4, 5)
MIDDLE_DRAG = 3
COUNT, QUICK_COUNT = 1000, 4
"""Tasks of each world, unless said otherwise."""
_NOISE_SEEDS = 3
TIMINGS: tuple[Timing, ...] = ("fixed", "retimed")

Models: TypeAlias = Literal["train", "shipped"]
Group: TypeAlias = Literal["paper", "probe", "beyond", "shipped"]
"""`probe`: minimum snap in changed worlds, for what decides its crash rate."""


@dataclass(frozen=True, slots=True)
class ReproduceSettings:
    """What is reproduced, and how large."""

    seed: int
    """Of tasks and noise."""
    count: int = COUNT
    """Tasks of each world."""
    noise_seeds: int = _NOISE_SEEDS
    recipe: str = "medium"
    """How the models are trained, by name (`recipes.py`)."""
    per_drag: bool = False
    """One model for each drag configuration, as the paper has them, in place of one over all."""
    models: Models = "train"
    """`shipped` evaluates the models that ship and trains nothing."""
    quick: bool = False
    """A tiny run of every step, for tests: its figures mean nothing."""

    @property
    def drags(self) -> tuple[int, ...]:
        """Configurations that the paper's experiment is flown in."""
        return (MIDDLE_DRAG,) if self.quick else DRAGS

    @property
    def command(self) -> str:
        """The command line that makes the same again."""
        words = {
            f"--count {self.count}": self.count != (QUICK_COUNT if self.quick else COUNT),
            f"--noise-seeds {self.noise_seeds}": self.noise_seeds != _NOISE_SEEDS,
            f"--recipe {self.recipe}": self.models == "train",
            "--models shipped": self.models == "shipped",
            "--per-drag": self.per_drag,
            "--quick": self.quick,
        }
        return " ".join(["lcd reproduce", *(word for word, said in words.items() if said)])

    def __post_init__(self) -> None:
        """Check before hours are spent.

        Raises:
            InputError: no such recipe, or counts that are not positive.
        """
        if self.recipe not in RECIPES:
            raise InputError(f"recipe {self.recipe}: choose one of {', '.join(RECIPES)}")
        if self.count < 2 or self.noise_seeds < 1:
            raise InputError(f"{self.count} tasks x {self.noise_seeds} noise seeds: give at least 2 tasks and 1 seed")
        if self.per_drag and self.models == "shipped":
            raise InputError("one model for each drag configuration does not ship: leave out --per-drag or train")


@dataclass(frozen=True, slots=True)
class Experiment:
    """One table: methods on the tasks of one world."""

    name: str
    """Unique, for files."""
    title: str
    """What is special about it, for the page; empty in the paper's own experiment."""
    group: Group
    world: World
    methods: tuple[str, ...]
    options: EvaluationOptions
    trained: bool
    """Whether its model is one that this run has trained; else it ships."""


def experiments(settings: ReproduceSettings) -> list[Experiment]:
    """All of them, the paper's first."""
    return [*_paper(settings), *_probes(settings), *_beyond(settings), *_shipped(settings)]


def trainings(settings: ReproduceSettings) -> list[TrainConfig]:
    """The models to train: one for the worlds of each vehicle, over all drag configurations or one for each."""
    if settings.models == "shipped":
        return []
    by_model: dict[str, list[World]] = {}
    for world in _worlds():
        by_model.setdefault(shipped_model(world), []).append(world)
    groups = [(drag,) for drag in DRAGS] if settings.per_drag else [DRAGS]
    return [_training(settings, tuple(worlds), drags) for worlds in by_model.values() for drags in groups]


def model_name(world: World, drags: tuple[int, ...]) -> str:
    """Of a model that is trained over these drag configurations, for a world's vehicle and loop."""
    return shipped_model(world) + ("" if drags == DRAGS else f"-drag-{drags[0]}")


def _worlds() -> list[World]:
    return [load_world(name) for name in WORLDS]


def _training(settings: ReproduceSettings, worlds: tuple[World, ...], drags: tuple[int, ...]) -> TrainConfig:
    recipe = replace(RECIPES[settings.recipe](model_name(worlds[0], drags), worlds), drags=drags)
    if not settings.quick:
        return recipe
    mix, fit = replace(recipe.mix, shard_rows=4096), replace(recipe.fit, epochs=1)
    return replace(recipe, count=4096, rounds=1, policy_tasks=32, members=1, mix=mix, fit=fit)


def _paper(settings: ReproduceSettings) -> list[Experiment]:
    """The paper's experiment in three worlds, with times fixed as there, and re-timed."""
    return [
        Experiment(
            name=f"{world.name}-{timing}",
            title="",
            group="paper",
            world=world,
            methods=tuple(METHODS),
            options=EvaluationOptions(settings.seed, timing, settings.drags, settings.noise_seeds),
            trained=settings.models == "train",
        )
        for world in _worlds()
        for timing in TIMINGS
    ]


def _probes(settings: ReproduceSettings) -> list[Experiment]:
    """Minimum snap in worlds that differ in one thing each: why crash rates disagree."""
    paper, saturated, hummingbird = _worlds()
    slow_motors = replace(paper.base_vehicle, motor_time_constant_s=0.072)
    quiet = replace(paper.base_vehicle, motor_noise=0.0)
    boundless = replace(saturated.base_vehicle, rotor_speed_max=4.0 * saturated.base_vehicle.rotor_speed_max)
    changed = {
        "motors of 72 ms in place of 5 ms": replace(paper, base_vehicle=slow_motors),
        "no motor noise": replace(paper, base_vehicle=quiet),
        "2.25 m/s": replace(paper, speed=2.25),
        "2.5 m/s": replace(paper, speed=2.5),
        "no upper motor limit": replace(saturated, base_vehicle=boundless),
        "all yaws zero": replace(hummingbird, sampler=replace(hummingbird.sampler, yaw_span_rad=0.0)),
        "start at yaw zero": replace(hummingbird, start_aligned=False),
    }
    options = EvaluationOptions(settings.seed, "fixed", (MIDDLE_DRAG,), settings.noise_seeds)
    return [
        Experiment(f"probe-{number}", title, "probe", world, ("minimum-snap",), options, trained=False)
        for number, (title, world) in enumerate(changed.items(), start=1)
    ]


def _beyond(settings: ReproduceSettings) -> list[Experiment]:
    """Longer tasks, a weaker vehicle than planned for, yaw by the short way, and the flight loop."""
    base = {e.name: replace(e, group="beyond", options=_middle(e)) for e in _paper(settings)}
    longer = [_with_waypoints(base[f"crazyflie-saturated-{timing}"], 10) for timing in TIMINGS]
    weaker = [
        _varied(base[f"{name}-retimed"], "thrust 5 % lower than planned for", thrust_share=0.95) for name in WORLDS
    ]
    shorter = [_varied(base[f"{name}-retimed"], "yaw by the short way", yaw="short") for name in WORLDS]
    flight = [_in_flight_loop(base[f"crazyflie-paper-{timing}"]) for timing in TIMINGS]
    return [*longer, *weaker, *shorter, *flight]


def _shipped(settings: ReproduceSettings) -> list[Experiment]:
    """The models that ship, beside those that this run has trained."""
    if settings.models == "shipped":
        return []
    return [
        replace(
            experiment,
            name=f"{experiment.name}-shipped",
            title="the model that ships",
            group="shipped",
            methods=tuple(name for name in METHODS if name.startswith("learned")),
            options=_middle(experiment),
            trained=False,
        )
        for experiment in _paper(settings)
        if shipped_model(experiment.world) in model_names()
    ]


def _middle(experiment: Experiment) -> EvaluationOptions:
    return replace(experiment.options, drags=(MIDDLE_DRAG,))


def _varied(base: Experiment, title: str, **change: Any) -> Experiment:
    """The same with another option."""
    (key,) = change
    return replace(base, name=f"{base.name}-{key}", title=title, options=replace(base.options, **change))


def _with_waypoints(base: Experiment, waypoints: int) -> Experiment:
    """Tasks with another number of waypoints."""
    sampler = replace(base.world.sampler, waypoints=waypoints)
    return replace(
        base,
        name=f"{base.name}-{waypoints}-waypoints",
        title=f"{waypoints} waypoints",
        world=replace(base.world, sampler=sampler),
    )


def _in_flight_loop(base: Experiment) -> Experiment:
    """The flight loop, which the paper's hardware has and its simulation has not; its model ships."""
    world = load_world("crazyflie-flight")
    return replace(base, name=f"{world.name}-{base.options.timing}", title="flight loop", world=world, trained=False)
