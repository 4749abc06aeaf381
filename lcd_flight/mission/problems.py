"""What is wrong with a file that a user wrote: one line for each problem, all of them at once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

from lcd_flight.model import InputError

Key: TypeAlias = tuple[str | int, ...]
"""Where in a file: mapping keys and list positions from the root, e.g. ("plan", 2, "trajectory")."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong, with its remedy."""

    line: int
    """Counted from 1."""
    key: Key
    text: str
    """Value, limit and remedy."""

    def in_file(self, name: str) -> str:
        """The whole line, e.g. `missions/x.yaml:12: plan[0].takeoff.height: -1.0 is too small; ...`."""
        key = f"{dotted(self.key)}: " if self.key else ""
        return f"{name}:{self.line}: {key}{self.text}"


class MissionError(InputError):
    """A file cannot be used; `problems` holds every reason, in the order of the file."""

    def __init__(self, name: str, problems: Iterable[Problem]) -> None:
        self.problems = tuple(sorted(problems, key=lambda problem: problem.line))
        super().__init__("\n".join(problem.in_file(name) for problem in self.problems))


def dotted(key: Key) -> str:
    """A key as people write it: `plan[2].trajectory.waypoints[1].position[2]`."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in key)
    return text.removeprefix(".")
