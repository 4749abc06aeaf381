"""Hands ticks to a thread that writes them, so that no disk ever delays a tick."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Protocol

from lcd_flight.model import Tick, TickInputs

CAPACITY = 2000
"""Ticks that may wait: 20 s at 100 Hz, about 10 MB."""

CLOSE_WAIT_S = 10.0
"""How long the end of a flight waits for the disk."""


class TickSink(Protocol):
    """What the thread writes to, e.g. `lcd_flight.record.LogWriter`."""

    def write(self, inputs: TickInputs, tick: Tick) -> None:
        """Write one tick; may wait for the disk."""
        ...

    def close(self) -> None:
        """Keep what is held; may wait for the disk."""
        ...


@dataclass(frozen=True, slots=True)
class LogStatistics:
    """What became of the ticks."""

    written: int
    dropped: int
    """There was no room in the queue, or the disk had failed."""
    error: str | None
    """Why the log is not whole, or None."""


class LogThread:
    """The observer that logs: `observe` costs a tick one put into a queue, a thread does the rest.

    In real time `observe` never waits: where `capacity` ticks are waiting already, it drops the tick and counts it. In
    virtual time, where ticks come faster than they can be written, `lossless` lets it wait for room instead. A disk
    that fails ends the log and not the flight; `statistics` then say why.
    """

    def __init__(
        self, sink: TickSink, *, capacity: int = CAPACITY, lossless: bool = False, close_wait_s: float = CLOSE_WAIT_S
    ) -> None:
        self._sink = sink
        self._capacity = capacity
        self._close_wait_s = close_wait_s
        self._room = threading.Semaphore(capacity) if lossless else None
        # A SimpleQueue's put is one C call; that of a Queue takes a lock which the writer may hold.
        self._queue: SimpleQueue[tuple[TickInputs, Tick] | None] = SimpleQueue()
        self._observed = 0
        self._written = 0
        self._error: str | None = None
        # A daemon: a disk that hangs for ever must not keep the process.
        self._thread = threading.Thread(target=self._run, name="flight-log", daemon=True)

    def observe(self, inputs: TickInputs, tick: Tick) -> None:
        """Queue one tick. The first begins the thread, which so inherits the priority that the flight has by then."""
        if not self._observed:
            self._thread.start()
        self._observed += 1
        if self._room is not None:
            self._room.acquire()
        elif self._queue.qsize() >= self._capacity:
            return
        self._queue.put((inputs, tick))

    def close(self) -> None:
        """Wait until all that is queued is on the disk, but no longer than `close_wait_s`. May be called again."""
        if self._thread.ident is None:
            self._thread.start()
        self._queue.put(None)
        self._thread.join(self._close_wait_s)
        if self._thread.is_alive():
            self._error = f"the disk did not take the log within {self._close_wait_s:g} s"

    @property
    def statistics(self) -> LogStatistics:
        """Final once closed."""
        return LogStatistics(self._written, self._observed - self._written, self._error)

    def _run(self) -> None:
        """Write what comes until the None of `close`; after a failure only take it out of the queue."""
        while (item := self._queue.get()) is not None:
            if self._error is None:
                self._attempt(item)
            if self._room is not None:
                self._room.release()
        self._attempt(None)

    def _attempt(self, item: tuple[TickInputs, Tick] | None) -> None:
        """Write one tick, or close; note what goes wrong."""
        try:
            if item is None:
                self._sink.close()
            else:
                self._sink.write(*item)
                self._written += 1
        except Exception as error:  # noqa: BLE001 - nothing that the log does may end a flight
            self._error = self._error or f"{type(error).__name__}: {error}"
