"""What a plan depends on, as one hash: the name under which the cache keeps it.

Everything counts that could change a digit: the task, the whole vehicle (a planner may simulate it), the method with
its options, the numbers of the model, the sources of the planner, and the libraries that compute.
"""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, fields, is_dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lcd_flight.mission.assemble import TrajectoryTask
from lcd_flight.mission.solution import Option
from lcd_flight.model import Simulator, Vehicle

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_PACKAGE = Path(__file__).parents[1]
_SOURCES = ("planning", "model", "control")
"""Rooms whose code makes a plan what it is."""
_LIBRARIES = ("lcd-flight", "numpy", "numba")


def plan_key(
    task: TrajectoryTask,
    vehicle: Vehicle,
    method: str,
    options: Mapping[str, Option],
    model: str | None,
    simulator: Simulator | None = None,
) -> str:
    """32 hexadecimal digits: equal for plans that are equal to the bit.

    model: its hash, None for a method without one.
    simulator: that the method may fly plans in; its package's sources count.
    """
    depends: dict[str, Any] = {
        "waypoints": task.waypoints.tolist(),
        "durations_s": task.durations_s.tolist(),
        "vehicle": asdict(vehicle),
        "method": method,
        "options": dict(options),
        "model": model,
        "program": _program(),
        "simulator": None if simulator is None else _sources_of(type(simulator)),
    }
    return hashlib.sha256(json.dumps(depends, sort_keys=True).encode()).hexdigest()[:32]


def model_hash(model: DataclassInstance) -> str:
    """16 hexadecimal digits over everything that a model holds, whatever file it came from."""
    sha = hashlib.sha256()
    for part in _parts(model):
        sha.update(part)
    return sha.hexdigest()[:16]


def _parts(value: Any) -> Iterator[bytes]:
    """Numbers and words, in the order of fields; of an object without fields, its kind and what it holds."""
    if isinstance(value, np.ndarray):
        yield f"{value.dtype.str} {value.shape}".encode()
        yield value.tobytes()
    elif isinstance(value, tuple | list | dict):
        for item in value.items() if isinstance(value, dict) else value:
            yield from _parts(item)
    elif value is None or isinstance(value, str | int | float):
        yield repr(value).encode()
    else:
        yield type(value).__qualname__.encode()
        names = [each.name for each in fields(value)] if is_dataclass(value) else sorted(getattr(value, "__dict__", ()))
        for name in names:
            yield name.encode()
            yield from _parts(getattr(value, name))


@cache
def _sources_of(kind: type) -> str:
    """Of the package that a class comes from."""
    sha = hashlib.sha256()
    for path in sorted(Path(inspect.getfile(kind)).parent.rglob("*.py")):
        sha.update(path.name.encode() + b"\0" + path.read_bytes())
    return sha.hexdigest()


@cache
def _program() -> str:
    """Of the planner's sources and of the libraries."""
    sha = hashlib.sha256(" ".join(f"{name} {version(name)}" for name in _LIBRARIES).encode())
    for path in sorted(path for room in _SOURCES for path in (_PACKAGE / room).rglob("*.py")):
        sha.update(path.name.encode() + b"\0" + path.read_bytes())
    return sha.hexdigest()
