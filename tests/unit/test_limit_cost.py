"""Limits as a cost: gradients against differences, zero where kept, and agreement with the exact peaks."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from lcd_flight.model import GRAVITY_M_PER_S2, Geofence, Trajectories
from lcd_flight.planning.cost.limit_cost import LimitCost
from lcd_flight.planning.limits import PlanLimits, check_limits, peaks
from lcd_flight.planning.minimum_snap import minimum_snap_batch
from lcd_flight.worlds import load_vehicle

VEHICLE = load_vehicle("crazyflie")
NARROW = LimitCost(1.5, 12.0, 2.0, 0.4, (-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
EACH = (
    LimitCost(max_speed=1.0),
    LimitCost(max_specific_force=8.0),
    LimitCost(max_body_rate=1.0),
    LimitCost(max_tilt_rad=0.2),
    LimitCost(low_m=(0.0, 0.0, 0.0), high_m=(0.1, 0.1, 0.1)),
)


def wild_plans() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    sizes = np.array([1.0, 1.0, 1.0, 0.7, 0.5, 0.3, 0.2, 0.1])
    return rng.uniform(0.6, 1.5, (6, 3)), rng.standard_normal((6, 4, 3, 8)) * sizes


def flights() -> Trajectories:
    rng = np.random.default_rng(5)
    poses = np.concatenate([rng.uniform(-2.0, 2.0, (40, 4, 3)), rng.uniform(-3.0, 3.0, (40, 4, 1))], axis=2)
    return minimum_snap_batch(poses, rng.uniform(0.7, 2.5, (40, 3)))


@pytest.mark.parametrize("limits", [NARROW, *EACH])
def test_its_gradients_agree_with_differences(limits: LimitCost) -> None:
    durations, coefficients = wild_plans()
    _, by_durations, by_coefficients = limits.value_and_gradient(durations, coefficients)
    rng, step = np.random.default_rng(1), 1e-6
    along = rng.standard_normal(durations.shape), rng.standard_normal(coefficients.shape)
    ahead, back = (
        limits.value_and_gradient(durations + s * along[0], coefficients + s * along[1])[0] for s in (step, -step)
    )
    slope = (by_durations * along[0]).sum(axis=1) + (by_coefficients * along[1]).sum(axis=(1, 2, 3))
    assert np.all(slope != 0.0)
    np.testing.assert_allclose(slope, (ahead - back) / (2 * step), rtol=1e-6, atol=1e-6 * np.abs(slope).max())


def test_no_limits_cost_nothing_and_yaw_never_does() -> None:
    assert not LimitCost()(Trajectories(*wild_plans())).any()
    _, _, by_coefficients = NARROW.value_and_gradient(*wild_plans())
    assert not by_coefficients[:, 3].any()


@pytest.mark.parametrize("name", ["max_velocity", "max_thrust_ratio", "max_tilt_rad", "max_body_rate"])
def test_what_costs_nothing_keeps_the_limit_and_what_breaks_it_costs(name: str) -> None:
    plans = flights()
    found = [peaks(plan, VEHICLE) for plan in plans]
    worst = {
        "max_velocity": [p.speed.value for p in found],
        "max_thrust_ratio": [p.thrust_ratio.value for p in found],
        "max_tilt_rad": [p.tilt.value for p in found],
        "max_body_rate": [p.body_rate.value for p in found],
    }[name]
    limit = float(np.median(worst))
    limits = replace(PlanLimits(), **{name: limit})
    cost = LimitCost.of(limits, VEHICLE, Geofence((-math.inf,) * 3, (math.inf,) * 3))(plans)
    broken = np.array([bool(check_limits(each, limits)) for each in found])
    assert broken.sum() == 20
    assert np.all(cost[np.array(worst) > 1.02 * limit] > 0.0)
    assert not cost[np.array(worst) < 0.97 * limit].any()


def test_the_box_counts_metres_outside() -> None:
    hover = Trajectories(np.ones((1, 1)), np.zeros((1, 4, 1, 8)))
    hover.coefficients[0, 0, 0, 0] = 2.5
    assert LimitCost(high_m=(2.0, 9.0, 9.0))(hover)[0] == pytest.approx(200 * 0.5**2)
    assert LimitCost(low_m=(2.7, -9.0, -9.0))(hover)[0] == pytest.approx(200 * 0.2**2)
    assert LimitCost(low_m=(2.0, 0.0, 0.0), high_m=(3.0, 1.0, 1.0))(hover)[0] == 0.0


def test_a_plan_that_is_not_a_number_costs_no_number() -> None:
    durations, coefficients = wild_plans()
    coefficients[2, 1, 1, 4] = np.nan
    cost = NARROW(Trajectories(durations, coefficients))
    assert np.isnan(cost[2])
    assert np.isfinite(np.delete(cost, 2)).all()


def test_it_says_what_is_limited() -> None:
    limits = PlanLimits(max_velocity=3.0, max_thrust_ratio=0.5)
    named = LimitCost.of(limits, VEHICLE, Geofence((-1.0, -2.0, 0.0), (1.0, 2.0, 3.0))).named()
    force = 0.5 * VEHICLE.max_thrust_N / VEHICLE.mass_kg
    assert named.pop("max_specific_force") == pytest.approx(force)
    assert force > 0.5 * GRAVITY_M_PER_S2
    assert named == {
        "max_speed": 3.0,
        "low_x_m": -1.0, "low_y_m": -2.0, "low_z_m": 0.0, "high_x_m": 1.0, "high_y_m": 2.0, "high_z_m": 3.0,
    }  # fmt: skip
