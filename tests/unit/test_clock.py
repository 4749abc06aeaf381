"""The real clock wakes at its deadline, never before, and leaves nothing behind."""

from __future__ import annotations

import asyncio
import os
import sys
import time
from pathlib import Path

import pytest

from lcd_flight.flight import clock as clock_module
from lcd_flight.flight.clock import RealClock

CLOCK = RealClock()


def open_descriptors() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def test_now_is_the_monotonic_clock() -> None:
    before = time.monotonic_ns()
    assert before <= CLOCK.now_ns() <= time.monotonic_ns()


def test_sleep_never_ends_before_its_deadline() -> None:
    async def sleeps() -> list[int]:
        lateness = []
        for milliseconds in (0.1, 0.9, 1.0, 2.3):
            deadline = CLOCK.now_ns() + int(milliseconds * 1e6)
            await CLOCK.sleep_until(deadline)
            lateness.append(CLOCK.now_ns() - deadline)
        return lateness

    assert min(asyncio.run(sleeps())) >= 0


def test_a_deadline_in_the_past_returns_at_the_next_turn_and_lets_others_run() -> None:
    ran: list[str] = []

    async def other() -> None:
        ran.append("other")

    async def main() -> None:
        task = asyncio.create_task(other())
        await CLOCK.sleep_until(CLOCK.now_ns() - 10**9)
        assert ran == ["other"]
        await task

    asyncio.run(main())


def test_sleepers_wake_in_the_order_of_their_deadlines() -> None:
    async def main() -> list[int]:
        woken: list[int] = []

        async def sleeper(milliseconds: int) -> None:
            await CLOCK.sleep_until(start + milliseconds * 1_000_000)
            woken.append(milliseconds)

        start = CLOCK.now_ns()
        await asyncio.gather(*(sleeper(n) for n in (30, 10, 20)))
        return woken

    assert asyncio.run(main()) == [10, 20, 30]


@pytest.mark.skipif(sys.platform != "linux", reason="timers are file descriptors on Linux only")
def test_no_descriptor_is_left_after_sleeping_or_after_being_cancelled() -> None:
    async def main() -> None:
        await CLOCK.sleep_until(CLOCK.now_ns() + 1_000_000)
        before = open_descriptors()
        await CLOCK.sleep_until(CLOCK.now_ns() + 1_000_000)
        task = asyncio.create_task(CLOCK.sleep_until(CLOCK.now_ns() + 10**12))
        await asyncio.sleep(0)
        assert open_descriptors() == before + 1
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        assert open_descriptors() == before

    asyncio.run(main())


def test_other_systems_sleep_by_asyncio(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clock_module.sys, "platform", "other")
    monkeypatch.setattr(clock_module, "armed_timer", lambda _: pytest.fail("timerfd asked for"))

    async def main() -> int:
        deadline = CLOCK.now_ns() + 3_000_000
        await CLOCK.sleep_until(deadline)
        return CLOCK.now_ns() - deadline

    assert asyncio.run(main()) > -1_000_000  # asyncio may round its own clock


@pytest.mark.skipif(sys.platform != "linux", reason="timers are file descriptors on Linux only")
def test_a_timer_that_cannot_be_had_is_an_os_error() -> None:
    with pytest.raises(OSError, match="Invalid argument"):
        os.close(clock_module.armed_timer(-1))
