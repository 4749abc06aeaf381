"""Files that are written whole or not at all: nobody ever reads half of one, whatever interrupts the writing."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from lcd_flight.errors import InputError


@contextmanager
def writing(path: Path) -> Iterator[Path]:
    """A place to write to; it becomes `path` in one step once all is written. Makes the folders that it needs.

    Raises:
        InputError: it cannot be written.
    """
    if path.is_dir():
        raise InputError(f"{path}: is a folder; name a file in it")
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")  # two writers do not meet in one
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield partial
        partial.replace(path)
    except OSError as error:
        why = error.strerror or error
        raise InputError(f"{path}: cannot be written ({why}); choose another place, or make room") from error
    finally:
        with suppress(OSError):
            partial.unlink()


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a text (as UTF-8) or bytes.

    Raises:
        InputError: it cannot be written.
    """
    with writing(path) as partial:
        partial.write_bytes(content.encode() if isinstance(content, str) else content)


def write_durably(path: Path, content: bytes | memoryview) -> None:
    """Write bytes that outlast a power cut once this returns.

    Raises:
        InputError: it cannot be written, or the disk is full.
    """
    with writing(path) as partial, partial.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    _synchronise(path.parent)


def _synchronise(folder: Path) -> None:
    """Make new names in it last."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
