"""Many tasks planned by one method, block by block: it shows where it is, can be stopped, and goes on from there."""

from __future__ import annotations

import inspect
import os
import shutil
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lcd_flight.learning.evaluation_files import hash_of_tasks
from lcd_flight.learning.fingerprint import described, fingerprint, versions
from lcd_flight.learning.freshness import hash_of_files
from lcd_flight.learning.methods import Method, Problem, find_method, shipped_model
from lcd_flight.learning.plan_files import PlannedTasks, load_plans, save_plans
from lcd_flight.learning.progress import Meter, ProgressCallback, ignore
from lcd_flight.mission.airframe import top_speed_m_per_s
from lcd_flight.model import InputError, Simulator, Tasks, Trajectories, Vehicle, World
from lcd_flight.planning.cost.model_file import MODELS, SUFFIX
from lcd_flight.planning.planner import Timing
from lcd_flight.worlds import fingerprint as vehicle_fingerprint

_BLOCK_SEGMENTS = 600
"""Planned between two reports and two savings: a second or two."""
_HOUSE = Path(__file__).parents[1]


@dataclass(frozen=True, slots=True)
class TaskPlanning:
    """How tasks are planned, beside the tasks themselves."""

    world: World
    method: str
    timing: Timing = "retimed"
    drag: int = 3
    """Configuration that is planned for, counted from 1."""
    model: str | None = None
    """Name or path of the learned cost; None: the one that ships for the world's vehicle and loop."""
    seed: int = 0
    """Of a method's own random choices."""

    @property
    def vehicle(self) -> Vehicle:
        """What is planned for.

        Raises:
            InputError: there is no such drag configuration, or the vehicle cannot reach the world's speed.
        """
        try:
            vehicle = self.world.vehicle(self.drag)
        except IndexError as error:
            raise InputError(f"no drag configuration {self.drag}: {error}") from error
        top = top_speed_m_per_s(vehicle)
        if self.world.speed > top:
            speed, name = f"{self.world.speed:g} m/s", vehicle.name
            raise InputError(
                f"world {self.world.name}: {speed} is above {top:.1f} m/s, the fastest that a {name} can fly level; "
                "lower it"
            )
        return vehicle


def plan_tasks(
    tasks: Tasks, planning: TaskPlanning, out: Path, simulator: Simulator, progress: ProgressCallback = ignore
) -> PlannedTasks:
    """Plan all tasks and write them to `out` (`plan_files`), whole or not at all.

    Finished blocks are kept beside it until then (`.NAME.blocks`), under a hash of all that they depend on.

    Raises:
        InputError: no such method or drag configuration, a model that is missing or does not fit, waypoints that make
            no trajectory, or a place that cannot be written to.
    """
    if out.suffix != ".npz" or out.is_dir():
        raise InputError(f"{out}: plans go to a file whose name ends in .npz")
    method, problem = find_method(planning.method), _problem(tasks, planning, simulator)
    about = _about(planning, problem)
    folder = out.with_name(f".{out.name}.blocks") / fingerprint({**about, "tasks": hash_of_tasks(tasks)})
    trial = method(problem.take(np.arange(1)))  # says what is missing before any work, and loads the kernels once
    parts = _planned(method, problem, folder, Meter(progress, len(tasks), "tasks"))
    plans = _joined(parts, {**about, "controller": trial.controller})
    save_plans(out, plans)
    shutil.rmtree(folder.parent, ignore_errors=True)
    return plans


def _planned(method: Method, problem: Problem, folder: Path, meter: Meter) -> list[PlannedTasks]:
    """All blocks, side by side on all cores; a task's plan does not depend on its block."""
    parts = []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        work = [
            pool.submit(_block, method, problem.take(rows), folder / f"{number:05d}.npz")
            for number, rows in enumerate(_blocks(problem.tasks))
        ]
        try:
            for block in work:
                parts.append(block.result())
                meter.advance(len(parts[-1]))
        except BaseException:  # above all KeyboardInterrupt: what has not begun is not planned any more
            pool.shutdown(wait=True, cancel_futures=True)
            raise
    return parts


def _block(method: Method, problem: Problem, kept: Path) -> PlannedTasks:
    """One block: from an earlier run, or planned and kept."""
    if not kept.exists():
        planned = method(problem)
        save_plans(kept, PlannedTasks(planned.plans, planned.fell_back))
    return load_plans(kept)


def _problem(tasks: Tasks, planning: TaskPlanning, simulator: Simulator) -> Problem:
    return Problem(
        world=planning.world,
        vehicle=planning.vehicle,
        tasks=tasks,
        indices=np.arange(len(tasks)),
        timing=planning.timing,
        simulator=simulator,
        seed=planning.seed,
        model=planning.model or shipped_model(planning.world),
    )


def _blocks(tasks: Tasks) -> Iterator[Any]:
    """Row numbers of each block."""
    step = max(1, _BLOCK_SEGMENTS // (tasks.yaws_rad.shape[1] - 1))
    return (np.arange(first, min(first + step, len(tasks))) for first in range(0, len(tasks), step))


def _about(planning: TaskPlanning, problem: Problem) -> dict[str, Any]:
    """What the plans depend on, beside the tasks: who flies them elsewhere needs it, and going on is bound to it."""
    world = planning.world
    return {
        "world": f"{world.name} v{world.version}",
        "speed": world.speed,
        "loop": world.loop,
        "vehicle": described(problem.vehicle),
        "vehicle_fingerprint": vehicle_fingerprint(problem.vehicle, world.loop),
        "start_aligned": world.start_aligned,
        **{name: value for name, value in asdict(planning).items() if name in ("method", "timing", "drag", "seed")},
        "model": problem.model,
        "model_sha256": _hash_of_model(problem.model),
        "sources": [hash_of_files(folder.rglob("*.py"), folder)[:16] for folder in _sources(problem.simulator)],
        "versions": versions("numpy", "numba"),
    }


def _hash_of_model(model: str) -> str | None:
    """Of its file; None where there is none, which a method that needs it will tell."""
    path = Path(model) if model.endswith(SUFFIX) else MODELS / f"{model}{SUFFIX}"
    return hash_of_files([path]) if path.is_file() else None


def _sources(simulator: Simulator) -> list[Path]:
    """Folders of the code that makes plans what they are."""
    package = sys.modules[type(simulator).__module__.partition(".")[0]]
    return [_HOUSE / "planning", _HOUSE / "learning", Path(inspect.getfile(package)).parent]


def _joined(parts: list[PlannedTasks], about: dict[str, Any]) -> PlannedTasks:
    return PlannedTasks(
        Trajectories(
            np.concatenate([part.trajectories.durations_s for part in parts]),
            np.concatenate([part.trajectories.coefficients for part in parts]),
        ),
        np.concatenate([part.fell_back for part in parts]),
        about,
    )
