"""Virtual time: an asyncio event loop whose time jumps to the next timer as soon as nothing is left to do.

A flight of a minute takes as long as its arithmetic, and the same program gives the same order of events every time:
time depends on timers alone. What waits for a thread or for a peer outside the loop has no place in it.
"""

from __future__ import annotations

import asyncio
import selectors
from collections.abc import Coroutine
from typing import Any, TypeVar

from lcd_flight.flight.clock import NS_PER_S

Result = TypeVar("Result")


def run(main: Coroutine[Any, Any, Result]) -> Result:
    """Run `main` in virtual time, from time zero, and return what it returns.

    Raises:
        RuntimeError: everything waits, and no timer will ever wake it.
    """
    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        return runner.run(main)


class VirtualClock:
    """The time of the running virtual loop (`lcd_flight.model.Clock`)."""

    def now_ns(self) -> int:
        """Nanoseconds since the loop was made."""
        return _running_loop().now_ns

    async def sleep_until(self, deadline_ns: int) -> None:
        """Return at the deadline exactly, or at the loop's next turn where it has passed."""
        loop = _running_loop()
        await asyncio.sleep(max(0, deadline_ns - loop.now_ns) / NS_PER_S)


class VirtualLoop(asyncio.SelectorEventLoop):
    """An event loop that never waits."""

    def __init__(self) -> None:
        self.now_ns = 0
        super().__init__(_JumpingSelector(self))

    def time(self) -> float:
        """Virtual seconds."""
        return self.now_ns / NS_PER_S


class _JumpingSelector(selectors.SelectSelector):
    """Takes what is ready; where nothing is, moves the loop's time on by the wait that it was asked for."""

    def __init__(self, loop: VirtualLoop) -> None:
        super().__init__()
        self._loop = loop

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Never waits. The loop's own wake-up pipe (signals) is the only file in it."""
        ready = super().select(0.0)
        if not ready:
            if timeout is None:
                raise RuntimeError("virtual time stands still: everything waits and no timer is set")
            self._loop.now_ns += round(timeout * NS_PER_S)
        return ready


def _running_loop() -> VirtualLoop:
    loop = asyncio.get_running_loop()
    if not isinstance(loop, VirtualLoop):
        raise RuntimeError("VirtualClock works inside virtual_time.run only")
    return loop
