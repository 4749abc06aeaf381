"""Evaluations on disk: finished parts to go on from, and every flight as a row of a Parquet file."""

from __future__ import annotations

import hashlib
import inspect
import sys
from contextlib import suppress
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from lcd_flight.files import writing
from lcd_flight.learning.evaluation import Evaluation, EvaluationOptions, MethodRun
from lcd_flight.learning.extras import require_pyarrow
from lcd_flight.learning.fingerprint import described, fingerprint
from lcd_flight.learning.freshness import hash_of_files, planner_sources
from lcd_flight.model import InputError, Simulator, Tasks, World
from lcd_flight.planning.cost.model_file import MODELS, SUFFIX

_HOUSE = Path(__file__).parents[1]
_FLIES = ("control", "model", "worlds")
"""Rooms whose code decides how plans are flown, beside the simulator's."""


@dataclass(frozen=True, slots=True)
class Parts:
    """What one evaluation has finished, a file for each method and drag configuration, in a folder of its own."""

    folder: Path

    @staticmethod
    def of(root: Path, world: World, tasks: Tasks, options: EvaluationOptions, simulator: Simulator) -> Parts:
        """The folder below `root` that belongs to just this evaluation: its name is a hash of all that decides it.

        That includes the sources that plan and fly, so that a changed program never goes on from old results.
        """
        decides = {
            "world": described(world),
            "options": described(options),
            "tasks": hash_of_tasks(tasks),
            "sources": hash_of_files(_sources(simulator)),
            "models": hash_of_files(_models(options)),
        }
        return Parts(root / fingerprint(decides))

    def load(self, method: str, drag: int) -> MethodRun | None:
        """A finished part; None where there is none.

        Raises:
            InputError: its file is damaged.
        """
        path = self._path(method, drag)
        if not path.exists():
            return None
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
                arrays: dict[str, Any] = {f.name: archive[f.name] for f in fields(MethodRun)}
        except (OSError, ValueError, KeyError, EOFError, BadZipFile) as error:
            raise InputError(f"{path}: damaged ({error}); delete it and run the same command again") from error
        return MethodRun(**(arrays | {"plan_seconds": float(arrays["plan_seconds"])}))

    def save(self, method: str, drag: int, run: MethodRun) -> None:
        """Keep a finished part, whole or not at all.

        Raises:
            InputError: the folder cannot be written to.
        """
        arrays: dict[str, Any] = {f.name: np.asarray(getattr(run, f.name)) for f in fields(MethodRun)}
        with writing(self._path(method, drag)) as partial, partial.open("wb") as file:
            np.savez(file, **arrays)

    def discard(self) -> None:
        """Delete what was kept: the evaluation is complete."""
        for path in self.folder.glob("*.npz"):
            path.unlink()
        with suppress(OSError):
            self.folder.rmdir()

    def _path(self, method: str, drag: int) -> Path:
        return self.folder / f"{method}-drag-{drag}.npz"


def hash_of_tasks(tasks: Tasks) -> str:
    """SHA-256 of the waypoints and yaws, to tell whether two evaluations flew the same."""
    return hashlib.sha256(np.ascontiguousarray(tasks.poses).tobytes()).hexdigest()


def write_flights(path: Path, evaluations: list[Evaluation]) -> None:
    """Every flight as a row: world, method, drag, task, noise, and what came of it. Equal flights give equal bytes.

    Raises:
        InputError: pyarrow is not installed, or the file cannot be written.
    """
    pyarrow, parquet = require_pyarrow()
    tables = [pyarrow.table(_columns(e, name)) for e in evaluations for name in e.runs]
    with writing(path) as partial:
        parquet.write_table(pyarrow.concat_tables(tables), partial, compression="zstd")


def _columns(evaluation: Evaluation, method: str) -> dict[str, Any]:
    """The flights of one method, task by task, drag by drag, noise by noise."""
    run, options = evaluation.runs[method], evaluation.options
    shape = run.crashed.shape
    task, drag, noise = np.indices(shape)
    plan = {name: np.broadcast_to(getattr(run, name)[:, :, None], shape) for name in ("relative_snap", "fell_back")}
    flight = {name: getattr(run, name) for name in ("crashed", "max_error_m", "waypoint_error_m", "saturation_share")}
    count = run.crashed.size
    words = {"world": evaluation.world, "method": method, "timing": options.timing, "yaw": options.yaw}
    numbers = {
        "thrust_share": np.full(shape, options.thrust_share),
        "drag": np.array(options.drags, dtype=np.int8)[drag],
        "task": task.astype(np.int32),
        "noise": noise.astype(np.int16),
        "noise_seed": np.broadcast_to(evaluation.noise[:, None, :], shape),
    }
    columns = {name: np.ascontiguousarray(values).reshape(-1) for name, values in (numbers | flight | plan).items()}
    return {name: [word] * count for name, word in words.items()} | columns


def _sources(simulator: Simulator) -> list[Path]:
    """The code that an evaluation's result depends on."""
    module = sys.modules[type(simulator).__module__.partition(".")[0]]
    file = Path(inspect.getfile(module))
    flies = list(file.parent.rglob("*.py")) if hasattr(module, "__path__") else [file]
    return [*planner_sources(), *flies, *(path for room in _FLIES for path in (_HOUSE / room).rglob("*.py"))]


def _models(options: EvaluationOptions) -> list[Path]:
    """Every model that ships, and the one that was named."""
    given = [Path(options.model)] if options.model and options.model.endswith(SUFFIX) else []
    return [*MODELS.glob(f"*{SUFFIX}"), *(path for path in given if path.is_file())]
