"""The benchmark of the log, small: three writers, the same ticks, every tick in every file."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from lcd_flight.record import read_ticks

BENCH = Path(__file__).parents[2] / "benchmarks" / "bench_log.py"


@pytest.fixture(scope="module")
def bench() -> Any:
    pytest.importorskip("foxglove")
    spec = importlib.util.spec_from_file_location("bench_log", BENCH)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_it_measures_as_many_ticks_as_it_says(bench: Any) -> None:
    assert bench.ROUNDS * bench.TICKS >= 60_000


def test_every_writer_writes_the_same_messages(bench: Any, tmp_path: Path) -> None:
    pairs = [bench._pair(sequence) for sequence in range(60)]
    counts = {}
    for name, begin in bench._WRITERS.items():
        log = begin(tmp_path / f"{name}.mcap")
        for inputs, tick in pairs:
            log.observe(inputs, tick)
        log.close()
        with (tmp_path / f"{name}.mcap").open("rb") as stream:
            topics = [channel.topic for _, channel, _ in make_reader(stream).iter_messages()]
        counts[name] = {t: topics.count(t) for t in ("/tick_inputs", "/tick", "/tf", "/pose", "/reference")}
    assert list(counts.values()) == [dict.fromkeys(counts["ours"], 60)] * 3
    assert read_ticks(tmp_path / "ours.mcap") == pairs


def test_rows(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "_measured", lambda report, load: {n: [1.0, 2.0, 3.0] for n in bench._WRITERS})
    rows = bench.rows(lambda text: None)
    assert len(rows) == 16
    assert {row["peer_name"] for row in rows} == {"mcap writer in the tick", "foxglove-sdk"}
    assert all(row["ratio"] == 1.0 and row["unit"] == "us" for row in rows)
    assert rows[0]["what"] == "cost in the tick, idle, median"


def test_a_tick_that_was_dropped_is_no_result(bench: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = bench._Ours(tmp_path / "dropped.mcap")
    monkeypatch.setattr(log, "_capacity", 0)
    log.observe(*bench._pair(0))
    with pytest.raises(RuntimeError, match="not every tick was logged"):
        log.close()
