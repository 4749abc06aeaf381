"""Flights that are killed in the middle, each in a process of its own: `python killed_flights.py FOLDER COUNT SEED`.

One process makes ready, then forks: every child flies the short mission in virtual time, thirty times as fast as in the
air, and tells through a pipe which tick it has decided. The pipe outlives it. Ticks are held up where the log's queue
is full, so that what waits in it is as little as in a flight in real time.
"""

from __future__ import annotations

import json
import os
import random
import signal
import struct
import sys
import time
from datetime import UTC, datetime
from pathlib import Path

import short_mission
import synthetic_flight

from lcd_flight.model import Tick, TickInputs
from lcd_flight.observers import LogThread
from lcd_flight.record import LogWriter

LAST_TICK = 1000
"""Kills come before this one: in pre-flight, take-off, on the trajectory or in the landing."""

QUEUE = 10

_BEACON = struct.Struct("<q")


class Beacon:
    """An observer that tells of every tick."""

    def __init__(self, pipe: int) -> None:
        self._pipe = pipe

    def observe(self, _inputs: TickInputs, tick: Tick) -> None:
        os.write(self._pipe, _BEACON.pack(tick.sequence))

    def close(self) -> None:
        pass


def fly(path: Path, pipe: int) -> None:
    """One flight, until it is over."""
    plan, vehicle, limits = short_mission.plan(), short_mission.vehicle(), short_mission.mission().safety_limits()
    header = synthetic_flight.header(plan=plan, vehicle=vehicle, limits=limits, started=datetime.now(UTC))
    log = LogThread(LogWriter(path, header), capacity=QUEUE, lossless=True)
    short_mission.fly(others=(log, Beacon(pipe)))


def begin(path: Path) -> tuple[int, int]:
    """Fork a flight: its process, and the end of the pipe that it tells its ticks through."""
    reading, writing = os.pipe()
    child = os.fork()
    if child:
        os.close(writing)
        return child, reading
    try:
        fly(path, writing)
    finally:
        os._exit(0)


def killed(path: Path, moment: int, delay_s: float) -> int:
    """Fly, kill a while after a tick, and give the last tick that was told of."""
    child, reading = begin(path)
    last = -1
    with os.fdopen(reading, "rb") as pipe:
        while len(data := pipe.read(_BEACON.size)) == _BEACON.size:
            (last,) = _BEACON.unpack(data)
            if last == moment:
                time.sleep(delay_s)
                os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return last


def main(folder: Path, count: int, seed: int) -> None:
    """Print a line of JSON for each flight: its log, and the last tick that it told of."""
    short_mission.fly()  # kernels compiled, everything imported
    chance = random.Random(seed)  # noqa: S311 - moments, not secrets
    for number in range(count):
        path = folder / f"{number}.mcap"
        last = killed(path, chance.randrange(LAST_TICK), chance.uniform(0.0, 0.005))
        print(json.dumps({"log": path.name, "last_tick": last}), flush=True)  # noqa: T201


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
