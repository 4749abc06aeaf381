"""Physics features: held to torch, to finite differences, to time derivatives, and to what they mean."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import torch
import tracking_cost_torch as reference

from lcd_flight.model import GRAVITY_M_PER_S2, Trajectory
from lcd_flight.planning.cost.features import FEATURE_NAMES, segment_features, segment_features_pullback


@pytest.fixture(autouse=True)
def _double() -> Iterator[None]:
    with reference.double_precision():
        yield


def column(features: np.ndarray, name: str) -> np.ndarray:
    """All columns of one name, midpoints last."""
    return features[..., [i for i, n in enumerate(FEATURE_NAMES) if n.split(" at ")[0] == name]]


def test_there_are_114_names_and_they_differ() -> None:
    assert len(FEATURE_NAMES) == len(set(FEATURE_NAMES)) == 114


@pytest.mark.parametrize("segments", [1, 3, 7])
def test_values_agree_with_torch(segments: int) -> None:
    durations, coefficients = reference.random_plans(20, segments, seed=1)
    wanted = reference.features(torch.from_numpy(durations), torch.from_numpy(coefficients)).numpy()
    np.testing.assert_allclose(segment_features(durations, coefficients), wanted, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("segments", [1, 3])
def test_pullback_agrees_with_automatic_differentiation(segments: int) -> None:
    durations, coefficients = reference.random_plans(20, segments, seed=2)
    weights = np.random.default_rng(3).normal(size=(20, segments, 114))
    T, C = torch.tensor(durations, requires_grad=True), torch.tensor(coefficients, requires_grad=True)
    (reference.features(T, C) * torch.from_numpy(weights)).sum().backward()
    grad_durations, grad_coefficients = segment_features_pullback(durations, coefficients, weights)
    np.testing.assert_allclose(grad_durations, T.grad.numpy(), rtol=1e-9, atol=1e-8)
    np.testing.assert_allclose(grad_coefficients, C.grad.numpy(), rtol=1e-9, atol=1e-8)


@pytest.mark.parametrize("name", sorted({n.split(" at ")[0] for n in FEATURE_NAMES}))
def test_each_feature_alone_has_the_slope_of_finite_differences(name: str) -> None:
    durations, coefficients = reference.random_plans(3, 2, seed=4)
    weights = np.zeros((3, 2, 114))
    column_of = [i for i, n in enumerate(FEATURE_NAMES) if n.split(" at ")[0] == name]
    weights[..., column_of] = np.random.default_rng(5).normal(size=(3, 2, len(column_of)))
    rng = np.random.default_rng(6)
    along_T, along_C = rng.normal(size=durations.shape), rng.normal(size=coefficients.shape)

    def value(share: float) -> float:
        features = segment_features(durations + share * along_T, coefficients + share * along_C)
        return float((features * weights).sum())

    grad_T, grad_C = segment_features_pullback(durations, coefficients, weights)
    slope = float((grad_T * along_T).sum() + (grad_C * along_C).sum())
    step = 1e-6
    assert slope == pytest.approx((value(step) - value(-step)) / (2.0 * step), rel=1e-5, abs=1e-6)


def test_hovering_asks_for_nothing() -> None:
    hover = Trajectory.hover((1.0, -2.0, 3.0), 0.7, 2.0)
    features = segment_features(hover.durations_s[None], hover.coefficients[None])
    assert column(features, "log thrust") == pytest.approx(0.0, abs=2e-3)
    assert column(features, "p8 thrust") == pytest.approx(0.0, abs=2e-3)
    assert column(features, "tilt cosine") == pytest.approx(1.0, abs=2e-3)
    assert column(features, "thrust excess over 1.5 g") == pytest.approx(0.0, abs=0.01)
    assert column(features, "log duration") == pytest.approx(np.log(2.0))
    moving = ("tilt rate x", "tilt acceleration y", "yaw rate", "log speed", "mean tilt rate")
    assert all(np.all(column(features, name) == 0.0) for name in moving)


def test_pulling_up_at_one_g_doubles_the_thrust() -> None:
    coefficients = np.zeros((1, 4, 1, 8))
    coefficients[0, 2, 0, 2] = 0.5 * GRAVITY_M_PER_S2
    features = segment_features(np.array([[1.0]]), coefficients)
    assert np.exp(column(features, "log thrust")) == pytest.approx(2.0, rel=1e-3)
    assert column(features, "thrust excess over 1.5 g") == pytest.approx(0.5, rel=0.02)


def test_tilt_rates_and_accelerations_are_time_derivatives_of_the_thrust_direction() -> None:
    durations, coefficients = np.array([[1.3]]), np.zeros((1, 4, 1, 8))
    coefficients[0, :, 0, 2:6] = np.random.default_rng(8).normal(size=(4, 4)) * 0.5
    plan = Trajectory(durations[0], coefficients[0])

    def direction(times: np.ndarray) -> np.ndarray:
        force = plan.derivative(times, 2)[:, :3] + np.array([0.0, 0.0, GRAVITY_M_PER_S2])
        return force / np.linalg.norm(force, axis=1, keepdims=True)

    times, h = (np.arange(12) + 0.5) / 12 * 1.3, 1e-4
    b3, yaw = direction(times), plan.derivative(times, 0)[:, 3]
    b2 = np.cross(b3, np.stack([np.cos(yaw), np.sin(yaw), np.zeros(12)], axis=1))
    b2 /= np.linalg.norm(b2, axis=1, keepdims=True)
    rate = (direction(times + h) - direction(times - h)) / (2.0 * h)
    bend = (direction(times + h) - 2.0 * b3 + direction(times - h)) / h**2
    features = segment_features(durations, coefficients)[0, 0]
    for side, axis in (("x", np.cross(b2, b3)), ("y", b2)):
        wanted = (axis * rate).sum(axis=1)
        got = column(features, f"tilt rate {side}")
        np.testing.assert_allclose(got, reference.compress(torch.from_numpy(wanted), 4.0), rtol=0.02, atol=0.005)
        wanted = (axis * bend).sum(axis=1)
        got = column(features, f"tilt acceleration {side}")
        np.testing.assert_allclose(got, reference.compress(torch.from_numpy(wanted), 40.0), rtol=0.02, atol=0.02)


def test_a_row_depends_on_its_own_plan_alone() -> None:
    durations, coefficients = reference.random_plans(9, 4, seed=7)
    together = segment_features(durations, coefficients)
    weights = np.ones((9, 4, 114))
    pulled = segment_features_pullback(durations, coefficients, weights)
    for n in range(9):
        row = slice(n, n + 1)
        assert np.array_equal(segment_features(durations[row], coefficients[row]), together[row])
        alone = segment_features_pullback(durations[row], coefficients[row], weights[row])
        assert all(np.array_equal(a, b[row]) for a, b in zip(alone, pulled, strict=True))


def test_arrays_in_another_memory_order_give_the_same() -> None:
    durations, coefficients = reference.random_plans(5, 3, seed=9)
    wanted = segment_features(durations, coefficients)
    assert np.array_equal(segment_features(np.asfortranarray(durations), np.asfortranarray(coefficients)), wanted)


@pytest.mark.parametrize("duration", [np.nan, -1.0, 0.0])
def test_a_plan_without_meaning_gives_numbers_that_are_not_finite(duration: float) -> None:
    _, coefficients = reference.random_plans(1, 1, seed=10)
    features = segment_features(np.array([[duration]]), coefficients)
    assert not np.isfinite(features).all()


def test_free_fall_is_finite() -> None:
    coefficients = np.zeros((1, 4, 1, 8))
    coefficients[0, 2, 0, 2] = -0.5 * GRAVITY_M_PER_S2
    coefficients[0, 0, 0, 3] = 1.0
    durations = np.array([[1.0]])
    assert np.isfinite(segment_features(durations, coefficients)).all()
    pulled = segment_features_pullback(durations, coefficients, np.ones((1, 1, 114)))
    assert all(np.isfinite(part).all() for part in pulled)
