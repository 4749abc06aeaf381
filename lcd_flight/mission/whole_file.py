"""Writing a file whole or not at all: nobody ever reads half of it, whatever interrupts the writing."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from lcd_flight.model import InputError


def write_whole(path: Path, content: str | bytes) -> None:
    """Put `content` (text as UTF-8) at `path` in one step.

    Raises:
        InputError: the place cannot be written to.
    """
    if path.is_dir():
        raise InputError(f"{path}: is a folder; name a file in it")
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        partial.write_bytes(content.encode() if isinstance(content, str) else content)
        partial.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another place") from error
    finally:
        with suppress(OSError):
            partial.unlink(missing_ok=True)
