"""The planning benchmark on one small task: both sides measured, on the same problem."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

BENCH = Path(__file__).parents[2] / "benchmarks" / "bench_plan.py"


@pytest.fixture(scope="module")
def bench():
    for peer in ("minsnap_trajectories", "rotorpy", "threadpoolctl"):
        pytest.importorskip(peer)
    spec = importlib.util.spec_from_file_location("bench_plan", BENCH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.SECONDS = 0.0
    return module


@pytest.mark.parametrize("peer", ["_rotorpy", "_trajectories"])
def test_a_row_measures_both_sides(bench, peer):
    said = []
    row = bench._one_task(3, "a peer", getattr(bench, peer), said.append)
    assert set(row) == {"what", "unit", "ours", "peer", "peer_name", "ratio"}
    assert row["ours"] > 0.0
    assert row["ratio"] == pytest.approx(row["peer"] / row["ours"])
    assert said == ["minimum snap, 3 segments, a peer"]


def test_a_peer_that_solves_another_problem_is_not_compared(bench):
    waypoints = bench._waypoints(1, 3)[0]
    with pytest.raises(AssertionError, match="plans another path"):
        bench._check_same(bench._ours(waypoints), bench._ours(waypoints + np.array([0.0, 0.01, 0.0, 0.0])), "a peer")
