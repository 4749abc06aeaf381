"""Rollouts without noise or saturation, held to what the simulator gave when it was last checked against RotorPy.

`rollouts_without_noise.npz` holds the plans and their labels. Whoever makes the kernel faster may change the last
bits; whoever changes the model has to write the file again and say why.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from simulator_plans import LOPSIDED, seeds

from lcd_flight.model import Loop, RolloutOptions, Trajectories, Vehicle
from lcd_flight.worlds import load_vehicle
from sim_bridge.rollouts import MultirotorSimulator

GOLDEN = Path(__file__).with_name("rollouts_without_noise.npz")
CASES: dict[str, tuple[Vehicle, Loop, str]] = {
    "crazyflie-paper": (load_vehicle("crazyflie"), "paper", "geometric"),
    "crazyflie-flight": (load_vehicle("crazyflie"), "flight", "geometric"),
    "hummingbird-paper": (load_vehicle("hummingbird"), "paper", "geometric"),
    "lopsided-paper": (LOPSIDED, "paper", "geometric"),
    "crazyflie-geometric-feed-forward": (load_vehicle("crazyflie"), "paper", "geometric-feed-forward"),
}


@pytest.mark.parametrize("name", CASES)
def test_labels_are_those_that_are_kept(name: str) -> None:
    vehicle, loop, controller = CASES[name]
    with np.load(GOLDEN) as file:
        kept = {key.removeprefix(f"{name}/"): file[key] for key in file if key.startswith(f"{name}/")}
    plans = Trajectories(kept.pop("durations_s"), kept.pop("coefficients"))
    options = RolloutOptions(loop=loop, controller=controller)
    labels = MultirotorSimulator().rollout(plans, replace(vehicle, motor_noise=0.0), seeds(len(plans)), options)
    assert len(kept) == 8
    for label, values in kept.items():
        assert getattr(labels, label) == pytest.approx(values, rel=1e-9, abs=1e-12), label
