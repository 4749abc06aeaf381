"""Planned trajectories kept for the next time, by the hash of what they depend on (`plan_key`).

It can only help: what is damaged is removed and planned anew, what cannot be written is not kept, and both are said.
A kept plan is checked like one from a user's file before it is believed.
"""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from pydantic import ValidationError

from lcd_flight.files import write_whole
from lcd_flight.jit import cache_folder
from lcd_flight.mission.assemble import TrajectoryTask
from lcd_flight.mission.plan_record import PlanRecord, first_error
from lcd_flight.mission.solution import Solution
from lcd_flight.model import InputError

MOST_PLANS = 256
MOST_BYTES = 32 * 1024 * 1024
"""What is kept: the plans used last, within both bounds."""


class PlanCache:
    """One file a trajectory in a folder; `notes` says what went wrong, for the user."""

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = cache_folder() / "plans" if folder is None else folder
        self.notes: list[str] = []

    def get(self, key: str, task: TrajectoryTask) -> Solution | None:
        """The plan kept under `key`, if there is one and it is sound."""
        path = self._path(key)
        try:
            record = PlanRecord.model_validate_json(path.read_bytes())
            solution = record.solution(cached=True)
            if other := record.mismatch(task):
                raise ValueError(other)
            os.utime(path)  # used last
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            reason = first_error(error) if isinstance(error, ValidationError) else str(error)
            self.notes.append(f"the plan kept in {path} is of no use ({reason}): planned anew")
            with suppress(OSError):
                path.unlink()
            return None
        return solution

    def put(self, key: str, task: TrajectoryTask, solution: Solution) -> None:
        """Keep a plan, and remove the ones used longest ago beyond the bounds."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            write_whole(self._path(key), PlanRecord.of(task, solution).model_dump_json())
            self._trim()
        except (OSError, InputError) as error:
            self.notes.append(f"the plan is not kept for the next time: {error}")

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.json"

    def _trim(self) -> None:
        kept = [(path.stat(), path) for path in self.folder.glob("*.json")]
        total_bytes = 0
        for number, (status, path) in enumerate(sorted(kept, key=lambda entry: -entry[0].st_mtime_ns), start=1):
            total_bytes += status.st_size
            if number > MOST_PLANS or total_bytes > MOST_BYTES:
                path.unlink(missing_ok=True)
