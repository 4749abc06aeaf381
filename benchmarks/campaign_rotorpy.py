"""Our simulator against RotorPy 3.0.0, at length: paths without noise, crash rates with it.

Each part is kept under data/campaigns once it is done: an interrupted campaign goes on where it stopped.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from lcd_flight.learning.sampling import first_tasks
from lcd_flight.model import RolloutOptions, Trajectories, World
from lcd_flight.planning.minimum_snap import minimum_snap_batch
from lcd_flight.worlds import load_world
from sim_bridge.rollouts import MultirotorSimulator
from sim_bridge.trace import trace

PARTS = Path(__file__).parents[1] / "data" / "campaigns" / "rotorpy-crash-rates"
SEED = 4242
KNOWN = {"crazyflie-paper": (8.7, 0.9), "crazyflie-saturated": (39.9, 1.5), "hummingbird-paper": (45.4, 1.5)}
"""Crashes of minimum snap in % and their standard error, 1,000 tasks x 3 noise seeds (decision 0040)."""
CALM_SPEED = 1.1
"""m/s at which most Crazyflie flights do not saturate."""


def rotorpy_crash_rates(
    flights: int = 50, rows: int = 3, tasks: int = 500, batch: int = 500, parts: Path = PARTS
) -> dict[str, Any]:
    """Largest differences in m without noise, and crashes in % with it, of the same plans.

    flights: compared one by one without noise; rows: held to RotorPy's batched form; tasks: with noise in each world.
    """
    import torch

    torch.set_num_threads(1)
    parts.mkdir(parents=True, exist_ok=True)
    paths = _kept(parts, f"paths-{flights}", lambda: _differences(flights))
    batched = _kept(parts, f"batched-{rows}", lambda: _batched_against_single(rows))
    worlds = {name: _crash_rates(parts, load_world(name), tasks, batch) for name in KNOWN}
    return {
        "seed": SEED,
        "summary": {
            "largest_difference_m": max(paths),
            "batched_against_single_m": max(batched),
            **{name: {"ours": w["ours_percent"], "RotorPy": w["rotorpy_percent"]} for name, w in worlds.items()},
        },
        "differences_m": paths,
        "batched_against_single_m": batched,
        "worlds": worlds,
    }


def _kept(folder: Path, name: str, measure: Callable[[], list[Any]]) -> list[Any]:
    """What was measured before, or now."""
    path = folder / f"{name}.json"
    if not path.exists():
        print(f"rotorpy-crash-rates: {name}", flush=True)  # noqa: T201
        unfinished = path.with_suffix(".tmp")
        unfinished.write_text(json.dumps(measure()))
        unfinished.replace(path)
    values: list[Any] = json.loads(path.read_text())
    return values


def _plans(world: World, speed: float, count: int, seed: int = SEED) -> Trajectories:
    tasks = first_tasks(world.sampler, seed, count)
    return minimum_snap_batch(tasks.poses, tasks.durations_s(speed))


def _differences(count: int) -> list[float]:
    """Largest distance in m of each of `count` Crazyflie flights, noise off, that do not saturate."""
    from sim_bridge import rotorpy_adapter

    world = load_world("crazyflie-paper")
    vehicle = replace(world.vehicle(3), motor_noise=0.0)
    plans = _plans(world, CALM_SPEED, 4 * count)
    seeds = np.zeros(len(plans), dtype=np.uint64)
    calm = MultirotorSimulator().rollout(plans, vehicle, seeds, RolloutOptions()).saturation_share == 0.0
    found = []
    for row in np.nonzero(calm)[0][:count]:
        plan = plans[int(row)]
        ours = trace(plan, vehicle, 0, RolloutOptions()).p_WB
        theirs = rotorpy_adapter.fly(plan, vehicle, 0).p_WB
        found.append(float(np.linalg.norm(ours - theirs, axis=1).max()))
    if len(found) < count:
        raise ValueError(f"only {len(found)} of {len(plans)} flights do not saturate")
    return found


def _batched_against_single(count: int) -> list[float]:
    """Largest distance in m between its two forms, noise off, of `count` flights."""
    from benchmarks.rotorpy_batched import fly_batch
    from sim_bridge import rotorpy_adapter

    world = load_world("crazyflie-paper")
    vehicle = replace(world.vehicle(3), motor_noise=0.0)
    plans = _plans(world, CALM_SPEED, count)
    batched = fly_batch(plans, vehicle, 0).p_WB
    single = [rotorpy_adapter.fly(plan, vehicle, 0).p_WB for plan in plans]
    return [float(np.linalg.norm(batched[: len(p), row] - p, axis=1).max()) for row, p in enumerate(single)]


def _crash_rates(parts: Path, world: World, count: int, batch: int) -> dict[str, Any]:
    """Both sides' crashes in a world, each with its own noise."""
    from benchmarks.rotorpy_batched import fly_batch

    plans, vehicle = _plans(world, world.speed, count), world.vehicle(3)

    def flown(first: int) -> list[bool]:
        some = plans.take(range(first, min(first + batch, count)))
        return [bool(c) for c in fly_batch(some, vehicle, first, start_aligned=world.start_aligned).crashed]

    name = f"{world.name}-v{world.version}"
    theirs = [c for first in range(0, count, batch) for c in _kept(parts, f"{name}-{first}", lambda f=first: flown(f))]
    options = RolloutOptions(loop=world.loop, start_aligned=world.start_aligned)
    seeds = np.arange(count, dtype=np.uint64)
    ours = MultirotorSimulator().rollout(plans, vehicle, seeds, options).crashed
    share = 0.5 * (float(np.mean(theirs)) + float(ours.mean()))
    return {
        "version": world.version,
        "tasks": count,
        "ours_percent": round(100.0 * float(ours.mean()), 1),
        "rotorpy_percent": round(100.0 * float(np.mean(theirs)), 1),
        "standard_error_of_the_difference": round(100.0 * float(np.sqrt(2.0 * share * (1.0 - share) / count)), 1),
        "crash_in_both": int(np.sum(ours & np.array(theirs))),
        "known_percent": KNOWN[world.name][0],
        "known_standard_error": KNOWN[world.name][1],
    }
