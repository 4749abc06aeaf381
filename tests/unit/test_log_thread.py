"""The thread that logs: it never delays a tick, drops and counts where it must, and a failing disk ends no flight."""

from __future__ import annotations

import os
import threading
from contextlib import suppress
from pathlib import Path

import pytest
import synthetic_flight
from synthetic_flight import Pair

from lcd_flight.model import Tick, TickInputs
from lcd_flight.observers import LogStatistics, LogThread
from lcd_flight.record import LogWriter, read_ticks

PAIRS = synthetic_flight.flight()[:60]


class Sink:
    """Keeps what it is given; waits at the gate, fails at a tick or at the end where it is told to."""

    def __init__(self, *, open_gate: bool = True, fail_at: int | None = None, fail_to_close: bool = False) -> None:
        self.gate = threading.Event()
        self.entered = threading.Event()
        if open_gate:
            self.gate.set()
        self.fail_at = fail_at
        self.fail_to_close = fail_to_close
        self.ticks: list[Pair] = []
        self.closed = 0

    def write(self, inputs: TickInputs, tick: Tick) -> None:
        self.entered.set()
        self.gate.wait()
        if tick.sequence == self.fail_at:
            raise OSError(28, "No space left on device")
        self.ticks.append((inputs, tick))

    def close(self) -> None:
        self.closed += 1
        if self.fail_to_close:
            raise OSError(5, "Input/output error")


def observe(thread: LogThread, pairs: list[Pair]) -> None:
    for inputs, tick in pairs:
        thread.observe(inputs, tick)


def flying(thread: LogThread, pairs: list[Pair]) -> threading.Thread:
    """The same in a thread, for what may wait; a daemon, so that a fault fails the test and does not hang it."""
    flight = threading.Thread(target=observe, args=(thread, pairs), daemon=True)
    flight.start()
    return flight


def test_everything_is_written_in_order() -> None:
    sink = Sink()
    thread = LogThread(sink)
    observe(thread, PAIRS)
    thread.close()
    assert sink.ticks == PAIRS
    assert sink.closed == 1
    assert thread.statistics == LogStatistics(written=60, dropped=0, error=None)


def test_a_disk_that_blocks_delays_nothing_and_what_has_no_room_is_counted() -> None:
    sink = Sink(open_gate=False)
    thread = LogThread(sink, capacity=10)
    observe(thread, PAIRS[:1])
    assert sink.entered.wait(10.0)  # the thread holds the first tick, the queue is empty
    observe(thread, PAIRS[1:])  # returns although nothing is written
    assert sink.ticks == []
    sink.gate.set()
    thread.close()
    assert sink.ticks == PAIRS[:11]
    assert thread.statistics == LogStatistics(written=11, dropped=49, error=None)


def test_without_loss_it_waits_for_room() -> None:
    sink = Sink(open_gate=False)
    thread = LogThread(sink, capacity=10, lossless=True)
    flight = flying(thread, PAIRS)
    assert sink.entered.wait(10.0)
    flight.join(0.05)
    assert flight.is_alive()  # the queue is full, and it waits
    sink.gate.set()
    flight.join(10.0)
    assert not flight.is_alive()
    thread.close()
    assert sink.ticks == PAIRS
    assert thread.statistics == LogStatistics(written=60, dropped=0, error=None)


@pytest.mark.parametrize("lossless", [True, False])
def test_a_disk_that_fails_ends_the_log_and_not_the_flight(lossless: bool) -> None:
    sink = Sink(fail_at=20)
    thread = LogThread(sink, capacity=100, lossless=lossless)
    observe(thread, PAIRS)
    thread.close()
    assert sink.ticks == PAIRS[:20]
    assert thread.statistics == LogStatistics(20, 40, "OSError: [Errno 28] No space left on device")


def test_a_failure_at_the_end_is_told() -> None:
    thread = LogThread(Sink(fail_to_close=True))
    observe(thread, PAIRS)
    thread.close()
    assert thread.statistics == LogStatistics(60, 0, "OSError: [Errno 5] Input/output error")


def test_the_first_failure_is_the_one_told() -> None:
    thread = LogThread(Sink(fail_at=0, fail_to_close=True))
    observe(thread, PAIRS)
    thread.close()
    assert thread.statistics.error == "OSError: [Errno 28] No space left on device"


def test_a_fault_of_ours_ends_no_flight_either() -> None:
    class Faulty(Sink):
        def write(self, inputs: TickInputs, tick: Tick) -> None:
            raise ZeroDivisionError("a fault")

    thread = LogThread(Faulty())
    observe(thread, PAIRS)
    thread.close()
    assert thread.statistics == LogStatistics(0, 60, "ZeroDivisionError: a fault")


def test_a_disk_that_hangs_does_not_keep_the_process() -> None:
    sink = Sink(open_gate=False)
    thread = LogThread(sink, close_wait_s=0.05)
    observe(thread, PAIRS)
    thread.close()
    assert thread.statistics == LogStatistics(0, 60, "the disk did not take the log within 0.05 s")
    sink.gate.set()


def test_closing_twice_is_closing_once() -> None:
    sink = Sink()
    thread = LogThread(sink)
    thread.close()
    thread.close()
    assert sink.closed == 1


def test_the_thread_has_the_priority_of_the_loop() -> None:
    """One of lower priority would be put aside while it holds the interpreter, and the loop would wait for it."""
    log = LogThread(Sink())
    found: list[int] = []

    def fly() -> None:
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))  # of this thread; needs no permission
        log.observe(*PAIRS[0])
        found.append(os.sched_getscheduler(log._thread.native_id or 0))

    loop = threading.Thread(target=fly)
    loop.start()
    loop.join()
    log.close()
    assert found == [os.SCHED_BATCH]


def test_a_real_log_comes_back_whole(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    thread = LogThread(LogWriter(path, synthetic_flight.header()), capacity=5, lossless=True)
    flying(thread, PAIRS).join(30.0)
    thread.close()
    assert read_ticks(path) == PAIRS


def test_a_disk_that_fills_up_in_flight_is_told_and_what_was_flushed_stays(tmp_path: Path) -> None:
    path = tmp_path / "filling.mcap"
    pairs = synthetic_flight.flight()

    class Filling:
        """A file that takes so many bytes and no more."""

        def __init__(self) -> None:
            self.file = path.open("wb", buffering=0)
            self.room = 150_000

        def write(self, data: bytes) -> int:
            if len(data) > self.room:
                raise OSError(28, "No space left on device")
            self.room -= len(data)
            return self.file.write(data)

        def __getattr__(self, name: str) -> object:
            return getattr(self.file, name)

    disk = Filling()
    thread = LogThread(LogWriter(disk, synthetic_flight.header()), capacity=len(pairs))  # type: ignore[arg-type]
    observe(thread, pairs)
    thread.close()
    with suppress(OSError):
        disk.file.close()
    kept = read_ticks(path)
    assert kept == pairs[: len(kept)]
    assert thread.statistics.error == "OSError: [Errno 28] No space left on device"
    assert 0 < len(kept) <= thread.statistics.written < len(pairs)
