"""Delay and drop, around a link that only takes notes; in virtual time."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from types import TracebackType
from typing import Any, Self

import pytest

from drivers.layers import Delay, Drop
from lcd_flight.flight import virtual_time
from lcd_flight.flight.virtual_time import VirtualClock
from lcd_flight.model import AttitudeThrust, InputError, LinkContext, LinkReport

MS = 1_000_000
LEVEL = (0.0, 0.0, 0.0, 1.0)
CLOCK = VirtualClock()


class Notes:
    """A link that writes down when it was asked what."""

    description = "notes"

    def __init__(self) -> None:
        self.taken: list[tuple[float, str, float]] = []

    def note(self, what: str, value: float = 0.0) -> None:
        self.taken.append((CLOCK.now_ns() / MS, what, value))

    async def __aenter__(self) -> Self:
        self.note("open")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.note("close")

    async def arm(self) -> None:
        self.note("arm")

    async def disarm(self) -> None:
        self.note("disarm")

    def send(self, setpoint: AttitudeThrust, stamp_ns: int) -> None:
        self.note("send", setpoint.thrust_N)
        assert stamp_ns % (10 * MS) == 0

    def stop_motors(self) -> None:
        self.note("stop")

    def report(self, now_ns: int) -> LinkReport:
        return LinkReport(connected=True, age_ns=0, sent=10, lost=1, loss_share=0.5)

    @property
    def sends(self) -> list[tuple[float, float]]:
        return [(t, value) for t, what, value in self.taken if what == "send"]


def context(seed: int = 0) -> LinkContext:
    vehicle: Any = None
    return LinkContext(vehicle, CLOCK, (0.0, 0.0, 0.0), 0.0, seed)


def run(main: Coroutine[Any, Any, None]) -> None:
    virtual_time.run(main)


async def send_ticks(link: Any, count: int) -> None:
    """One setpoint every 10 ms; its thrust is its number."""
    for n in range(count):
        await CLOCK.sleep_until(n * 10 * MS)
        link.send(AttitudeThrust(float(n), LEVEL), n * 10 * MS)


def test_a_delay_moves_every_setpoint_by_the_same_time() -> None:
    notes = Notes()

    async def main() -> None:
        async with Delay(notes, {"delay_ms": "12.5"}, context()) as link:
            await send_ticks(link, 4)
            await CLOCK.sleep_until(100 * MS)

    run(main())
    assert notes.sends == [(12.5, 0.0), (22.5, 1.0), (32.5, 2.0), (42.5, 3.0)]


def test_jitter_is_within_its_bounds_seeded_and_may_reorder() -> None:
    def arrivals(seed: int) -> list[tuple[float, float]]:
        notes = Notes()

        async def main() -> None:
            async with Delay(notes, {"delay_ms": "5", "delay_jitter_ms": "20"}, context(seed)) as link:
                await send_ticks(link, 200)
                await CLOCK.sleep_until(5_000 * MS)

        run(main())
        return notes.sends

    first = arrivals(1)
    assert first == arrivals(1)
    assert first != arrivals(2)
    delays = [t - 10.0 * n for t, n in first]
    assert 5.0 <= min(delays) < 7.0
    assert 23.0 < max(delays) <= 25.0
    assert [n for _, n in first] != sorted(n for _, n in first)
    assert len(first) == 200


def test_a_stop_is_delayed_and_no_setpoint_follows_it() -> None:
    notes = Notes()

    async def main() -> None:
        async with Delay(notes, {"delay_ms": "30"}, context()) as link:
            await send_ticks(link, 2)
            link.stop_motors()
            await send_ticks(link, 6)
            await CLOCK.sleep_until(200 * MS)

    run(main())
    assert [(t, what) for t, what, _ in notes.taken] == [
        (0.0, "open"),
        (30.0, "send"),
        (40.0, "send"),
        (40.0, "stop"),
        (200.0, "close"),
    ]


def test_what_is_under_way_when_the_link_closes_is_lost_and_leaves_no_task() -> None:
    notes = Notes()

    async def main() -> None:
        async with Delay(notes, {"delay_ms": "500"}, context()) as link:
            await send_ticks(link, 3)
        assert asyncio.all_tasks() == {asyncio.current_task()}
        link.send(AttitudeThrust(9.0, LEVEL), 0)
        link.stop_motors()
        await CLOCK.sleep_until(2_000 * MS)

    run(main())
    assert [what for _, what, _ in notes.taken] == ["open", "close"]


@pytest.mark.parametrize("share", [0.0, 0.05, 0.3, 1.0])
def test_a_drop_loses_its_share_and_reports_it(share: float) -> None:
    notes = Notes()

    async def main() -> None:
        async with Drop(notes, {"drop": str(share)}, context()) as link:
            await send_ticks(link, 2000)
            report = link.report(CLOCK.now_ns())
            dropped = 2000 - len(notes.sends)
            assert dropped == pytest.approx(2000 * share, abs=3.0 * (2000 * share * (1.0 - share)) ** 0.5)
            assert (report.sent, report.lost) == (10 + dropped, 1 + dropped)
            assert report.loss_share == pytest.approx(0.5 + 0.5 * share, abs=0.08)

    run(main())


def test_the_share_of_losses_is_that_of_the_last_second() -> None:
    notes = Notes()

    async def main() -> None:
        async with Drop(notes, {"drop": "1"}, context()) as link:
            await send_ticks(link, 5)
            assert link.report(CLOCK.now_ns()).loss_share == 1.0
            assert link.report(CLOCK.now_ns() + 1_000 * MS).loss_share == 0.5

    run(main())


def test_which_setpoints_are_lost_is_decided_by_the_seed() -> None:
    def kept(seed: int) -> list[float]:
        notes = Notes()

        async def main() -> None:
            async with Drop(notes, {"drop": "0.5"}, context(seed)) as link:
                await send_ticks(link, 100)

        run(main())
        return [value for _, value in notes.sends]

    assert kept(1) == kept(1)
    assert kept(1) != kept(2)


@pytest.mark.parametrize("kind", [Delay, Drop])
def test_everything_else_is_passed_on(kind: type[Delay] | type[Drop]) -> None:
    notes = Notes()

    async def main() -> None:
        async with kind(notes, {}, context()) as link:
            assert link.description == "notes"
            assert link.report(0).connected
            await link.arm()
            await link.disarm()
            link.stop_motors()
            await CLOCK.sleep_until(100 * MS)

    run(main())
    assert [what for _, what, _ in notes.taken] == ["open", "arm", "disarm", "stop", "close"]


@pytest.mark.parametrize("kind", [Delay, Drop])
def test_an_exception_closes_the_link_inside(kind: type[Delay] | type[Drop]) -> None:
    notes = Notes()

    async def main() -> None:
        async with kind(notes, {}, context()) as link:
            link.send(AttitudeThrust(1.0, LEVEL), 0)
            raise KeyError("flight code")

    with pytest.raises(KeyError, match="flight code"):
        run(main())
    assert notes.taken[-1][1] == "close"


@pytest.mark.parametrize(
    ("kind", "options", "message"),
    [
        (
            Delay,
            {"delay_ms": "-1"},
            "link layer delay: option delay_ms=-1: expected float >= 0.0; link layer delay has",
        ),
        (Delay, {"delay": "5"}, "unknown option delay=5; link layer delay has the options delay_ms, delay_jitter_ms"),
        (
            Drop,
            {"drop": "5"},
            "link layer drop: option drop=5: expected float <= 1.0; link layer drop has the options drop",
        ),
        (Drop, {"drop_rate": "0"}, "unknown option drop_rate=0"),
    ],
)
def test_wrong_options_say_what_there_is(kind: type[Delay] | type[Drop], options: dict[str, str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        kind(Notes(), options, context())
