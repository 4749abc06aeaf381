"""The loop around the tick, in virtual time, with a link of a few lines."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field

import pytest
from fake_vehicle import FakeLink, FakePose, FakeVehicle
from flight_bench import setup

from lcd_flight.flight import virtual_time
from lcd_flight.flight.loop import FlightLoop
from lcd_flight.flight.rate import RateKeeper, Wake
from lcd_flight.flight.virtual_time import VirtualClock
from lcd_flight.model import Command, Observer, Phase, RefusedError, Tick, TickInputs

MS = 1_000_000


@dataclass
class SlowClock:
    """A clock that wakes late as it is told, and whose caller takes its time."""

    wakes_late_ns: list[int]
    now: int = 1_000 * MS
    slept_until: list[int] = field(default_factory=list)

    def now_ns(self) -> int:
        return self.now

    async def sleep_until(self, deadline_ns: int) -> None:
        self.slept_until.append(deadline_ns)
        self.now = max(self.now, deadline_ns) + (self.wakes_late_ns.pop(0) if self.wakes_late_ns else 0)


def wakes(late_ms: list[float], work_ms: float = 1.0) -> list[tuple[float, float, int]]:
    """Deadline and time in ms since the start, and missed, of each wake-up."""
    clock = SlowClock([round(ms * MS) for ms in late_ms])

    async def run() -> list[Wake]:
        keeper, found = RateKeeper(clock), []
        for _ in late_ms:
            found.append(await keeper.next())
            clock.now += round(work_ms * MS)
        return found

    return [((w.deadline_ns - 1_000 * MS) / MS, (w.now_ns - 1_000 * MS) / MS, w.missed) for w in asyncio.run(run())]


class TestRateKeeper:
    def test_deadlines_are_absolute(self) -> None:
        assert wakes([0.3, 0.7, 0.1]) == [(10, 10.3, 0), (20, 20.7, 0), (30, 30.1, 0)]

    def test_a_late_wake_is_late_and_no_miss_within_a_period(self) -> None:
        assert wakes([9.9, 0.0]) == [(10, 19.9, 0), (20, 20.9, 0)]

    def test_whole_periods_slept_through_are_skipped_and_counted_once(self) -> None:
        assert wakes([35.0, 0.0, 0.0]) == [(40, 45.0, 3), (50, 50.0, 0), (60, 60.0, 0)]

    def test_work_that_takes_too_long_makes_no_burst(self) -> None:
        assert wakes([0.0, 0.0, 0.0], work_ms=25.0) == [(10, 10, 0), (30, 35, 1), (60, 60, 2)]


Script = Callable[[FlightLoop, FakeLink, FakePose], Awaitable[None]]


def run(
    script: Script, operator: Callable[[], tuple[Command, ...]] = tuple, observers: tuple[Observer, ...] = ()
) -> FakeLink:
    """Run a loop beside a script, then stop it."""

    async def main() -> FakeLink:
        clock = VirtualClock()
        vehicle = FakeVehicle(clock, setup().vehicle.mass_kg)
        link, pose = FakeLink(vehicle, clock), FakePose(vehicle, clock)
        loop = FlightLoop(setup(), clock, link, pose, operator, observers)
        running = asyncio.ensure_future(loop.run())
        await asyncio.wait_for(script(loop, link, pose), 200.0)
        loop.stop()
        await running
        return link

    return virtual_time.run(main())


async def take_off(loop: FlightLoop) -> None:
    loop.order(Command.CHECK)
    await loop.in_phase(Phase.PREFLIGHT)
    loop.order(Command.CHECKED)
    await loop.in_phase(Phase.READY)
    loop.order(Command.ARM)
    await loop.in_phase(Phase.ARMED)
    await loop.motors_done()
    loop.order(Command.TAKEOFF)
    await loop.in_phase(Phase.TAKEOFF)


@dataclass
class Listener:
    """Keeps what it is told; fails if it is told to."""

    fails_at: int | None = None
    ticks: list[Tick] = field(default_factory=list)

    def observe(self, inputs: TickInputs, tick: Tick) -> None:
        if len(self.ticks) == self.fails_at:
            raise OSError("disk full")
        self.ticks.append(tick)

    def close(self) -> None:
        """Nothing is held."""


class TestFlightLoop:
    def test_flies_a_whole_plan(self) -> None:
        listener = Listener()

        async def script(loop: FlightLoop, link: FakeLink, pose: FakePose) -> None:
            await take_off(loop)
            await loop.in_phase(Phase.LANDED)
            await loop.motors_done()

        link = run(script, observers=(listener,))
        assert link.calls == ["arm", "disarm"]
        assert link.vehicle.body.p_W[2] == 0.0
        assert [t.sequence for t in listener.ticks] == list(range(len(listener.ticks)))
        assert [s for s, _ in link.sent] == [t.setpoint for t in listener.ticks if t.setpoint is not None]
        assert {t.now_ns % (10 * MS) for t in listener.ticks} == {0}

    def test_commands_reach_the_next_tick_and_only_it(self) -> None:
        seen: list[tuple[Command, ...]] = []

        class Eavesdropper(Listener):
            def observe(self, inputs: TickInputs, tick: Tick) -> None:
                seen.append(inputs.commands)

        async def script(loop: FlightLoop, link: FakeLink, pose: FakePose) -> None:
            loop.order(Command.CHECK, Command.LAND)
            await loop.for_s(0.03)

        pressed = [(), (Command.DESCEND,), ()]
        run(script, lambda: pressed.pop(0) if pressed else (), (Eavesdropper(),))
        assert seen[:3] == [(Command.CHECK, Command.LAND), (Command.DESCEND,), ()]

    def test_a_stop_goes_out_in_every_tick(self) -> None:
        async def script(loop: FlightLoop, link: FakeLink, pose: FakePose) -> None:
            await take_off(loop)
            await loop.for_s(1.0)
            before = len(link.sent)
            loop.order(Command.STOP_MOTORS)
            await loop.for_s(0.1)
            assert len(link.sent) == before
            assert link.calls.count("stop") >= 10

        run(script)

    def test_an_arming_that_is_refused_is_told_to_who_waits(self) -> None:
        async def script(loop: FlightLoop, link: FakeLink, pose: FakePose) -> None:
            link.refuse_arming = "propellers are missing"
            loop.order(Command.CHECK, Command.CHECKED, Command.ARM)
            await loop.in_phase(Phase.ARMED)
            with pytest.raises(RefusedError, match="propellers are missing"):
                await loop.motors_done()

        run(script)

    def test_a_vehicle_that_will_not_disarm_is_stopped(self) -> None:
        async def script(loop: FlightLoop, link: FakeLink, pose: FakePose) -> None:
            await take_off(loop)
            link.refuse_disarming = "no answer"
            await loop.in_phase(Phase.LANDED)
            await loop.motors_done()
            assert link.calls[-2:] == ["disarm", "stop"]
            assert loop.notes == ["disarming failed (no answer); the motors were stopped"]

        run(script)

    def test_an_observer_that_fails_is_left_out_and_the_flight_goes_on(self) -> None:
        broken, sound = Listener(fails_at=5), Listener()

        async def script(loop: FlightLoop, link: FakeLink, pose: FakePose) -> None:
            await take_off(loop)
            await loop.in_phase(Phase.LANDED)
            assert loop.notes == ["Listener failed and was left out: OSError: disk full"]

        run(script, observers=(broken, sound))
        assert len(broken.ticks) == 5
        assert len(sound.ticks) > 900

    def test_a_setpoint_that_has_aged_is_withheld(self) -> None:
        """The pose source takes 60 ms: longer than a setpoint may be old."""

        class Slow(FakePose):
            slow = False

            def report(self, now_ns: int) -> object:  # type: ignore[override]
                found = super().report(now_ns)
                if self.slow:
                    running = asyncio.get_running_loop()
                    assert isinstance(running, virtual_time.VirtualLoop)
                    running.now_ns += 60 * MS
                return found

        async def main() -> None:
            clock = VirtualClock()
            vehicle = FakeVehicle(clock, setup().vehicle.mass_kg)
            link, pose = FakeLink(vehicle, clock), Slow(vehicle, clock)
            loop = FlightLoop(setup(), clock, link, pose)
            running = asyncio.ensure_future(loop.run())
            await take_off(loop)
            pose.slow, before = True, len(link.sent)
            await loop.for_s(0.5)
            assert len(link.sent) == before
            assert loop.figures.stale >= 5
            assert loop.figures.missed >= 5 * loop.figures.stale
            loop.stop()
            await running

        virtual_time.run(main())

    def test_figures(self) -> None:
        async def script(loop: FlightLoop, link: FakeLink, pose: FakePose) -> None:
            await loop.for_s(1.0)
            assert loop.figures.ticks in (100, 101)
            assert loop.figures.missed == loop.figures.stale == 0
            assert loop.figures.lateness_ms(0.99) == loop.figures.busy_ms(1.0) == 0.0
            assert len(loop.recent) == loop.figures.ticks

        run(script)

    def test_recent_inputs_are_those_of_two_seconds(self) -> None:
        async def script(loop: FlightLoop, link: FakeLink, pose: FakePose) -> None:
            await loop.for_s(3.0)
            assert len(loop.recent) == 200
            assert loop.recent[-1].now_ns - loop.recent[0].now_ns == 1990 * MS

        run(script)
