"""The X500 below the flight loop's setpoint: attitude steps settle, hover holds, gentle plans are tracked."""

from __future__ import annotations

import math

import numpy as np
import pytest
from simulator_plans import minimum_snap_plans, seeds

from lcd_flight.model import AttitudeThrust, FloatArray, Quaternion, RolloutOptions, State
from lcd_flight.worlds import load_vehicle
from sim_bridge.plant import Plant
from sim_bridge.rollouts import MultirotorSimulator

VEHICLE = load_vehicle("x500")
LEVEL: Quaternion = (0.0, 0.0, 0.0, 1.0)
PERIOD_NS = 10_000_000


def hovering() -> Plant:
    rest = (0.0, 0.0, 0.0)
    return Plant(VEHICLE, State((0.0, 0.0, 20.0), rest, LEVEL, rest), seed=1, floor_m=0.0)


def angles_deg(axis: int, step_deg: float, seconds: float) -> FloatArray:
    """The angle about one axis every 10 ms after a step of its setpoint."""
    half, plant, seen = math.radians(0.5 * step_deg), hovering(), []
    q = [0.0, 0.0, 0.0, math.cos(half)]
    q[axis] = math.sin(half)
    for _ in range(round(seconds * 100.0)):
        plant.setpoint = AttitudeThrust(VEHICLE.weight_N, (q[0], q[1], q[2], q[3]))
        plant.advance(PERIOD_NS)
        seen.append(2.0 * math.degrees(math.atan2(plant.state.q_WB[axis], plant.state.q_WB[3])))
    return np.array(seen)


@pytest.mark.parametrize(
    ("axis", "step_deg", "settled_s", "overshoot"),
    [(0, 5.0, 0.35, 0.01), (0, 20.0, 0.35, 0.01), (1, -20.0, 0.35, 0.01), (2, 5.0, 0.8, 0.03), (2, 20.0, 0.8, 0.03)],
)
def test_a_step_of_attitude_settles_without_ringing(
    axis: int, step_deg: float, settled_s: float, overshoot: float
) -> None:
    reached = angles_deg(axis, step_deg, 1.5) / step_deg
    assert reached.max() < 1.0 + overshoot
    assert np.abs(reached[round(settled_s * 100.0) :] - 1.0).max() < 0.05
    assert np.abs(reached[reached.argmax() :] - 1.0).max() < overshoot


def test_it_stays_where_it_hovers() -> None:
    plant = hovering()
    plant.setpoint = AttitudeThrust(VEHICLE.weight_N, LEVEL)
    plant.advance(2_000_000_000)
    assert plant.state.p_WB == pytest.approx((0.0, 0.0, 20.0), abs=1e-3)
    assert plant.motor_shares == pytest.approx((VEHICLE.weight_N / VEHICLE.max_thrust_N,) * 4, abs=1e-6)


@pytest.mark.parametrize("loop", ["flight", "paper"])
def test_it_tracks_gentle_plans(loop: str) -> None:
    options = RolloutOptions(loop=loop)  # type: ignore[arg-type]
    labels = MultirotorSimulator().rollout(minimum_snap_plans(20, 0.7, seed=21), VEHICLE, seeds(20), options)
    assert not labels.crashed.any()
    assert np.median(labels.max_error_m) < 0.05
