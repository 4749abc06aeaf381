"""The six-float covariance against matrices; the motion against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lcd_flight.model import FloatArray, PoseOptions, RawPose
from lcd_flight.model.frames import angle_between, from_yaw
from mocap.kalman import RATE, VALUE, Covariance, grown, initial, measured
from mocap.motion import ahead, begun, followed, rotation_vector

OPTIONS = PoseOptions()


def matrix(covariance: Covariance) -> FloatArray:
    xx, xv, xa, vv, va, aa = covariance
    return np.array([[xx, xv, xa], [xv, vv, va], [xa, va, aa]])


def random_covariance(seed: int) -> Covariance:
    root = np.random.default_rng(seed).normal(size=(3, 3))
    full = root @ root.T
    return tuple(full[np.triu_indices(3)].tolist())


@pytest.mark.parametrize("seed", range(3))
def test_growth_is_the_matrix_formula(seed: int) -> None:
    dt_s, sigma = 0.013, 3.0
    step = np.array([[1.0, dt_s, dt_s**2 / 2.0], [0.0, 1.0, dt_s], [0.0, 0.0, 1.0]])
    jerk = np.array([dt_s**3 / 6.0, dt_s**2 / 2.0, dt_s])
    before = random_covariance(seed)
    expected = step @ matrix(before) @ step.T + sigma**2 * np.outer(jerk, jerk)
    np.testing.assert_allclose(matrix(grown(before, dt_s, sigma)), expected, rtol=1e-12)


@pytest.mark.parametrize("component", [VALUE, RATE])
@pytest.mark.parametrize("seed", range(3))
def test_a_measurement_is_the_matrix_formula(seed: int, component: int) -> None:
    before = random_covariance(seed)
    full = matrix(before)
    gain = full[:, component] / (full[component, component] + 0.3**2)
    expected = full - np.outer(gain, full[component])
    found_gain, after = measured(before, component, 0.3)
    np.testing.assert_allclose(found_gain, gain, rtol=1e-12)
    np.testing.assert_allclose(matrix(after), expected, rtol=1e-9, atol=1e-12)


def test_the_covariance_stays_positive_over_a_long_flight() -> None:
    covariance = initial(1e-3, 5.0, 20.0)
    for n in range(20_000):
        _, covariance = measured(grown(covariance, 0.01, 100.0), VALUE, 1e-3)
        if n % 3 == 0:
            _, covariance = measured(covariance, RATE, 0.02)
    assert np.linalg.eigvalsh(matrix(covariance)).min() > 0.0


def pose(time_s: float, yaw_rate: float = 0.0) -> RawPose:
    """Constant acceleration in x, constant velocity in y, constant yaw rate."""
    p_WB = (0.5 * 2.0 * time_s**2, 1.5 * time_s, 1.0)
    return RawPose(0, 0, 0, p_WB, from_yaw(yaw_rate * time_s))


def test_constant_acceleration_and_constant_turning_are_followed_without_lag() -> None:
    motion = begun(pose(0.0), OPTIONS)
    for n in range(1, 300):
        motion = followed(motion, pose(0.01 * n, 2.0), 0.01, OPTIONS)
    assert motion.v_WB_W == pytest.approx((2.0 * 2.99, 1.5, 0.0), abs=1e-6)
    assert motion.a_WB_W == pytest.approx((2.0, 0.0, 0.0), abs=1e-4)
    assert motion.w_WB_B == pytest.approx((0.0, 0.0, 2.0), abs=1e-6)
    later = ahead(motion, 0.05)
    assert later.p_WB == pytest.approx(pose(3.04).p_WB, abs=1e-5)
    assert angle_between(later.q_WB, from_yaw(2.0 * 3.04)) < 1e-5


def test_the_source_twist_is_used_where_it_is_wanted() -> None:
    raw = RawPose(0, 0, 0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (3.0, 0.0, 0.0), (0.0, 4.0, 0.0))
    assert begun(raw, OPTIONS).v_WB_W == pytest.approx((3.0, 0.0, 0.0), rel=1e-4)
    assert begun(raw, OPTIONS).w_WB_B == pytest.approx((0.0, 4.0, 0.0), rel=1e-4)
    alone = begun(raw, PoseOptions(use_source_twist=False))
    assert alone.v_WB_W == (0.0, 0.0, 0.0)
    assert alone.w_WB_B == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 0.3, math.pi - 1e-6, -0.3])
def test_rotation_vectors_of_yaw(angle: float) -> None:
    assert rotation_vector(from_yaw(angle)) == pytest.approx((0.0, 0.0, angle), abs=1e-12)


def test_a_quaternion_and_its_negative_are_one_rotation() -> None:
    x, y, z, w = from_yaw(0.4)
    assert rotation_vector((-x, -y, -z, -w)) == pytest.approx((0.0, 0.0, 0.4))
