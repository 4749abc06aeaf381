from __future__ import annotations

from itertools import pairwise

import pytest
from fake_vehicle import FakeLink, FakeVehicle
from flight_bench import setup

from lcd_flight.flight import virtual_time
from lcd_flight.flight.memory import Memory
from lcd_flight.flight.safe_end import descend_and_stop
from lcd_flight.flight.virtual_time import VirtualClock
from lcd_flight.model import Phase, State
from lcd_flight.model.frames import from_yaw, tilt_of, yaw_of

HIGH = State((0.0, 0.0, 1.2), (0.5, 0.0, 0.3), from_yaw(0.8), (0.0, 0.0, 0.0))


def ended(memory: Memory, *, link_fails: bool = False) -> FakeLink:
    """The link after the safe end of a flight whose last tick left this memory."""

    async def main() -> FakeLink:
        clock = VirtualClock()
        link = FakeLink(FakeVehicle(clock, setup().vehicle.mass_kg), clock)
        link.vehicle.armed = True
        link.vehicle.body.p_W, link.vehicle.body.v_W = HIGH.p_WB, HIGH.v_WB_W
        if link_fails:
            link.send = broken  # type: ignore[method-assign]
            with pytest.raises(OSError, match="gone"):
                await descend_and_stop(link, clock, setup(), memory)
        else:
            await descend_and_stop(link, clock, setup(), memory)
        link.vehicle.advance()
        return link

    return virtual_time.run(main())


def broken(*_arguments: object) -> None:
    raise OSError("the radio has gone")


def test_in_the_air_it_descends_level_at_the_control_rate_and_stops() -> None:
    link = ended(Memory(phase=Phase.TRACK, state=HIGH, hover_N=0.3))
    setpoints, stamps = zip(*link.sent, strict=True)
    assert len(set(setpoints)) == 1
    assert tilt_of(setpoints[0].q_WB) == pytest.approx(0.0)
    assert yaw_of(setpoints[0].q_WB) == pytest.approx(0.8)
    assert setpoints[0].thrust_N < 0.3
    assert {after - before for before, after in pairwise(stamps)} == {10_000_000}
    assert link.vehicle.body.p_W[2] == 0.0
    assert link.calls == ["stop"]


def test_armed_on_the_ground_it_stops_at_once() -> None:
    link = ended(Memory(phase=Phase.ARMED, state=HIGH))
    assert link.sent == []
    assert link.calls == ["stop"]


@pytest.mark.parametrize("phase", [Phase.IDLE, Phase.PREFLIGHT, Phase.READY, Phase.LANDED])
def test_where_no_motor_turns_nothing_is_asked(phase: Phase) -> None:
    link = ended(Memory(phase=phase, state=HIGH))
    assert link.sent == link.calls == []


def test_a_link_that_fails_too_is_at_least_told_to_stop() -> None:
    link = ended(Memory(phase=Phase.TRACK, state=HIGH), link_fails=True)
    assert link.calls == ["stop"]
