"""What listens to a flight from outside: its log, and the stream for those who watch. Opened before, closed after."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Self

from lcd_flight.model import Observer, RefusedError
from lcd_flight.observers import LivePublisher, LiveStream, LogStatistics, LogThread
from lcd_flight.record import FlightHeader, LogWriter
from lcd_flight.record.live import live_flight
from lcd_flight.wire.live_frame import encode


class Recording:
    """A context manager. A flight that is refused before its first tick leaves no log: it could tell nothing."""

    def __init__(self, path: Path, header: FlightHeader, *, live: str | None, lossless: bool) -> None:
        """Write the flight's description.

        path: where no file stands yet.
        live: where the flight is published; None for nowhere. Without that endpoint the flight goes on, with a note.
        lossless: whether the log may hold ticks up, as in virtual time.

        Raises:
            RefusedError: the log cannot be written.
        """
        self._path = path
        self._log = LogThread(LogWriter(path, header), lossless=lossless)
        self._live: LiveStream | None = None
        self.notes: tuple[str, ...] = ()
        """What is not to be had."""
        try:
            self._live = None if live is None else LiveStream(LivePublisher(live), encode(live_flight(header)))
        except RefusedError as error:
            self.notes = (str(error),)

    @property
    def observers(self) -> tuple[Observer, ...]:
        """To be told of every tick."""
        return (self._log,) if self._live is None else (self._log, self._live)

    @property
    def statistics(self) -> LogStatistics:
        """Of the log; final once closed."""
        return self._log.statistics

    def __enter__(self) -> Self:
        """Nothing more to do."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close both."""
        for observer in self.observers:
            observer.close()
        if error is not None and self.statistics == LogStatistics(written=0, dropped=0, error=None):
            self._path.unlink(missing_ok=True)
