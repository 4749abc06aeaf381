"""Tasks that nobody can have tuned on: a seed that follows from the planner's sources and the models that ship.

Whoever changes a model, the planner, a method or the evaluation gets other tasks; so no choice can have been made by
looking at the results on these.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path

from lcd_flight.model import InputError
from lcd_flight.planning.cost.model_file import MODELS, SUFFIX

FIRST_REPORTED_SEED = 1000
"""Seeds below are for development; what is offered as evidence uses others."""
_LAST_SEED = 999_999_999
_HOUSE = Path(__file__).parents[1]
_JUDGED_BY = ("methods.py", "evaluate.py", "sampling.py")


def fresh_seed() -> int:
    """From 1000 up; a function of all bytes of the shipped models and of the planner's sources."""
    digest = hash_of_files([*_shipped_models(), *planner_sources()], _HOUSE)
    return FIRST_REPORTED_SEED + int(digest, 16) % (_LAST_SEED - FIRST_REPORTED_SEED + 1)


def seed_of(text: str) -> int:
    """The seed that an option means: a whole number from 0 up, or `fresh`.

    Raises:
        InputError: it is neither.
    """
    if text == "fresh":
        return fresh_seed()
    if not text.isascii() or not text.isdigit():
        raise InputError(f"--seed {text}: give a whole number from 0 up, or fresh")
    return int(text)


def about_seed(seed: int) -> str:
    """What may be concluded from tasks of a seed, for people."""
    if seed == fresh_seed():
        return f"seed {seed}: fresh, from the hash of the shipped models and of the planner's sources"
    return f"seed {seed}: for development" if seed < FIRST_REPORTED_SEED else f"seed {seed}: chosen by hand"


def hash_of_files(files: Iterable[Path], base: Path | None = None) -> str:
    """SHA-256, 64 hexadecimal digits, over names (below `base`, else bare) and bytes of files."""
    sha = hashlib.sha256()
    for path in sorted(files):
        data, name = path.read_bytes(), path.relative_to(base).as_posix() if base else path.name
        sha.update(f"{name}\0{len(data)}\0".encode() + data)
    return sha.hexdigest()


def planner_sources() -> list[Path]:
    """All that plans, and that draws and judges tasks."""
    return [*(_HOUSE / "planning").rglob("*.py"), *(_HOUSE / "learning" / name for name in _JUDGED_BY)]


def _shipped_models() -> list[Path]:
    return list(MODELS.glob(f"*{SUFFIX}"))
