"""Long work in stages: where it stands, how long it will take, and how long it took over all its runs."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from lcd_flight.files import write_whole
from lcd_flight.learning.progress import Progress
from lcd_flight.model import InputError

_FOUND_SHARE = 0.05
"""A stage that took less of what was expected was found done."""


@dataclass(frozen=True, slots=True)
class Stage:
    """One step of long work."""

    name: str
    """For people."""
    key: str
    """What its time is kept under: other work has another key."""
    expected_s: float
    """Roughly; the run itself corrects the pace."""


@dataclass(frozen=True, slots=True)
class StageProgress:
    """Where long work stands."""

    stage: int
    """Counted from 1."""
    stages: int
    name: str
    seconds_left: float
    """Of all stages together, from how long those so far took."""
    within: Progress | None = None
    """Where the stage itself stands."""


StageCallback: TypeAlias = Callable[[StageProgress], None]


class Stages:
    """Goes through stages; what earlier runs had done does not count into the pace.

    book: JSON file in which the seconds of each stage add up, also over interrupted runs.

    Raises:
        InputError: the book is damaged or cannot be written.
    """

    def __init__(self, stages: Sequence[Stage], book: Path, tell: StageCallback) -> None:
        self._stages, self._book, self._tell = stages, book, tell
        self._seconds = _read(book)
        self._took_s = self._counted_s = 0.0

    @property
    def seconds(self) -> float:
        """Of all these stages over all runs."""
        return sum(self._seconds.get(stage.key, 0.0) for stage in self._stages)

    @contextmanager
    def run(self, number: int) -> Iterator[Callable[[Progress | None], None]]:
        """Be in stage `number`, counted from 0; gives what the stage tells its own progress to."""
        stage, began_s = self._stages[number], time.monotonic()

        def report(within: Progress | None) -> None:
            left_s = self._left_s(number, time.monotonic() - began_s)
            self._tell(StageProgress(number + 1, len(self._stages), stage.name, left_s, within))

        report(None)
        try:
            yield report
        finally:
            took_s = time.monotonic() - began_s
            self._seconds[stage.key] = self._seconds.get(stage.key, 0.0) + took_s
            write_whole(self._book, json.dumps(self._seconds, indent=1) + "\n")
        if took_s > _FOUND_SHARE * stage.expected_s:
            self._took_s, self._counted_s = self._took_s + took_s, self._counted_s + stage.expected_s

    def _left_s(self, number: int, in_stage_s: float) -> float:
        pace = self._took_s / self._counted_s if self._counted_s else 1.0
        present_s = pace * self._stages[number].expected_s
        to_come_s = pace * sum(stage.expected_s for stage in self._stages[number + 1 :])
        return max(present_s - in_stage_s, 0.1 * present_s) + to_come_s


def _read(book: Path) -> dict[str, float]:
    """The seconds so far by the stages' keys."""
    try:
        text = book.read_text(encoding="utf-8") if book.exists() else "{}"
        return {str(key): float(seconds) for key, seconds in json.loads(text).items()}
    except (OSError, ValueError, TypeError, AttributeError) as error:
        raise InputError(f"{book}: damaged ({error}); delete it: it only holds how long the stages took") from error
