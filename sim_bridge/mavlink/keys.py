"""The signing key: from a file that only its owner may read, or from the environment."""

from __future__ import annotations

import os
import re
from pathlib import Path

from lcd_flight.model import InputError
from sim_bridge.mavlink.signing import KEY_BYTES

VARIABLE = "LCD_MAVLINK_KEY"
"""64 hexadecimal digits; used where no file is named."""


def key_of(path: str) -> bytes | None:
    """The key; None: there is none.

    Raises:
        InputError: the file cannot be read, others may read it, or it is no key.
    """
    if not path:
        text = os.environ.get(VARIABLE, "")
        return _parsed(text.encode(), f"environment variable {VARIABLE}") if text else None
    try:
        data, rights = Path(path).read_bytes(), Path(path).stat().st_mode & 0o077
    except OSError as error:
        raise InputError(f"key file {path}: {error.strerror or error}") from error
    if rights:
        raise InputError(f"key file {path} may be read by others; `chmod 600 {path}`")
    return _parsed(data, f"key file {path}")


def _parsed(data: bytes, where: str) -> bytes:
    if len(data) == KEY_BYTES:
        return data
    text = data.strip().decode("ascii", errors="replace")
    if not re.fullmatch(r"[0-9a-fA-F]{64}", text):
        raise InputError(f"{where}: not {KEY_BYTES} bytes nor {2 * KEY_BYTES} hexadecimal digits")
    return bytes.fromhex(text)
