"""What listens to a flight as `lcd-fly` has it: the log, the live stream, and a refused flight that leaves nothing."""

from __future__ import annotations

import io
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import short_mission
import synthetic_flight
import zmq

from lcd_flight import api
from lcd_flight.flight.recording import Recording
from lcd_flight.flight.replay import compare, replayed
from lcd_flight.flight.session import FlightOptions
from lcd_flight.model import Observer, Outcome, RefusedError, Tick, TickInputs
from lcd_flight.observers import LivePublisher, LiveStream, LogThread
from lcd_flight.record import LogWriter, read_log, read_ticks

PAIRS = synthetic_flight.flight()
HEADER = synthetic_flight.header()


def free_endpoint() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp://127.0.0.1:{probe.getsockname()[1]}"


@cache
def prepared() -> api.PreparedFlight:
    return api.plan(short_mission.mission())


@cache
def rehearsed() -> api.Rehearsal:
    return api.rehearse(prepared(), runs=5)


@pytest.fixture
def taken_endpoint() -> Iterator[str]:
    with zmq.Context() as context, context.socket(zmq.PUB) as holder:
        holder.setsockopt(zmq.LINGER, 0)
        holder.bind(endpoint := free_endpoint())
        yield endpoint


def test_a_flight_leaves_a_log_with_what_was_predicted_and_tells_other_observers(tmp_path: Path) -> None:
    listener = short_mission.Listener()
    flown = api.fly(prepared(), rehearsed(), FlightOptions(fast=True), log_folder=tmp_path, observers=(listener,))
    assert flown.result.outcome is Outcome.LANDED
    assert read_ticks(flown.log) == listener.flight
    assert flown.log_statistics.written == len(listener.flight)
    (prediction,) = read_log(flown.log).header.predictions
    leg = prepared().planned.plan.legs[prediction.leg]
    assert leg.waypoints is not None
    assert (prediction.method, prediction.segment_errors_m) == ("minimum-snap", None)
    assert listener.closed == 1
    assert compare(read_ticks(flown.log), short_mission.setup()).equal


def test_a_flight_that_is_refused_before_its_first_tick_leaves_no_log(tmp_path: Path, taken_endpoint: str) -> None:
    mission = short_mission.mission(motion_capture={"endpoint": taken_endpoint})
    flight = replace(prepared(), mission=mission)
    with pytest.raises(RefusedError, match=taken_endpoint.rpartition(":")[2]):
        api.fly(flight, rehearsed(), log_folder=tmp_path, live=None)
    assert list(tmp_path.iterdir()) == []


def test_an_error_after_the_first_tick_keeps_the_log(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    recording = Recording(path, HEADER, live=None, lossless=True)
    recording.observers[0].observe(*PAIRS[0])
    error = ZeroDivisionError()
    recording.__exit__(type(error), error, None)
    assert read_ticks(path) == PAIRS[:1]


def test_without_its_endpoint_the_flight_goes_on_and_says_so(tmp_path: Path, taken_endpoint: str) -> None:
    with Recording(tmp_path / "flight.mcap", HEADER, live=taken_endpoint, lossless=True) as recording:
        for observer in recording.observers:
            observer.observe(*PAIRS[0])
    (note,) = recording.notes
    assert note.startswith(f"no live view at {taken_endpoint}: Address already in use; --live")
    assert recording.statistics.written == 1


# What observers cost the loop. Both sides in the same run; no absolute times.


def paced_lateness_ms(observers: tuple[Observer, ...], ticks: int = 40) -> float:
    """Median lateness of ticks of 5 ms with these listeners."""
    lateness, deadline_s = [], time.monotonic()
    for inputs, tick in PAIRS[:ticks]:
        deadline_s += 0.005
        time.sleep(max(0.0, deadline_s - time.monotonic()))
        lateness.append(time.monotonic() - deadline_s)
        for observer in observers:
            observer.observe(inputs, tick)
    return 1e3 * float(np.median(lateness))


def overlaps(with_them: list[float], without: list[float]) -> bool:
    """Whether the rounds with listeners are not all later than every round without."""
    return min(with_them) <= max(without)


class Slow:
    """A listener as none may be: it takes longer than a tick."""

    def observe(self, _inputs: TickInputs, _tick: Tick) -> None:
        time.sleep(0.006)

    def close(self) -> None:
        pass


@pytest.mark.realtime
def test_neither_monitor_nor_foxglove_makes_ticks_late(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    command = [sys.executable, "-c", "from lcd_flight.cli.main import lcd; lcd()", "monitor", endpoint]
    with ExitStack() as stack:
        recording = stack.enter_context(Recording(tmp_path / "f.mcap", HEADER, live=endpoint, lossless=False))
        watcher = stack.enter_context(
            subprocess.Popen([*command, "--foxglove", "--port", "0"], stdout=subprocess.PIPE, text=True)
        )
        stack.callback(watcher.kill)
        assert watcher.stdout is not None
        while "PREFLIGHT" not in watcher.stdout.readline():  # it is connected, and shows what it is sent
            paced_lateness_ms(recording.observers, ticks=12)
        without, watched = [], []
        for _ in range(5):
            without.append(paced_lateness_ms(()))
            watched.append(paced_lateness_ms(recording.observers))
        assert overlaps(watched, without), (watched, without)


def test_the_comparison_can_tell(tmp_path: Path) -> None:
    without, slowed = zip(*((paced_lateness_ms(()), paced_lateness_ms((Slow(),))) for _ in range(2)), strict=True)
    assert not overlaps(list(slowed), list(without))


def test_a_watched_flight_computes_less_for_its_watchers_than_for_itself() -> None:
    """Processor time of this thread, so that what else the machine does is left out."""
    setup, inputs = short_mission.setup(), [inputs for inputs, _ in flown_ticks()]
    began_ns = time.thread_time_ns()
    ticks = list(replayed(inputs, setup))
    flying_ns = time.thread_time_ns() - began_ns
    stream = LiveStream(LivePublisher(free_endpoint()), b"live/1/flight\0{}")
    began_ns = time.thread_time_ns()
    for given, decided in zip(inputs, ticks, strict=True):
        stream.observe(given, decided)
    watching_ns = time.thread_time_ns() - began_ns
    stream.close()
    assert watching_ns < 0.5 * flying_ns


@cache
def flown_ticks() -> list[tuple[TickInputs, Tick]]:
    return short_mission.fly()[1].flight


class Disk(io.BytesIO):
    """It takes the description; after that every write waits, or fails."""

    def __init__(self, fault: Callable[[], None]) -> None:
        super().__init__()
        self.fault: Callable[[], None] | None = None
        self._fault = fault

    def begin(self) -> None:
        self.fault = self._fault

    def write(self, data: bytes) -> int:  # type: ignore[override]
        if self.fault is not None:
            self.fault()
        return super().write(data)


def full() -> None:
    raise OSError(28, "No space left on device")


@pytest.mark.realtime
@pytest.mark.parametrize("fault", [full, lambda: time.sleep(0.1)], ids=["full", "blocking"])
def test_no_disk_makes_ticks_late(fault: Callable[[], None]) -> None:
    disk = Disk(fault)
    log = LogThread(LogWriter(disk, HEADER), close_wait_s=30.0)
    disk.begin()
    without, logged = [], []
    for _ in range(5):
        without.append(paced_lateness_ms(()))
        logged.append(paced_lateness_ms((log,)))
    disk.fault = None
    log.close()
    assert overlaps(logged, without), (logged, without)
    assert (log.statistics.error is None) == (fault is not full)
