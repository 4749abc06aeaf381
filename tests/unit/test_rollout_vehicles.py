"""Any vehicle file flies in the batch, in both loops; one that cannot be is refused before anything flies."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from simulator_plans import LOPSIDED, minimum_snap_plans, seeds

from lcd_flight.model import InputError, RolloutOptions
from lcd_flight.worlds import load_vehicle
from sim_bridge.craft import CONTROLLERS
from sim_bridge.rollouts import MultirotorSimulator

PAGE = Path(__file__).parents[2] / "docs" / "simulator.md"
SIMULATOR = MultirotorSimulator()


@pytest.fixture
def vehicle_file(tmp_path: Path) -> Path:
    """The vehicle of the documentation's example."""
    (example,) = re.findall(r"```yaml\n(# A Crazyflie 2.1.*?)```", PAGE.read_text(), flags=re.DOTALL)
    path = tmp_path / "deck.yaml"
    path.write_text(example)
    return path


def test_a_users_vehicle_flies_in_both_loops(vehicle_file: Path) -> None:
    """It flies gently, and not as the bare vehicle does; motors that lag by 72 ms are too slow for the paper's loop."""
    deck, plans = load_vehicle(str(vehicle_file)), minimum_snap_plans(20, 0.8, seed=21)
    for loop, lag_s in (("paper", 0.005), ("flight", deck.motor_time_constant_s)):
        ours, bare = (
            SIMULATOR.rollout(plans, replace(v, motor_time_constant_s=lag_s), seeds(20), RolloutOptions(loop=loop))
            for v in (deck, load_vehicle("crazyflie-2.1"))
        )
        assert ours.valid.all()
        assert np.median(ours.max_error_m) < 1.0
        assert not np.array_equal(ours.max_error_m, bare.max_error_m)


def test_every_law_flies_every_vehicle() -> None:
    for vehicle in (load_vehicle("crazyflie"), load_vehicle("hummingbird"), replace(LOPSIDED, motor_noise=0.0)):
        for controller in CONTROLLERS:
            options = RolloutOptions(controller=controller)
            labels = SIMULATOR.rollout(minimum_snap_plans(8, 0.5, seed=22, waypoints=3), vehicle, seeds(8), options)
            assert not labels.crashed.any(), (vehicle.name, controller)


@pytest.mark.parametrize(
    ("key", "value"), [("mass_kg", "-0.034"), ("k_eta", "0"), ("motor_time_constant_s", "-0.01"), ("mass_kg", ".nan")]
)
def test_a_vehicle_that_cannot_be_is_one_clear_line(vehicle_file: Path, key: str, value: str) -> None:
    text = re.sub(rf"^{key}: .*$", f"{key}: {value}", vehicle_file.read_text(), flags=re.MULTILINE)
    vehicle_file.write_text(text)
    with pytest.raises(InputError) as caught:
        load_vehicle(str(vehicle_file))
    (line,) = str(caught.value).splitlines()
    assert "deck.yaml" in line
    assert key in line
