"""Waiting in the flight's clock, real or virtual."""

from __future__ import annotations

from collections.abc import Callable

from lcd_flight.model import Clock

POLL_NS = 10_000_000


async def pause(clock: Clock, duration_s: float) -> None:
    """Let time pass."""
    await clock.sleep_until(clock.now_ns() + round(duration_s * 1e9))


async def until(clock: Clock, condition: Callable[[], bool], limit_s: float) -> bool:
    """Whether a condition comes true in time."""
    deadline_ns = clock.now_ns() + round(limit_s * 1e9)
    while not condition():
        now_ns = clock.now_ns()
        if now_ns >= deadline_ns:
            return False
        await clock.sleep_until(min(now_ns + POLL_NS, deadline_ns))
    return True
