"""What a data set or a model was made from, as text, as a short hash, and as the difference of two."""

from __future__ import annotations

import hashlib
import json
import platform
from dataclasses import asdict
from functools import cache
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Description: TypeAlias = dict[str, Any]
"""Nested dictionaries, lists and plain values, as JSON holds them."""


def described(configuration: DataclassInstance) -> Description:
    """A configuration as JSON holds it."""
    result: Description = json.loads(json.dumps(asdict(configuration)))
    return result


def fingerprint(description: Description) -> str:
    """16 hexadecimal digits; equal for equal descriptions, whatever the order of their keys."""
    text = json.dumps(description, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def differences(here: Description, there: Description) -> list[str]:
    """What differs, one `key: value, there value` for each leaf, e.g. `world.speed: 2.37, there 2.0`."""
    ours, theirs = dict(_leaves(here)), dict(_leaves(there))
    keys = [k for k in {**ours, **theirs} if ours.get(k) != theirs.get(k)]
    return [f"{k}: {ours.get(k, 'absent')}, there {theirs.get(k, 'absent')}" for k in keys]


def versions(*distributions: str) -> dict[str, str]:
    """Versions of this project, Python and the distributions named, for cards and metadata."""
    return {"python": platform.python_version(), **{d: version(d) for d in ("lcd-flight", *distributions)}}


@cache
def origin() -> Description:
    """What flies rollouts in this process: versions, and the processor that its kernels are compiled for.

    The same versions give the same bytes on processors of one family.
    """
    from llvmlite.binding import get_host_cpu_name

    return {"versions": versions("numpy", "numba"), "processor": get_host_cpu_name()}


def _leaves(value: Any, path: str = "") -> list[tuple[str, Any]]:
    if not isinstance(value, dict):
        return [(path, value)]
    return [leaf for key, item in value.items() for leaf in _leaves(item, f"{path}.{key}" if path else key)]
