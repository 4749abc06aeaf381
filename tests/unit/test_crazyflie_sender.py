"""The sender's thread: a driver that blocks holds up nothing but itself, and what aged meanwhile is not sent."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from drivers.crazyflie import crtp_wire
from drivers.crazyflie.outbox import Mode, Outbox
from drivers.crazyflie.sender import Sender
from lcd_flight.flight.clock import RealClock

CLOCK = RealClock()
PATIENCE_S = 10.0
FALLBACK = crtp_wire.rpyt(0.0, 0.0, 0.0, 36_900)


class Driver:
    """Takes packets, and blocks where it is told to."""

    def __init__(self) -> None:
        self.packets: list[bytes] = []
        self.free = threading.Event()
        self.free.set()
        self.blocked = threading.Event()

    def __call__(self, packet: bytes) -> None:
        if not self.free.is_set():
            self.blocked.set()
            assert self.free.wait(PATIENCE_S)
        self.packets.append(packet)


def until(holds: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.002)


def setpoint(number: int) -> bytes:
    return crtp_wire.rpyt(float(number), 0.0, 0.0, 40_000)


def started(driver: Driver) -> Sender:
    sender = Sender(Outbox(lambda: FALLBACK, 100.0), CLOCK, driver)
    sender.start()
    sender.change(lambda box: box.unlock(CLOCK.now_ns()))
    until(lambda: crtp_wire.UNLOCK in driver.packets)
    return sender


def offer(sender: Sender, number: int) -> None:
    now_ns = CLOCK.now_ns()
    sender.change(lambda box: box.offer(setpoint(number), now_ns))


def test_a_setpoint_goes_out_without_being_waited_for_and_is_remembered() -> None:
    driver = Driver()
    sender = started(driver)
    offer(sender, 1)
    until(lambda: setpoint(1) in driver.packets)
    sent = [bytes.fromhex(record.packet) for record in sender.transmitted()]
    assert sent == driver.packets[: len(sent)]
    assert sent[-1] == setpoint(1)
    sender.end()


def test_a_driver_that_blocks_blocks_nobody_and_then_the_freshest_goes_out() -> None:
    driver = Driver()
    sender = started(driver)
    offer(sender, 0)
    until(lambda: setpoint(0) in driver.packets)
    driver.free.clear()
    offer(sender, 1)
    assert driver.blocked.wait(PATIENCE_S)
    for number in range(2, 50):
        offer(sender, number)  # returns although the driver does not
    driver.packets.clear()
    driver.free.set()
    until(lambda: setpoint(49) in driver.packets)
    between = [packet for packet in driver.packets if packet not in (setpoint(1), setpoint(49), FALLBACK)]
    assert between == []
    sender.end()


def test_what_aged_behind_a_blocked_driver_is_not_sent() -> None:
    driver = Driver()
    sender = started(driver)
    offer(sender, 0)
    until(lambda: setpoint(0) in driver.packets)
    driver.free.clear()
    offer(sender, 1)
    assert driver.blocked.wait(PATIENCE_S)
    offer(sender, 2)
    time.sleep(0.06)
    driver.free.set()
    until(lambda: FALLBACK in driver.packets)
    assert setpoint(2) not in driver.packets
    assert sender.stale == 1
    sender.end()


def test_without_anybody_else_alive_it_falls_back_by_itself() -> None:
    driver = Driver()
    sender = started(driver)
    offer(sender, 1)
    until(lambda: FALLBACK in driver.packets)
    assert sender.mode is Mode.FALLBACK
    sender.change(lambda box: box.stop(CLOCK.now_ns()))
    until(lambda: crtp_wire.STOP in driver.packets)
    assert sender.latched
    sender.end()


def test_the_end_sends_what_is_due_and_ends_the_thread() -> None:
    driver, before = Driver(), threading.active_count()
    sender = started(driver)
    sender.change(lambda box: box.end(CLOCK.now_ns()))
    sender.change(lambda box: box.rest())
    sender.end()
    assert driver.packets[-3:] == [crtp_wire.NOTIFY_STOP] * 3
    assert threading.active_count() == before
