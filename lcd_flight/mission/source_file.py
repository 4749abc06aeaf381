"""Reading a text file that a user named, with one clear line for whatever is wrong with it."""

from __future__ import annotations

from pathlib import Path

from lcd_flight.model import InputError

LARGEST_BYTES = 256 * 1024
"""A mission of a thousand waypoints has about 60 kB."""


def read_text(path: Path, largest_bytes: int = LARGEST_BYTES) -> str:
    """The text of a small UTF-8 file.

    Raises:
        InputError: it is missing, a folder, not a plain file, unreadable, too large or not UTF-8.
    """
    try:
        return _decode(path, _read_bytes(path, largest_bytes))
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file; check the name and the folder you are in") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the name and your rights to it") from error


def _read_bytes(path: Path, largest_bytes: int) -> bytes:
    """What the file holds, if it is a small plain file."""
    if path.is_dir():
        raise InputError(f"{path}: is a folder; name a file in it")
    if path.stat() and not path.is_file():
        raise InputError(f"{path}: is not a plain file; name a file")
    if path.stat().st_size > largest_bytes:
        raise InputError(f"{path}: is larger than {largest_bytes // 1024} kB; is it the right file?")
    return path.read_bytes()


def _decode(path: Path, data: bytes) -> str:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        byte = f"byte 0x{data[error.start]:02x}"
        raise InputError(f"{path}:{line}: {byte} is not UTF-8; save the file as UTF-8 text") from error
