"""SIGKILL at random moments of a flight: every log opens after `lcd recover`, a second at most is lost, never metadata.

`make campaign` does the same to a hundred `lcd-fly` processes in real time.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
import short_mission
import synthetic_flight
from mcap.reader import make_reader

from lcd_flight.flight.replay import compare
from lcd_flight.record import read_log, read_ticks
from lcd_flight.record.reader import read_header
from lcd_flight.record.recover import condition, recover

TESTS = Path(__file__).parents[1]
COUNT, SEED = 10, 20261122
LOST_TICKS = 100
"""A second."""


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[Path, int]]:
    """Each log, and the last tick that its flight had decided."""
    folder = tmp_path_factory.mktemp("killed")
    command = [sys.executable, str(TESTS / "killed_flights.py"), str(folder), str(COUNT), str(SEED)]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, timeout=300)
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    return [(folder / row["log"], row["last_tick"]) for row in rows]


def test_flights_were_killed_in_the_middle(killed: list[tuple[Path, int]]) -> None:
    assert len(killed) == COUNT
    assert len({last // 100 for _, last in killed}) >= 5
    assert not any(read_log(path).complete for path, last in killed if last > LOST_TICKS)


def test_a_second_at_most_is_lost(killed: list[tuple[Path, int]]) -> None:
    for path, last in killed:
        kept = read_ticks(path)
        assert last - len(kept) + 1 <= LOST_TICKS, path
        assert [tick.sequence for _, tick in kept] == list(range(len(kept)))


def test_the_description_is_never_lost(killed: list[tuple[Path, int]]) -> None:
    for path, _ in killed:
        header = read_header(path)
        assert header.mission_text == synthetic_flight.header().mission_text
        assert header.predictions == (synthetic_flight.PREDICTION,)
        assert header.plan.duration_s == short_mission.plan().duration_s
        assert header.versions["lcd-flight"]


def test_every_file_opens_after_recovery(killed: list[tuple[Path, int]], tmp_path: Path) -> None:
    for path, _ in killed:
        target = tmp_path / path.name
        found = condition(path)
        recover(path, target, found.lost)
        with target.open("rb") as stream:
            topics = [channel.topic for _, channel, _ in make_reader(stream, validate_crcs=True).iter_messages()]
        assert topics.count("/tick") >= found.ticks
        assert read_ticks(target) == read_ticks(path)


def test_what_is_left_replays_to_the_bit(killed: list[tuple[Path, int]]) -> None:
    path, _ = max(killed, key=lambda row: row[1])
    found = compare(read_ticks(path), short_mission.setup())
    assert found.equal
    assert len(found.pairs) > 500
