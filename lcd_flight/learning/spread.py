"""Work in parts, side by side: results come in the order of the parts, and only a few are held at a time."""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Protocol, TypeVar

Part = TypeVar("Part")
Result = TypeVar("Result")


class Spread(Protocol):
    """Hands parts out to workers. Closing the iterator, or an exception in it, lets go of what has not begun."""

    def __call__(
        self, work: Callable[[Part], Result], parts: Sequence[Part]
    ) -> Generator[tuple[Part, Result], None, None]:
        """Each part with its result."""
        ...


class NoLongerWantedError(Exception):
    """Nobody waits any more for what a thread is at work on. Stays in that thread."""


def still_wanted() -> None:
    """Go on, or end: called now and then in work that takes seconds, so that Ctrl-C need not wait for its end.

    Raises:
        NoLongerWantedError: the results of this thread are not wanted any more.
    """
    ended: threading.Event | None = getattr(_of_this_thread, "ended", None)
    if ended is not None and ended.is_set():
        raise NoLongerWantedError


_of_this_thread = threading.local()


def cores() -> int:
    """How many processor cores this process may use."""
    return len(os.sched_getaffinity(0))


def in_turn(work: Callable[[Part], Result], parts: Sequence[Part]) -> Generator[tuple[Part, Result], None, None]:
    """One after another, here: for work that uses all cores by itself."""
    return ((part, work(part)) for part in parts)


def in_threads(threads: int = 0) -> Spread:
    """On so many threads (0: one for each core), for work that releases the interpreter's lock most of the time."""
    workers = threads or cores()

    def spread(work: Callable[[Part], Result], parts: Sequence[Part]) -> Generator[tuple[Part, Result], None, None]:
        waiting, pending = deque(parts), deque[tuple[Part, Future[Result]]]()
        ended = threading.Event()
        pool = ThreadPoolExecutor(workers, initializer=setattr, initargs=(_of_this_thread, "ended", ended))
        try:
            while waiting or pending:
                while waiting and len(pending) <= workers:  # one more than workers, so that none waits for the caller
                    pending.append((waiting[0], pool.submit(work, waiting.popleft())))
                part, result = pending.popleft()
                yield part, result.result()
        finally:
            ended.set()
            pool.shutdown(cancel_futures=True)

    return spread
