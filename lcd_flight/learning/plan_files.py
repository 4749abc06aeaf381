"""Planned polynomials of many tasks as NumPy's .npz, for anybody to fly: what `lcd plan --tasks` writes.

`durations` (N, S) in s; `coefficients` (N, 4, S, 8), ascending powers of each segment's own time from 0, axes x, y, z
in m and yaw in rad; `fell_back` (N,) where the method gave minimum snap instead; `about`, a JSON text: what planned
them, and for what.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lcd_flight.files import writing
from lcd_flight.learning.npz import read_array, read_arrays
from lcd_flight.model import COEFFICIENTS, BoolArray, InputError, Trajectories

_DURATIONS, _COEFFICIENTS = "(N, S) in s", f"(N, 4, S, {COEFFICIENTS})"


@dataclass(frozen=True, slots=True, eq=False)
class PlannedTasks:
    """N planned tasks."""

    trajectories: Trajectories
    fell_back: BoolArray
    """(N,) where the method failed and gave minimum snap instead."""
    about: Mapping[str, Any] = field(default_factory=dict)
    """World, vehicle, method, timing, model ..."""

    def __len__(self) -> int:
        """How many tasks there are."""
        return len(self.trajectories)


def save_plans(path: Path, plans: PlannedTasks) -> None:
    """Write plans, whole or not at all.

    Raises:
        InputError: the file cannot be written.
    """
    with writing(path) as partial, partial.open("wb") as file:
        np.savez(
            file,
            durations=plans.trajectories.durations_s,
            coefficients=plans.trajectories.coefficients,
            fell_back=plans.fell_back,
            about=np.array(json.dumps(dict(plans.about), sort_keys=True)),
        )


def load_plans(path: Path) -> PlannedTasks:
    """Read plans; `fell_back` and `about` may be missing, so that other programs can write such files.

    Raises:
        InputError: one line that names the file, the array, what is wrong and what it should be.
    """
    arrays = read_arrays(path, "`durations` and `coefficients`")
    durations = read_array(path, arrays, "durations", _DURATIONS, dimensions=2)
    coefficients = read_array(path, arrays, "coefficients", _COEFFICIENTS, dimensions=4)
    count, segments = durations.shape
    if not count or not segments or not (durations > 0.0).all():
        raise InputError(f"{path}: durations must be above 0, of one task and one segment at least; give {_DURATIONS}")
    if coefficients.shape != (count, 4, segments, COEFFICIENTS):
        wanted = (count, 4, segments, COEFFICIENTS)
        raise InputError(f"{path}: coefficients has shape {coefficients.shape}; give {wanted}, {_COEFFICIENTS}")
    fell_back = arrays.get("fell_back", np.zeros(count, bool))
    if fell_back.shape != (count,):
        raise InputError(f"{path}: fell_back has shape {fell_back.shape}; give {(count,)}")
    return PlannedTasks(Trajectories(durations, coefficients), fell_back.astype(bool), _about(path, arrays))


def _about(path: Path, arrays: Mapping[str, Any]) -> dict[str, Any]:
    try:
        about = json.loads(str(arrays.get("about", "{}")))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}: `about` is no JSON text ({error}); leave it out or write it anew") from error
    return about if isinstance(about, dict) else {}
