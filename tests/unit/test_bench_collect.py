"""The benchmark of collecting on a few rollouts: its rows, where the time goes, and a peer that does the same work."""

import cProfile
import importlib.util
from pathlib import Path

import pytest

from lcd_flight.learning.spread import in_turn

BENCH = Path(__file__).parents[2] / "benchmarks" / "bench_collect.py"


@pytest.fixture(scope="module")
def bench():
    for peer in ("rotorpy", "threadpoolctl", "pyarrow"):
        pytest.importorskip(peer)
    spec = importlib.util.spec_from_file_location("bench_collect", BENCH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.COUNT, module.PEER_FLIGHTS = 900, 1
    return module


def test_rows(bench, monkeypatch):
    asked = []
    monkeypatch.setattr(bench, "_peak_MB", lambda count: asked.append(count) or 1.0)
    said = []
    rows = bench.rows(said.append)
    assert all(set(row) == {"what", "unit", "ours", "peer", "peer_name", "ratio"} for row in rows)
    assert rows[0]["ratio"] == pytest.approx(rows[0]["ours"] / rows[0]["peer"])
    assert rows[0]["ratio"] > 1.0
    assert sum(row["ours"] for row in rows if row["what"].startswith("share of")) == pytest.approx(100.0)
    assert asked == [900, 4_500]
    assert len(said) == 3


def test_every_step_is_seen_and_the_rollouts_are_most_of_it(bench):
    profile = cProfile.Profile()
    bench._made(bench.WORLD, 900, in_turn, profile)
    shares = bench.shares(profile)
    assert all(share > 0.0 for share in shares.values())
    assert sum(shares.values()) == pytest.approx(100.0)


def test_memory_is_that_of_a_process_of_its_own(bench):
    assert 50.0 < bench._peak_MB(100) < 2000.0
