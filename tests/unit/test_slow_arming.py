"""A vehicle that takes longer to arm than the flight waits is not taken off with, and nothing hangs."""

from __future__ import annotations

import asyncio

from fake_vehicle import FakeLink, FakePose, FakeVehicle
from flight_bench import setup

from lcd_flight.flight import virtual_time
from lcd_flight.flight.director import Direction, Director
from lcd_flight.flight.loop import FlightLoop
from lcd_flight.flight.operator import Operator
from lcd_flight.flight.virtual_time import VirtualClock
from lcd_flight.model import Outcome


def directed(arming_s: float) -> tuple[Direction, FakeLink]:
    async def main() -> tuple[Direction, FakeLink]:
        clock = VirtualClock()
        vehicle = FakeVehicle(clock, setup().vehicle.mass_kg)
        link, pose = FakeLink(vehicle, clock), FakePose(vehicle, clock)
        link.arming_s = arming_s
        loop = FlightLoop(setup(), clock, link, pose)
        ticking = asyncio.create_task(loop.run())
        direction = await Director(loop, setup(), Operator()).direct(True, 0.0)
        loop.stop()
        await ticking
        return direction, link

    return virtual_time.run(main())


def test_it_is_refused_and_disarmed() -> None:
    direction, link = directed(12.0)
    assert (direction.outcome, direction.reason) == (Outcome.REFUSED, "the vehicle was not armed within 10 s")
    assert link.calls.count("disarm") == 1


def test_one_that_just_makes_it_flies() -> None:
    direction, _ = directed(9.0)
    assert direction.outcome is None
