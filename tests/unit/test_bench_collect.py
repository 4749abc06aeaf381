"""The benchmark of collecting on a few rollouts: its rows, where the time goes, and a peer that does the same work."""

import cProfile
import importlib.util
from pathlib import Path

import pytest

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
    monkeypatch.setattr(bench, "_command", lambda count: asked.append(count) or (2.0, 1.0))
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
    bench._made(bench.WORLD, 900, profile)
    shares = bench.shares(profile)
    assert all(share > 0.0 for share in shares.values())
    assert sum(shares.values()) == pytest.approx(100.0)


def test_the_command_is_a_process_of_its_own(bench):
    wall_s, peak_MB = bench._command(100)
    assert wall_s > 0.0
    assert 50.0 < peak_MB < 2000.0
