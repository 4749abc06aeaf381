"""The long comparison with RotorPy, small: its batched form flies as its single one; parts are kept and taken up."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks import campaign_rotorpy
from benchmarks.rotorpy_batched import References, fly_batch
from lcd_flight.model import Trajectories, Trajectory
from lcd_flight.planning.minimum_snap import minimum_snap
from lcd_flight.worlds import load_vehicle
from sim_bridge import rotorpy_adapter

VEHICLE = replace(load_vehicle("crazyflie"), motor_noise=0.0)


def short_plans() -> Trajectories:
    """Two hops of a quarter of a second, one longer than the other."""
    waypoints = np.array([[0.0, 0.0, 1.0, 0.3], [0.002, 0.001, 1.001, 0.31], [0.003, 0.0, 1.0, 0.3]])
    return Trajectories.stack([minimum_snap(waypoints, np.array(times)) for times in ([0.12, 0.1], [0.13, 0.14])])


def test_the_batched_form_with_dopri5_is_the_single_one() -> None:
    plans = short_plans()
    batched = fly_batch(plans, VEHICLE, 0)
    assert batched.valid.all()
    for row, plan in enumerate(plans):
        single = rotorpy_adapter.fly(plan, VEHICLE, 0)
        assert np.allclose(batched.p_WB[: len(single.p_WB), row], single.p_WB, atol=1e-5)
        assert batched.max_error_m[row] == pytest.approx(single.max_error_m, abs=1e-5)
    assert not batched.crashed.any()


def test_a_flight_that_leaves_the_models_validity_is_a_crash_and_harms_no_other() -> None:
    plans = short_plans()
    wild = plans.coefficients.copy()
    wild[1, 0, :, 1] += 60.0
    flown = fly_batch(Trajectories(plans.durations_s, wild), VEHICLE, 0)
    alone = fly_batch(plans, VEHICLE, 0)
    assert flown.crashed.tolist() == [False, True]
    assert np.allclose(flown.max_error_m[0], alone.max_error_m[0], atol=1e-6)


def test_references_are_the_plans() -> None:
    plans = short_plans()
    for time_s in (0.0, 0.115, 0.2, 0.25, 9.0):
        given = References(plans).at(time_s)
        for row, plan in enumerate(plans):
            wanted = rotorpy_adapter.flat_output(plan, min(time_s, plan.duration_s))
            for key, value in wanted.items():
                assert np.allclose(given[key][row], value, atol=1e-9), key


def test_a_campaign_goes_on_where_it_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is kept is not flown again; a part that was interrupted is."""
    flown = []

    def fly(plans: Trajectories, vehicle: object, seed: int, *, start_aligned: bool) -> object:
        flown.append(seed)
        if len(flown) == 3:
            raise KeyboardInterrupt
        return type("Flights", (), {"crashed": np.arange(len(plans)) % 2 == 0})

    monkeypatch.setattr("benchmarks.rotorpy_batched.fly_batch", fly)
    for name in ("paths-2", "batched-1"):
        (tmp_path / f"{name}.json").write_text(json.dumps([1e-5, 2e-5]))
    with pytest.raises(KeyboardInterrupt):
        campaign_rotorpy.rotorpy_crash_rates(2, 1, tasks=6, batch=3, parts=tmp_path)
    result = campaign_rotorpy.rotorpy_crash_rates(2, 1, tasks=6, batch=3, parts=tmp_path)
    assert flown == [0, 3, 0, 0, 3, 0, 3]
    assert result["summary"]["largest_difference_m"] == 2e-5
    assert set(result["worlds"]) == {"crazyflie-paper", "crazyflie-saturated", "hummingbird-paper"}
    for world in result["worlds"].values():
        assert world["rotorpy_percent"] == pytest.approx(66.7)
        assert 0.0 <= world["ours_percent"] <= 100.0


def test_paths_that_do_not_saturate_are_compared_tick_by_tick(monkeypatch: pytest.MonkeyPatch) -> None:
    def still(plan: Trajectory, vehicle: object, seed: int) -> object:
        ticks = int(np.ceil(plan.duration_s / 0.01 - 1e-9)) + 1
        return type("Flight", (), {"p_WB": np.tile(plan.waypoints()[0, :3], (ticks, 1))})

    monkeypatch.setattr(rotorpy_adapter, "fly", still)
    found = campaign_rotorpy._differences(2)
    assert len(found) == 2
    assert min(found) > 0.5, "our own vehicle moves away from its start"
