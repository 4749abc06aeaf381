"""What `lcd reproduce` flies: the paper's experiment in three worlds, what explains it, and what goes beyond it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

from lcd_flight.learning.evaluation import EvaluationOptions
from lcd_flight.learning.methods import METHODS, baseline_model, shipped_model
from lcd_flight.learning.reproduction_models import BASELINES, LESSON_WORLD, LESSONS
from lcd_flight.learning.reproduction_settings import MIDDLE_DRAG, WORLDS, ReproduceSettings, paper_worlds
from lcd_flight.model import World
from lcd_flight.planning.cost.model_file import model_names
from lcd_flight.planning.planner import Timing
from lcd_flight.worlds import load_world

TIMINGS: tuple[Timing, ...] = ("fixed", "retimed")

Group: TypeAlias = Literal["paper", "probe", "lesson", "beyond", "shipped"]
"""`probe`: minimum snap in changed worlds, for what decides its crash rate. `lesson`: models made otherwise."""


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
    recipe: str = ""
    """Of the model that this run has trained, where it is not the run's own."""


def experiments(settings: ReproduceSettings) -> list[Experiment]:
    """All of them, the paper's first."""
    paper = _paper(settings)
    return [*paper, *_probes(settings), *_lessons(settings, paper), *_beyond(paper), *_shipped(settings, paper)]


def _paper(settings: ReproduceSettings) -> list[Experiment]:
    """The paper's experiment in three worlds, with times fixed as there, and re-timed."""
    return [
        Experiment(
            name=f"{world.name}-{timing}",
            title="",
            group="paper",
            world=world,
            methods=_methods(settings, world),
            options=EvaluationOptions(settings.seed, timing, settings.drags, settings.noise_seeds),
            trained=settings.models == "train",
        )
        for world in paper_worlds()
        for timing in TIMINGS
    ]


def _methods(settings: ReproduceSettings, world: World) -> tuple[str, ...]:
    """All there are; of the baselines with a model of their own, those whose model is to be had."""
    missing = {
        name
        for name, recipe in BASELINES.items()
        if settings.models == "shipped" and baseline_model(shipped_model(world), recipe) not in model_names()
    }
    return tuple(name for name in METHODS if name not in missing)


def _probes(settings: ReproduceSettings) -> list[Experiment]:
    """Minimum snap in worlds that differ in one thing each: why crash rates disagree."""
    paper, saturated, hummingbird = paper_worlds()
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


def _lessons(settings: ReproduceSettings, paper: list[Experiment]) -> list[Experiment]:
    """The learned method with models that were made otherwise."""
    if settings.models == "shipped":
        return []
    return [
        replace(
            experiment,
            name=f"{experiment.name}-{recipe}",
            title=recipe,
            group="lesson",
            methods=("learned",),
            options=_middle(experiment),
            recipe=recipe,
        )
        for experiment in paper
        if experiment.world.name == LESSON_WORLD
        for recipe in LESSONS
    ]


def _beyond(paper: list[Experiment]) -> list[Experiment]:
    """Longer tasks, a weaker vehicle than planned for, yaw by the short way, and the flight loop."""
    base = {e.name: replace(e, group="beyond", options=_middle(e)) for e in paper}
    longer = [_with_waypoints(base[f"crazyflie-saturated-{timing}"], 10) for timing in TIMINGS]
    weaker = [
        _varied(base[f"{name}-retimed"], "thrust 5 % lower than planned for", thrust_share=0.95) for name in WORLDS
    ]
    shorter = [_varied(base[f"{name}-retimed"], "yaw by the short way", yaw="short") for name in WORLDS]
    flight = [_in_flight_loop(base[f"crazyflie-paper-{timing}"]) for timing in TIMINGS]
    return [*longer, *weaker, *shorter, *flight]


def _shipped(settings: ReproduceSettings, paper: list[Experiment]) -> list[Experiment]:
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
        for experiment in paper
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
        methods=_without_baselines(base),
        world=replace(base.world, sampler=sampler),
    )


def _in_flight_loop(base: Experiment) -> Experiment:
    """The flight loop, which the paper's hardware has and its simulation has not; its model ships."""
    world = load_world("crazyflie-flight")
    return replace(
        base,
        name=f"{world.name}-{base.options.timing}",
        title="flight loop",
        methods=_without_baselines(base),
        world=world,
        trained=False,
    )


def _without_baselines(base: Experiment) -> tuple[str, ...]:
    """Its methods but those whose models serve the paper's tasks alone."""
    return tuple(name for name in base.methods if name not in BASELINES)
