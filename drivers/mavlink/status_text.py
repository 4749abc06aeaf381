"""STATUSTEXT: what the autopilot says in words, put together where it came in pieces. Pure."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from drivers.mavlink.dialect import Message

PIECE = 50
"""Characters; a shorter piece is the last one."""
PATIENCE_NS = 1_000_000_000
"""A text whose rest has not come by then is told as it is."""
KEPT = 20
MAX_PIECES = 16
RECENT_NS = 10_000_000_000
_LEVELS = ("emergency", "alert", "critical", "error", "warning", "notice", "info", "debug")


@dataclass(slots=True)
class _Unfinished:
    number: int
    severity: int
    since_ns: int
    pieces: dict[int, str] = field(default_factory=dict)


class StatusTexts:
    """Takes messages; gives whole texts."""

    def __init__(self) -> None:
        self._unfinished: _Unfinished | None = None
        self._kept: deque[tuple[int, int, str]] = deque(maxlen=KEPT)
        """Arrival, severity and text."""

    def take(self, message: Message, now_ns: int) -> list[str]:
        """The texts that this message completes, as `warning: text`."""
        done = self.overdue(now_ns)
        number, piece = int(message.id), int(message.chunk_seq)
        if number == 0:
            return [*done, self._keep(now_ns, message.severity, message.text)]
        if self._unfinished is not None and self._unfinished.number != number:
            done += self._finish(now_ns)
        if self._unfinished is None:
            self._unfinished = _Unfinished(number, message.severity, now_ns)
        self._unfinished.pieces[piece] = message.text
        whole = len(message.text) < PIECE and len(self._unfinished.pieces) > piece
        return done + (self._finish(now_ns) if whole or len(self._unfinished.pieces) >= MAX_PIECES else [])

    def overdue(self, now_ns: int) -> list[str]:
        """What has waited too long for its rest."""
        waiting = self._unfinished
        return self._finish(now_ns) if waiting is not None and now_ns - waiting.since_ns > PATIENCE_NS else []

    def recent(self, now_ns: int) -> str:
        """The latest complaints, quoted, for a refusal; empty where there are none."""
        texts = [text for at_ns, severity, text in self._kept if now_ns - at_ns <= RECENT_NS and severity <= 4]
        return "; ".join(f'"{text}"' for text in dict.fromkeys(texts[-4:]))

    def _finish(self, now_ns: int) -> list[str]:
        waiting, self._unfinished = self._unfinished, None
        if waiting is None:
            return []
        return [self._keep(now_ns, waiting.severity, "".join(waiting.pieces[n] for n in sorted(waiting.pieces)))]

    def _keep(self, now_ns: int, severity: int, text: str) -> str:
        clean = "".join(letter if letter.isprintable() else "?" for letter in text)
        self._kept.append((now_ns, severity, clean))
        level = _LEVELS[severity] if 0 <= severity < len(_LEVELS) else f"severity {severity}"
        return f"{level}: {clean}"
