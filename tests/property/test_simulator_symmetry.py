"""Nothing in the simulator knows where it is or where north is: a plan moved or turned is flown the same way."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simulator_plans import minimum_snap_plans, seeds

from lcd_flight.model import Loop, RolloutOptions, Trajectories
from lcd_flight.worlds import load_vehicle
from sim_bridge.rollouts import MultirotorSimulator

VEHICLE = load_vehicle("crazyflie")
PLANS = minimum_snap_plans(8, 1.3, seed=31)
OPTIONS: dict[Loop, RolloutOptions] = {"paper": RolloutOptions(loop="paper"), "flight": RolloutOptions(loop="flight")}


def moved(plans: Trajectories, x_m: float, y_m: float, z_m: float, turn_rad: float) -> Trajectories:
    """Turned about the vertical through the origin, then shifted."""
    coefficients = plans.coefficients.copy()
    x, y = plans.coefficients[:, 0], plans.coefficients[:, 1]
    coefficients[:, 0] = math.cos(turn_rad) * x - math.sin(turn_rad) * y
    coefficients[:, 1] = math.sin(turn_rad) * x + math.cos(turn_rad) * y
    for axis, shift in enumerate((x_m, y_m, z_m, turn_rad)):
        coefficients[:, axis, :, 0] += shift
    return Trajectories(plans.durations_s, coefficients)


@pytest.mark.parametrize("loop", ["paper", "flight"])
@settings(deadline=None, max_examples=25)
@given(
    shift=st.tuples(*[st.floats(-50.0, 50.0)] * 3),
    turn_rad=st.floats(-4.0 * math.pi, 4.0 * math.pi),
    first_seed=st.integers(0, 2**40),
)
def test_a_plan_moved_and_turned_is_flown_the_same(
    loop: Loop, shift: tuple[float, float, float], turn_rad: float, first_seed: int
) -> None:
    noise = seeds(len(PLANS), first_seed)
    here = MultirotorSimulator().rollout(PLANS, VEHICLE, noise, OPTIONS[loop])
    there = MultirotorSimulator().rollout(moved(PLANS, *shift, turn_rad), VEHICLE, noise, OPTIONS[loop])
    smooth = here.saturation_share == 0.0
    assert smooth.sum() >= 2
    for name in ("max_error_m", "rms_error_m", "yaw_cost", "paper_cost"):
        ours, theirs = getattr(here, name)[smooth], getattr(there, name)[smooth]
        assert np.allclose(ours, theirs, rtol=1e-6, atol=1e-8), name
