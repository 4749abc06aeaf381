"""The rollout benchmark on a few small batches: both sides measured, on the same flights."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sim_bridge import rotorpy_adapter

BENCH = Path(__file__).parents[2] / "benchmarks" / "bench_rollouts.py"


@pytest.fixture(scope="module")
def bench():
    for peer in ("rotorpy", "torch", "torchdiffeq", "roma", "threadpoolctl"):
        pytest.importorskip(peer)
    spec = importlib.util.spec_from_file_location("bench_rollouts", BENCH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.COUNT, module.REPEATS, module.SINGLE_FLIGHTS, module.BATCHES, module.BATCH_TICKS = 64, 1, 1, (4,), 3
    module.PEAK_ROUNDS = 100
    return module


def test_every_row_is_measured(bench):
    said = []
    rows = bench.rows(said.append)
    assert {row["peer_name"] for row in rows} >= {"RotorPy single", "RotorPy batched", None}
    for row in rows:
        assert set(row) == {"what", "unit", "ours", "peer", "peer_name", "ratio"}
        assert row["ours"] > 0.0
        if row["peer"] is not None:
            assert row["ratio"] == pytest.approx(row["ours"] / row["peer"])
    assert said[0].startswith("ours, 64 rollouts")


def test_the_batched_peer_flies_the_same_references(bench):
    plans = bench.tasks_flown(3)
    for time_s in (0.0, 0.13):
        given = bench.First(plans).update(np.array([time_s]))
        for index, plan in enumerate(plans):
            wanted = rotorpy_adapter.flat_output(plan, time_s)
            for key, value in wanted.items():
                assert np.allclose(given[key][index], value, atol=1e-12)


def test_the_batched_peer_is_the_single_one(bench, monkeypatch):
    """Without noise, over a few ticks: the same flight, as far as its single-precision rk4 goes."""
    monkeypatch.setattr(bench, "VEHICLE", replace(bench.VEHICLE, motor_noise=0.0))
    plans = bench.tasks_flown(2)
    craft, controller, state = bench.batch_of(plans, bench.VEHICLE)
    wanted, everybody = bench.First(plans), np.arange(2)
    control = controller.update(0.0, state, wanted.update(np.zeros(1)), everybody)
    for tick in range(1, 21):
        state["wind"] = bench.torch.zeros(2, 3, dtype=bench.torch.float64)
        state = craft.step(state, control, 0.01, everybody)
        control = controller.update(0.01 * tick, state, wanted.update(np.array([0.01 * tick])), everybody)
    for index, plan in enumerate(plans):
        single = rotorpy_adapter.fly(plan, bench.VEHICLE, 0).p_WB[20]
        assert np.allclose(state["x"][index], single, atol=2e-3)
