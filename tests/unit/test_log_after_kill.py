"""A process that is killed in flight leaves a log that lacks half a second at most, and never the description."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest
import synthetic_flight

from lcd_flight.record import read_log, read_ticks

FLIGHT = """
import sys, time
from pathlib import Path
import synthetic_flight
from lcd_flight.observers import LogThread
from lcd_flight.record import LogWriter

thread = LogThread(LogWriter(Path(sys.argv[1]), synthetic_flight.header()))
for inputs, tick in synthetic_flight.flight():
    thread.observe(inputs, tick)
    print(thread.statistics.written, flush=True)
    time.sleep(0.001)
"""


@pytest.mark.parametrize("after", [1, 60, 333])
def test_sigkill(tmp_path: Path, after: int) -> None:
    path = tmp_path / "killed.mcap"
    command = [sys.executable, "-c", FLIGHT, str(path)]
    environment = {"PYTHONPATH": str(Path(__file__).parents[1]), "PYTHONDONTWRITEBYTECODE": "1"}
    written = 0
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as child:
        assert child.stdout is not None
        while written < after:
            written = int(child.stdout.readline())
        child.send_signal(signal.SIGKILL)
    kept = read_ticks(path)
    assert kept == synthetic_flight.flight()[: len(kept)]
    assert written - len(kept) <= 50
    if kept:
        log = read_log(path)
        assert not log.complete
        assert log.header.plan.duration_s == synthetic_flight.plan().duration_s
