"""The models that `lcd reproduce` trains: the learned cost, the baselines beside it, and those that teach a lesson."""

from __future__ import annotations

from dataclasses import replace

from lcd_flight.learning.methods import baseline_model, shipped_model
from lcd_flight.learning.recipes import RECIPES, TrainConfig
from lcd_flight.learning.reproduction_settings import DRAGS, ReproduceSettings, paper_worlds
from lcd_flight.model import World

BASELINES = {"paper": "paper-code", "mlp-knots": "mlp-knots"}
"""Methods with a model of their own, and its recipe; both see whole trajectories of four waypoints only."""
LESSONS = ("optima-only", "convex")
"""Recipes whose models plan in the learned one's place: what data and networks are worth. For the Crazyflie alone."""
LESSON_WORLD = "crazyflie-saturated"


def trainings(settings: ReproduceSettings) -> list[TrainConfig]:
    """One for the worlds of each vehicle, over all drag configurations or one for each; baselines; lessons."""
    if settings.models == "shipped":
        return []
    by_model: dict[str, list[World]] = {}
    for world in paper_worlds():
        by_model.setdefault(shipped_model(world), []).append(world)
    groups = [(drag,) for drag in DRAGS] if settings.per_drag else [DRAGS]
    found = []
    for worlds in by_model.values():
        taught = LESSONS if LESSON_WORLD in [world.name for world in worlds] else ()
        found += [_config(settings, worlds, drags, r) for drags in groups for r in ("", *BASELINES.values())]
        found += [_config(settings, worlds, DRAGS, recipe) for recipe in taught]
    return found


def model_name(settings: ReproduceSettings, world: World, drags: tuple[int, ...], recipe: str = "") -> str:
    """Of the model for a world's vehicle and loop, over these drag configurations.

    recipe: of a baseline or a lesson; the run's own recipe otherwise.
    """
    name = shipped_model(world) + ("" if drags == DRAGS else f"-drag-{drags[0]}") + f"-{settings.recipe}"
    return baseline_model(name, recipe) if recipe else name


def _config(settings: ReproduceSettings, worlds: list[World], drags: tuple[int, ...], recipe: str) -> TrainConfig:
    make = RECIPES[recipe or settings.recipe]
    config = replace(make(model_name(settings, worlds[0], drags, recipe), tuple(worlds)), drags=drags)
    if not settings.quick:
        return config
    return replace(
        config,
        count=2048,
        rounds=min(config.rounds, 1),
        policy_tasks=8,
        members=1,
        mix=replace(config.mix, shard_rows=2048),
        policy=replace(config.policy, block=8, hardest=1),
        fit=replace(config.fit, epochs=1),
    )
