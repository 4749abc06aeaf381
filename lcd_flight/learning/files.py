"""Files that are written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from lcd_flight.model import InputError


@contextmanager
def writing(path: Path) -> Iterator[Path]:
    """A place to write to; it becomes `path` in one step once all is written. Makes the folders that it needs.

    Raises:
        InputError: it cannot be written.
    """
    partial = path.with_name(f".{path.name}.partial")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield partial
        partial.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error}); give another place or make room") from error
    finally:
        with suppress(OSError):
            partial.unlink()


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8.

    Raises:
        InputError: it cannot be written.
    """
    with writing(path) as partial:
        partial.write_text(text, encoding="utf-8")


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
