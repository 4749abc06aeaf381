"""Progress of work over a file's bytes or a flight's ticks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sized
from contextlib import contextmanager
from pathlib import Path

from lcd_flight.cli.terminal import Terminal, following


@contextmanager
def watched(terminal: Terminal, label: str, work: Path | Sized, unit: str) -> Iterator[Callable[[int], None]]:
    """Show how far the work is; the callable is told how much more is done.

    work: a file, or what is gone through item by item.
    """
    from lcd_flight.learning.progress import Meter

    with following(terminal, label) as show:
        yield Meter(show, _amount(work), unit).advance


def _amount(work: Path | Sized) -> int:
    """Bytes or items; 0 for a file that is not there, which whoever reads it will say."""
    if isinstance(work, Path):
        return work.stat().st_size if work.exists() else 0
    return len(work)
