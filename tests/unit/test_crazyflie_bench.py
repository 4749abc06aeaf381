"""The faults of the bench, in virtual time."""

from __future__ import annotations

import struct
from typing import Any

import pytest
from virtual_crazyflie import rpyt

from lcd_flight.flight.virtual_time import VirtualClock
from lcd_flight.model import LinkContext
from lcd_flight.worlds import load_vehicle
from sim_bridge.crazyflie.bench import Bench
from sim_bridge.crazyflie.options import CrazyflieOptions
from sim_bridge.crazyflie.radio import MOST_UNDER_WAY, Queue

MS = 1_000_000
PING = bytes.fromhex("FC 00 01")


class Line:
    """A client at a bench in virtual time."""

    def __init__(self, **options: Any) -> None:
        context = LinkContext(
            vehicle=load_vehicle("crazyflie-2.1"),
            clock=VirtualClock(),
            initial_position_m=(0.0, 0.0, 0.0),
            initial_yaw_rad=0.0,
            seed=5,
        )
        self.bench = Bench(CrazyflieOptions(**options), context)
        self.now_ns = 0
        self.said: list[str] = []

    def send(self, datagram: bytes) -> list[bytes]:
        self.bench.receive(datagram, self.now_ns)
        return self.bench.outgoing(self.now_ns)

    def wait(self, ms: float) -> list[bytes]:
        self.now_ns += round(ms * MS)
        self.bench.advance_to(self.now_ns)
        self.said += self.bench.said()
        return self.bench.outgoing(self.now_ns)

    def fly(self, ms: float, thrust: int) -> int:
        """Stream a setpoint and a ping; how many pings come back."""
        pings = 0
        for _ in range(round(ms / 10)):
            pings += PING in [*self.send(rpyt(thrust)), *self.send(PING), *self.wait(10.0)]
        return pings


def test_without_faults_everything_arrives_at_once() -> None:
    line = Line()
    line.wait(200.0)
    assert line.send(PING) == [PING]
    assert line.said == ["armed"]


def test_arming_anew_every_half_minute_is_no_news() -> None:
    line = Line()
    line.wait(95_000.0)
    assert line.said == ["armed"]


def test_a_share_is_lost_each_way() -> None:
    line = Line(drop=0.1)
    answered = sum(line.send(PING) == [PING] for _ in range(2000))
    assert answered == pytest.approx(2000 * 0.81, abs=80)


@pytest.mark.parametrize("lost", [1, 2, 7])
def test_one_datagram_is_lost_and_no_other(lost: int) -> None:
    line = Line(drop_at=lost)
    assert [line.send(PING) == [PING] for _ in range(10)] == [number != lost for number in range(1, 11)]


def test_delay_is_each_way() -> None:
    line = Line(delay_ms=20.0)
    assert line.send(PING) == []
    assert line.wait(39.0) == []
    assert line.wait(2.0) == [PING]


def test_datagrams_that_are_under_way_stay_in_order() -> None:
    line = Line(delay_ms=20.0)
    sent = [bytes((0xFC, number)) for number in range(20)]
    arrived = []
    for datagram in sent:
        arrived += [*line.send(datagram), *line.wait(3.0)]
    assert [*arrived, *line.wait(100.0)] == sent


def test_frozen_it_is_deaf_and_dumb_and_lives_on() -> None:
    """Counted from the first thrust; after 2 s without setpoints the vehicle has locked itself."""
    line = Line(freeze_s=0.5, freeze_ms=3000.0)
    line.wait(200.0)
    line.fly(50.0, 0)
    assert 45 <= line.fly(500.0, 45_000) <= 51
    assert line.fly(2900.0, 45_000) <= 1
    assert line.fly(300.0, 0) >= 15
    assert line.said[-2:] == ["no setpoints: level, thrust kept", "locked until reboot"]


def test_without_power_it_falls_and_nothing_is_heard_of_it_again() -> None:
    line = Line(die_s=0.6)
    line.wait(200.0)
    line.fly(50.0, 0)
    line.fly(550.0, 50_000)
    height_m = line.bench.vehicle.body.state.p_WB[2]
    assert line.fly(1500.0, 50_000) <= 6
    assert line.bench.vehicle.body.state.p_WB[2] < height_m
    assert "all power lost" in line.said
    assert line.send(bytes.fromhex("FF FE F0 01")) == []


def test_a_low_battery_is_reported() -> None:
    line = Line(battery_V=3.3)
    line.wait(200.0)
    assert line.bench.vehicle.body.battery_V == pytest.approx(3.3, abs=0.01)


def test_who_fell_is_put_upright() -> None:
    line = Line(upright_s=1.0)
    line.wait(200.0)
    line.fly(50.0, 0)
    line.fly(800.0, 55_000)
    for _ in range(150):
        line.send(b"\x3c" + struct.pack("<fffH", 110.0, 0.0, 0.0, 40_000))
        line.wait(10.0)
    assert any(text.startswith("hit the floor, tilted by") for text in line.said)
    assert line.bench.vehicle.body.broken
    line.fly(1500.0, 0)
    assert line.said[-1] in ("put upright", "crashed")
    assert "put upright" in line.said
    assert not line.bench.vehicle.body.broken


def test_what_is_under_way_is_bounded() -> None:
    queue = Queue()
    for _ in range(MOST_UNDER_WAY + 100):
        queue.push(1, b"x")
    assert sum(1 for _ in iter(lambda: queue.pop(2), None)) == MOST_UNDER_WAY
