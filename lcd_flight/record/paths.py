"""Where a flight's log goes."""

from __future__ import annotations

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


def _numbered(stem: str, count: int) -> str:
    return stem if count == 1 else f"{stem}-{count}"
