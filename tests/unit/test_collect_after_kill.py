"""A real `lcd collect`, killed and interrupted in the middle, ends with the same bytes as one that was left alone."""

import json
import signal
import subprocess
import sys
import time

from lcd_flight.learning.collect import CollectConfig, collect
from lcd_flight.learning.mix import parse_mix
from lcd_flight.learning.spread import in_threads
from lcd_flight.plugins import simulator
from lcd_flight.worlds import load_world

CTRL_C = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
LCD = [sys.executable, "-c", f"{CTRL_C}; from lcd_flight.cli.main import lcd; lcd()"]
"""Takes SIGINT as from a terminal, also where the tests run in the background, which ignores it."""
SHARDS, ROWS = 30, 1_000
COUNT = ["--count", str(SHARDS * ROWS), "--shard-rows", str(ROWS)]
COLLECT = [*LCD, "collect", "--world", "crazyflie-saturated", "--sources", "optimum=1", *COUNT]


def begin(folder):
    return subprocess.Popen(
        [*COLLECT, "--out", str(folder), "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def shards(folder):
    return len(list(folder.glob("shard-*.parquet")))


def stop_after_another_shard(folder, number, delay_s):
    """Send a signal some time after one more shard is there; the exit code and what was printed."""
    before = shards(folder)
    process = begin(folder)
    while shards(folder) == before:
        assert process.poll() is None, process.communicate()
        time.sleep(0.005)
    time.sleep(delay_s)
    process.send_signal(number)
    out, _ = process.communicate(timeout=60.0)
    return process.returncode, out


def contents(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def test_killed_three_times_and_interrupted_once(tmp_path):
    folder = tmp_path / "pieces"
    for delay_s in (0.0, 0.02, 0.04):
        code, _ = stop_after_another_shard(folder, signal.SIGKILL, delay_s)
        assert code == -signal.SIGKILL
    code, out = stop_after_another_shard(folder, signal.SIGINT, 0.0)
    assert code == 130
    assert json.loads(out.splitlines()[-1])["outcome"] == "interrupted"
    assert shards(folder) < SHARDS
    subprocess.run([*COLLECT, "--out", str(folder)], check=True, capture_output=True)
    config = CollectConfig(load_world("crazyflie-saturated"), seed=0, mix=parse_mix("optimum=1", ROWS))
    collect(config, SHARDS * ROWS, tmp_path / "whole", simulator(), spread=in_threads(1))
    assert shards(folder) == SHARDS
    assert contents(folder) == contents(tmp_path / "whole")
