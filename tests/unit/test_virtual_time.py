"""Virtual time jumps, keeps the order of timers, and says when nothing can happen any more."""

from __future__ import annotations

import asyncio

import pytest

from lcd_flight.flight import virtual_time
from lcd_flight.flight.virtual_time import VirtualClock

CLOCK = VirtualClock()


def test_an_hour_passes_at_once_and_to_the_nanosecond() -> None:
    async def main() -> list[int]:
        seen = [CLOCK.now_ns()]
        for _ in range(3):
            await CLOCK.sleep_until(seen[-1] + 1_200_000_000_123)
            seen.append(CLOCK.now_ns())
        return seen

    assert virtual_time.run(main()) == [0, 1_200_000_000_123, 2_400_000_000_246, 3_600_000_000_369]


def test_absolute_deadlines_do_not_drift_over_many_periods() -> None:
    async def main() -> list[int]:
        off_by = []
        for tick in range(1, 20_001):
            await CLOCK.sleep_until(tick * 10_000_000)
            off_by.append(CLOCK.now_ns() - tick * 10_000_000)
        return off_by

    assert set(virtual_time.run(main())) == {0}


def test_two_periodic_tasks_interleave_the_same_way_every_time() -> None:
    async def main() -> list[tuple[str, int]]:
        events: list[tuple[str, int]] = []

        async def periodic(name: str, period_ns: int) -> None:
            for n in range(1, 200):
                await CLOCK.sleep_until(n * period_ns)
                events.append((name, CLOCK.now_ns()))

        await asyncio.gather(periodic("a", 10_000_000), periodic("b", 15_000_000), periodic("c", 10_000_000))
        return events

    first = virtual_time.run(main())
    assert first == virtual_time.run(main())
    assert [t for _, t in first] == sorted(t for _, t in first)


def test_a_past_deadline_returns_without_moving_time() -> None:
    async def main() -> int:
        await CLOCK.sleep_until(5)
        await CLOCK.sleep_until(3)
        return CLOCK.now_ns()

    assert virtual_time.run(main()) == 5


def test_asyncio_timeouts_run_on_virtual_time_too() -> None:
    async def main() -> int:
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(asyncio.Event().wait(), 2.5)
        return CLOCK.now_ns()

    assert virtual_time.run(main()) == 2_500_000_000


def test_waiting_for_nothing_is_an_error_instead_of_a_hang() -> None:
    async def main() -> None:
        await asyncio.Event().wait()

    with pytest.raises(RuntimeError, match="no timer is set"):
        virtual_time.run(main())


def test_tasks_are_cancelled_and_cleaned_up_at_the_end() -> None:
    ended: list[str] = []

    async def background() -> None:
        try:
            await CLOCK.sleep_until(10**15)
        finally:
            ended.append("cleaned up")

    async def main() -> str:
        task = asyncio.create_task(background())
        await asyncio.sleep(0.1)
        return "running" if not task.done() else "done"

    assert virtual_time.run(main()) == "running"
    assert ended == ["cleaned up"]


def test_the_virtual_clock_refuses_another_loop() -> None:
    async def main() -> None:
        CLOCK.now_ns()

    with pytest.raises(RuntimeError, match=r"virtual_time\.run"):
        asyncio.run(main())
