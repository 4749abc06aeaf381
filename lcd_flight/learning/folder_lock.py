"""One writer at a time in a folder."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from lcd_flight.model import InputError


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Make the folder, see that it can be written to, keep others out, and sweep what a killed writer left behind.

    Raises:
        InputError: the folder cannot be written to, or another process is at work there.
    """
    probe = folder / ".writable.partial"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe.write_bytes(b"")
        probe.unlink()
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written to ({error.strerror}); give another folder") from error
    try:
        with suppress(OSError):  # a file system without locks: there the names of shards alone keep order
            _lock(folder, descriptor)
        for left in folder.glob(".*.partial"):
            left.unlink(missing_ok=True)
        yield
    finally:
        os.close(descriptor)


def _lock(folder: Path, descriptor: int) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise InputError(f"{folder}: another `lcd collect` is at work there; wait for it or stop it") from error
