"""Arming asks until the vehicle says so, and gives up with its reason; in virtual time."""

from __future__ import annotations

import itertools

import pytest

from drivers.crazyflie import arming, crtp_wire
from drivers.crazyflie.picture import Picture
from drivers.crazyflie.status import Status
from lcd_flight.flight import virtual_time
from lcd_flight.model import RefusedError

CLOCK = virtual_time.VirtualClock()
ARM, DISARM = crtp_wire.arming(True, 12), crtp_wire.arming(False, 12)
READY = Status.CAN_ARM


class Vehicle:
    """Arms at the `deaf`-th request; a picture of it is up to date at once."""

    def __init__(self, status: Status, deaf: int = 0) -> None:
        self.picture = Picture()
        self.picture.status = status
        self.asked: list[tuple[int, bytes]] = []
        self._deaf = deaf

    def request(self, packet: bytes) -> None:
        self.asked.append((CLOCK.now_ns(), packet))
        assert self.picture.status is not None
        if len(self.asked) > self._deaf:
            armed = packet == ARM
            self.picture.status = READY | (Status.ARMED | Status.CAN_FLY if armed else Status(0))


def test_one_request_where_it_is_heard() -> None:
    vehicle = Vehicle(READY)
    virtual_time.run(arming.arm(vehicle.picture, vehicle.request, 12, CLOCK))
    assert [packet for _, packet in vehicle.asked] == [ARM]


def test_none_where_it_has_armed_by_itself() -> None:
    vehicle = Vehicle(READY | Status.ARMED | Status.AUTO_ARM)
    virtual_time.run(arming.arm(vehicle.picture, vehicle.request, 12, CLOCK))
    assert vehicle.asked == []


def test_a_request_that_got_lost_is_repeated_every_fifth_of_a_second() -> None:
    vehicle = Vehicle(READY, deaf=3)
    virtual_time.run(arming.arm(vehicle.picture, vehicle.request, 12, CLOCK))
    times = [ns for ns, _ in vehicle.asked]
    assert len(times) == 4
    assert all(0.2e9 <= b - a <= 0.25e9 for a, b in itertools.pairwise(times))


def test_one_that_never_answers_is_refused_in_two_seconds() -> None:
    vehicle = Vehicle(READY, deaf=10**6)

    async def main() -> int:
        began_ns = CLOCK.now_ns()
        with pytest.raises(RefusedError, match="its own checks have not passed"):
            await arming.arm(vehicle.picture, vehicle.request, 12, CLOCK)
        return CLOCK.now_ns() - began_ns

    assert 2e9 <= virtual_time.run(main()) <= 2.1e9


@pytest.mark.parametrize("bit", [Status.LOCKED, Status.CRASHED, Status.TUMBLED])
def test_one_in_trouble_is_not_asked(bit: Status) -> None:
    vehicle = Vehicle(READY | bit)
    with pytest.raises(RefusedError, match=bit.trouble.split(":", maxsplit=1)[0]):
        virtual_time.run(arming.arm(vehicle.picture, vehicle.request, 12, CLOCK))
    assert vehicle.asked == []


def test_an_armed_vehicle_that_cannot_fly_is_refused() -> None:
    vehicle = Vehicle(READY | Status.ARMED)
    with pytest.raises(RefusedError, match="armed but cannot fly"):
        virtual_time.run(arming.ready_to_fly(vehicle.picture, CLOCK))


def test_disarming_is_asked_for_where_arming_was() -> None:
    vehicle = Vehicle(READY | Status.ARMED, deaf=1)
    virtual_time.run(arming.disarm(vehicle.picture, vehicle.request, 12, CLOCK))
    assert [packet for _, packet in vehicle.asked] == [DISARM] * 2
    vehicle = Vehicle(READY | Status.ARMED | Status.AUTO_ARM)
    virtual_time.run(arming.disarm(vehicle.picture, vehicle.request, 12, CLOCK))
    assert vehicle.asked == []


def test_a_vehicle_that_stays_armed_is_told() -> None:
    vehicle = Vehicle(READY | Status.ARMED, deaf=10**6)
    with pytest.raises(RefusedError, match="stays armed"):
        virtual_time.run(arming.disarm(vehicle.picture, vehicle.request, 12, CLOCK))
