"""The key for MAVLink 2 signing, and the timestamp that must never go back, across restarts too.

The key itself stands in a file with owner-only rights or in the environment, never in a mission or a log: an option
names the place. 64 hexadecimal digits are the key; anything else is a passphrase, whose sha256 is the key.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from lcd_flight.model import InputError, RefusedError

_EPOCH_S = 1_420_070_400
"""2015-01-01, from which signing counts, in tens of microseconds."""
_TICKS_PER_S = 100_000
_STAMP_BITS = 48
"""Of a timestamp in a packet."""


@dataclass(frozen=True, slots=True)
class Key:
    """32 bytes that are never shown."""

    secret: bytes

    def __repr__(self) -> str:
        return f"Key({self.fingerprint})"

    @property
    def fingerprint(self) -> str:
        """Which key it is, without saying it."""
        return hashlib.sha256(b"lcd-flight key fingerprint" + self.secret).hexdigest()[:12]


def key_from(place: str) -> Key | None:
    """The key that the option `signing` names; None where it is empty.

    Raises:
        InputError: not a place, or nothing there.
        RefusedError: others may read the file.
    """
    kind, separator, name = place.partition(":")
    if not place:
        return None
    if separator and name and kind == "env":
        text = os.environ.get(name)
        if text is None:
            raise InputError(f"option signing={place}: there is no environment variable {name}")
    elif separator and name and kind == "file":
        text = _read_private(Path(name).expanduser(), place)
    else:
        raise InputError("option signing: write signing=env:NAME or signing=file:PATH; the key itself stands there")
    text = text.strip()
    if not text:
        raise InputError(f"option signing={place}: it is empty")
    secret = bytes.fromhex(text) if re.fullmatch(r"[0-9A-Fa-f]{64}", text) else hashlib.sha256(text.encode()).digest()
    return Key(secret)


def _read_private(path: Path, place: str) -> str:
    try:
        mode = path.stat().st_mode
        if mode & 0o077:
            raise RefusedError(f"option signing={place}: others may read it: chmod 600 {path}")
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"option signing={place}: cannot be read ({error})") from None


class Timestamps:
    """What outgoing packets are stamped with: real time, but never earlier than anything this key has signed before."""

    def __init__(self, key: Key, folder: Path | None = None) -> None:
        """folder: where they are kept; None: the user's state folder."""
        self._path = (folder or state_folder()) / f"mavlink-signing-{key.fingerprint}"
        self.first = max(_real_time(), self._kept() + 1)
        """The time at the start."""
        self._first_ns: int | None = None
        self._noted: int | None = None
        """What we kept last."""
        self._keeping = threading.Lock()

    def at(self, now_ns: int) -> int:
        """At a moment of the monotonic clock."""
        if self._first_ns is None:
            self._first_ns = now_ns
        return self.first + (now_ns - self._first_ns) // 10_000

    def keep(self, newest: int) -> None:
        """Note for the next start that everything up to `newest` has been used. Writes a small file; from any thread.

        What another program with this key has noted, or one before us, is never lowered; what we have noted ahead is.

        Raises:
            OSError: it cannot be written.
        """
        with self._keeping:
            kept = self._kept()
            if kept > newest and kept != self._noted:
                return
            self._path.parent.mkdir(parents=True, exist_ok=True)
            fresh = self._path.with_name(f".{self._path.name}.{os.getpid()}")
            fresh.write_text(f"{newest}\n", encoding="ascii")
            fresh.replace(self._path)
            self._noted = newest

    def _kept(self) -> int:
        """What the file says; 0 where there is none, or it is damaged."""
        with contextlib.suppress(OSError, ValueError):
            kept = int(self._path.read_text(encoding="ascii"))
            return kept if 0 <= kept < 1 << _STAMP_BITS else 0
        return 0


def state_folder() -> Path:
    """Where this user's programs keep what must outlive them (`XDG_STATE_HOME`, else `~/.local/state`)."""
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "lcd-flight"


def _real_time() -> int:
    return round((time.time() - _EPOCH_S) * _TICKS_PER_S)
