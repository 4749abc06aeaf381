"""A hundred `lcd-fly` processes in real time, each killed at a random moment: what is left of their logs?"""

from __future__ import annotations

import contextlib
import json
import random
import secrets
import signal
import socket
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from mcap.reader import make_reader

from lcd_flight.flight.replay import compare
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.model import LcdError, Vehicle
from lcd_flight.monitor.source import LiveSource
from lcd_flight.record.reader import read_flight
from lcd_flight.record.recover import condition, recover
from lcd_flight.wire.live_frame import LiveReport

SIDE_BY_SIDE = 2
LONGEST_S = 18.0
"""From the first report of a flight on: what the mission takes, from pre-flight to landing."""
ALLOWED_S = 1.0
_PORTS = range(20_000, 30_000)

_NOTHING: dict[str, Any] = {
    "told_s": None,
    "lost_s": None,
    "opens": False,
    "description": False,
    "replays": False,
}


def killed_flights(count: int = 100, seed: int = 1) -> dict[str, Any]:
    """Kill flights of the mission that ships; compare what each had told live with what its log holds.

    Lost is the time from the last tick in the log to the last that was told of, ten times a second.
    """
    chance = random.Random(seed)  # noqa: S311 - moments, not secrets
    moments_s = [chance.uniform(0.0, LONGEST_S) for _ in range(count)]
    with ThreadPoolExecutor(SIDE_BY_SIDE) as pool:
        rows = []
        for row in pool.map(_killed, moments_s):
            rows.append(row)
            if len(rows) % 10 == 0:
                print(f"{len(rows)}/{count} flights")  # noqa: T201
    flown = [row for row in rows if row["told_s"] is not None]
    summary = {
        "flights": count,
        "killed": sum(not row["ended_before"] for row in rows),
        "logs_that_open_after_recovery": sum(row["opens"] for row in rows),
        "with_description": sum(row["description"] for row in rows),
        "largest_loss_s": max(row["lost_s"] for row in flown),
        "more_than_a_second_lost": sum(row["lost_s"] > ALLOWED_S for row in flown),
        "replayed_to_the_bit": sum(row["replays"] for row in rows),
    }
    return {"seed": seed, "mission": "demo", "summary": summary, "rows": rows}


def _killed(moment_s: float) -> dict[str, Any]:
    """One flight, killed so long after its first report."""
    with tempfile.TemporaryDirectory() as folder:
        live, ended_before = _flown(Path(folder), moment_s)
        about = {"moment_s": round(moment_s, 3), "ended_before": ended_before}
        logs = list(Path(folder).glob("*.mcap"))
        return {**about, **(_examined(logs[0], live) if logs else {**_NOTHING, "error": "no log"})}


def _flown(folder: Path, moment_s: float) -> tuple[LiveReport | None, bool]:
    """The last report before the kill, and whether the flight had ended by itself."""
    mocap, live = _free_port(), f"tcp://127.0.0.1:{_free_port()}"
    mission = folder / "mission.yaml"
    text = (Path(__file__).parents[1] / "missions" / "four_waypoints.yaml").read_text()
    mission.write_text(text.replace("tcp://127.0.0.1:5555", f"tcp://127.0.0.1:{mocap}"))
    command = [sys.executable, "-c", "from lcd_flight.cli.main import lcd_fly; lcd_fly()"]
    options = ["--log", str(folder), "--live", live, "--quiet", "--rehearse", "5"]
    last: LiveReport | None = None
    with LiveSource(live) as source, subprocess.Popen([*command, str(mission), *options]) as flight:
        end_s = float("inf")
        while time.monotonic() < end_s and flight.poll() is None:
            frame = source.receive(min(0.02, max(0.0, end_s - time.monotonic())))
            if isinstance(frame, LiveReport):
                last = frame
                end_s = min(end_s, time.monotonic() + moment_s)
        ended_before = flight.poll() is not None
        flight.send_signal(signal.SIGKILL)
        flight.wait()
        while (frame := source.receive(0.05)) is not None:  # what was sent before the kill
            last = frame if isinstance(frame, LiveReport) else last
    return last, ended_before


def _examined(log: Path, live: LiveReport | None) -> dict[str, Any]:
    """What a log still holds."""
    row = dict(_NOTHING)
    try:
        found = condition(log)
        row["description"] = True
        target = log
        if not found.whole:
            recover(log, target := log.with_suffix(".recovered.mcap"), found.lost)
        with target.open("rb") as stream:
            row["messages"] = sum(1 for _ in make_reader(stream, validate_crcs=True).iter_messages())
        row["opens"] = True
        header, flight = read_flight(target)
    except LcdError as error:
        return {**row, "error": str(error)}
    vehicle: Vehicle = header.vehicle
    row["replays"] = compare(flight, FlightSetup.of(header.plan, vehicle, header.limits)).equal
    if live is not None and flight:
        began_ns, told_ns = flight[0][1].now_ns, live.tick.now_ns
        row["told_s"] = round((told_ns - began_ns) * 1e-9, 3)
        row["lost_s"] = round(max(0, told_ns - flight[-1][1].now_ns) * 1e-9, 3)
    elif live is not None:
        row["told_s"] = row["lost_s"] = round(live.ticks * 0.01, 3)
    return row


def _free_port() -> int:
    """Below the range that the system gives to outgoing connections: one of those would connect to itself."""
    while True:
        port = secrets.choice(_PORTS)
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port


if __name__ == "__main__":
    print(json.dumps(killed_flights(int(sys.argv[1]))["summary"], indent=1))  # noqa: T201
