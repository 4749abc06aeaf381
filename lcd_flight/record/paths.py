"""Where a flight's log goes."""

from __future__ import annotations

import errno
import os
import re
import tempfile
from datetime import datetime
from pathlib import Path

from lcd_flight.model import RefusedError


def log_path(folder: Path, name: str, started: datetime) -> Path:
    """A free path such as `flights/2026-11-22T10-31-07_demo.mcap`; the folder is made and tried with a write.

    name: the mission's; what does not belong into a file name becomes `-`.
    started: wall-clock time.

    Raises:
        RefusedError: nothing can be written there.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as trial:
            trial.write(b"\0" * 4096)
            trial.flush()
    except OSError as error:
        raise RefusedError(
            f"cannot write flight logs to {folder}: {error.strerror}; choose another folder with --log DIR"
        ) from error
    safe_name = re.sub(r"[^\w.-]+", "-", name).strip("-.")[:80] or "flight"
    stem = f"{started:%Y-%m-%dT%H-%M-%S}_{safe_name}"
    taken = {path.stem for path in folder.glob(f"{stem}*")}
    count = next(n for n in range(1, len(taken) + 2) if _numbered(stem, n) not in taken)
    return folder / f"{_numbered(stem, count)}.mcap"


def unnamed(path: Path) -> Path:
    """Where a log is begun; it gets its name once it holds the flight's description."""
    return path.with_name(f".{path.name}.part")


def give_name(path: Path) -> None:
    """Make the file at `unnamed(path)` the one at `path`, on the disk: no log of that name ever lacks its description.

    Raises:
        OSError: there is such a file already; the folder does not take it.
    """
    if path.exists():
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST))
    unnamed(path).rename(path)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def _numbered(stem: str, count: int) -> str:
    return stem if count == 1 else f"{stem}-{count}"
