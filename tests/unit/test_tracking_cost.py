"""The learned tracking cost as a whole: against torch's automatic differentiation, and what it says besides."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import cost_models
import numpy as np
import pytest
import torch
import tracking_cost_torch as reference

from lcd_flight.planning.cost.features import FEATURE_NAMES, segment_features
from lcd_flight.planning.cost.inputs import INPUTS
from lcd_flight.planning.cost.network import ACTIVATIONS, Activation, Network
from lcd_flight.planning.cost.tracking_cost import training_range

WINDOWS = INPUTS["windows"]


@pytest.fixture(autouse=True)
def _double() -> Iterator[None]:
    with reference.double_precision():
        yield


@pytest.mark.parametrize("activation", ACTIVATIONS)
@pytest.mark.parametrize("segments", [1, 2, 3, 8])
@pytest.mark.parametrize("members", [1, 2, 3])
def test_value_and_gradients_agree_with_torch(segments: int, members: int, activation: Activation) -> None:
    model = cost_models.random_model(members, activation=activation)
    peers = [reference.network([344, 24, 12, 1], activation, seed) for seed in range(members)]
    durations, coefficients = reference.random_plans(6, segments, seed=segments)
    T, C = torch.tensor(durations, requires_grad=True), torch.tensor(coefficients, requires_grad=True)
    wanted = reference.cost(T, C, model.feature_mean, model.feature_spread, peers)
    wanted.sum().backward()
    value, grad_durations, grad_coefficients = model.value_and_gradient(durations, coefficients)
    np.testing.assert_allclose(value, wanted.detach().numpy(), rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(grad_durations, T.grad.numpy(), rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(grad_coefficients, C.grad.numpy(), rtol=1e-8, atol=1e-9)


def test_the_default_size_agrees_with_torch_and_single_precision_with_it() -> None:
    model = cost_models.random_model(2, sizes=(128, 128, 32))
    peers = [reference.network([344, 128, 128, 32, 1], "silu", seed) for seed in range(2)]
    durations, coefficients = reference.random_plans(5, 3, seed=3)
    T, C = torch.tensor(durations, requires_grad=True), torch.tensor(coefficients, requires_grad=True)
    wanted = reference.cost(T, C, model.feature_mean, model.feature_spread, peers)
    wanted.sum().backward()
    value, grad_T, _ = model.value_and_gradient(durations, coefficients)
    np.testing.assert_allclose(value, wanted.detach().numpy(), rtol=1e-10)
    np.testing.assert_allclose(grad_T, T.grad.numpy(), rtol=1e-8, atol=1e-9)
    single = replace(model, network=model.network.astype(np.float32))
    narrow, narrow_T, _ = single.value_and_gradient(durations, coefficients)
    np.testing.assert_allclose(narrow, value, atol=1e-5)
    np.testing.assert_allclose(narrow_T, grad_T, rtol=1e-3, atol=1e-4)


def test_gradients_are_slopes() -> None:
    model = cost_models.random_model()
    durations, coefficients = reference.random_plans(4, 3, seed=5)
    rng = np.random.default_rng(6)
    along_T, along_C = rng.normal(size=durations.shape), rng.normal(size=coefficients.shape)
    _, grad_T, grad_C = model.value_and_gradient(durations, coefficients)
    step = 1e-6
    ends = [model.value_and_gradient(durations + s * along_T, coefficients + s * along_C)[0] for s in (step, -step)]
    slope = (grad_T * along_T).sum(axis=1) + (grad_C * along_C).sum(axis=(1, 2, 3))
    np.testing.assert_allclose(slope, (ends[0] - ends[1]) / (2.0 * step), rtol=1e-5, atol=1e-7)


def test_windows_hold_neighbours_and_flags() -> None:
    normalised = np.arange(2 * 3 * 4, dtype=float).reshape(2, 3, 4) + 1.0
    got = WINDOWS.arrange(normalised)
    assert got.shape == (2, 3, 14)
    assert np.all(got[:, 0, :4] == 0.0)
    assert np.array_equal(got[:, 1, :4], normalised[:, 0])
    assert np.array_equal(got[:, :, 4:8], normalised)
    assert np.array_equal(got[:, 1, 8:12], normalised[:, 2])
    assert np.all(got[:, 2, 8:12] == 0.0)
    assert got[0, :, 12:].tolist() == [[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]


def test_the_only_segment_is_first_and_last() -> None:
    assert WINDOWS.arrange(np.ones((1, 1, 2)))[0, 0].tolist() == [0, 0, 1, 1, 0, 0, 1, 1]


@pytest.mark.parametrize("segments", [1, 2, 5])
def test_windows_pullback_is_the_adjoint(segments: int) -> None:
    rng = np.random.default_rng(7)
    x, grad = rng.normal(size=(3, segments, 4)), rng.normal(size=(3, segments, 14))
    flags = WINDOWS.arrange(np.zeros_like(x))
    assert (WINDOWS.arrange(x) - flags).ravel() @ grad.ravel() == pytest.approx(
        x.ravel() @ WINDOWS.arrange_pullback(grad).ravel()
    )


def test_large_batches_give_what_small_ones_give_to_the_bit() -> None:
    model = cost_models.random_model()
    durations, coefficients = reference.random_plans(600, 3, seed=8)
    together = model.value_and_gradient(durations, coefficients)
    for n in (0, 169, 170, 171, 599):
        alone = model.value_and_gradient(durations[n : n + 1], coefficients[n : n + 1])
        assert all(np.array_equal(a, b[n : n + 1]) for a, b in zip(alone, together, strict=True))
    error = model.predict_max_error_m(durations, coefficients)
    assert error[400] == model.predict_max_error_m(durations[400:401], coefficients[400:401])[0]


def test_twice_gives_the_same_bits() -> None:
    model = cost_models.random_model(sizes=(128, 128, 32))
    single = replace(model, network=model.network.astype(np.float32))
    durations, coefficients = reference.random_plans(300, 3, seed=9)
    first, second = (single.value_and_gradient(durations, coefficients) for _ in range(2))
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


def test_the_predicted_error_is_that_of_the_worst_segment_without_pessimism() -> None:
    weights, biases = [np.zeros((2, 344, 1))], [np.log([[0.1], [0.4]])]
    weights[0][:, 344 - 1] = 1.0  # the last segment is e times worse
    model = replace(cost_models.random_model(), network=Network.of(weights, biases, "silu"))
    plans = reference.random_plans(2, 3, seed=10)
    segments = model.predict_segment_errors_m(*plans)
    np.testing.assert_allclose(segments, [[0.2, 0.2, 0.2 * np.e]] * 2)
    np.testing.assert_allclose(model.predict_max_error_m(*plans), 0.2 * np.e)
    smooth = np.log(np.exp(3.0 * np.log(segments)).sum(axis=1)) / 3.0
    np.testing.assert_allclose(model.value_and_gradient(*plans)[0], smooth + np.log(2.0), rtol=1e-6)


def test_disagreement_between_members_costs() -> None:
    agree = cost_models.thrust_model()
    layers = agree.network.layers
    parted = [layer.biases + np.array([[-0.3], [0.3]]) * (i == 1) for i, layer in enumerate(layers)]
    apart = replace(agree, network=Network.of([layer.weights for layer in layers], parted, "silu"))
    plans = reference.random_plans(4, 3, seed=11)
    np.testing.assert_allclose(apart.predict_max_error_m(*plans), agree.predict_max_error_m(*plans))
    assert np.all(apart.value_and_gradient(*plans)[0] > agree.value_and_gradient(*plans)[0])


def test_plans_like_those_of_training_are_in_range_and_others_named() -> None:
    model = cost_models.random_model()
    durations, coefficients = reference.random_plans(5, 3, seed=12)
    coefficients[:, 3] *= 0.0
    coefficients[2, 3, 1, 2] = 500.0
    durations[4, 2] = 9.0
    reasons = model.out_of_range(durations, coefficients)
    assert [reason is None for reason in reasons] == model.in_range(durations, coefficients).tolist()
    assert reasons[0] is None or "yaw" not in reasons[0]
    assert reasons[2] is not None
    assert "yaw" in reasons[2]
    assert "of segment 2 is" in reasons[2]
    assert reasons[4] is not None
    assert "segment 3" in reasons[4]


def test_the_range_leaves_out_one_in_ten_thousand_at_either_end() -> None:
    features = np.zeros((100_001, 114))
    features[:, 0] = np.linspace(-1.0, 3.0, 100_001)
    low, high = training_range(features)
    assert low[0] == pytest.approx(-1.0 + 4e-4, abs=1e-4)
    assert high[0] == pytest.approx(3.0 - 4e-4, abs=1e-4)
    assert low[1] < 0.0 < high[1]
    assert high[1] < 1e-5


def test_a_little_beyond_the_range_is_tolerated() -> None:
    model = cost_models.thrust_model()
    durations, coefficients = reference.random_plans(1, 2, seed=13)
    column = FEATURE_NAMES.index("log duration")
    largest = float(np.log(durations.max()))
    model.feature_low[column], model.feature_high[column] = largest - 1.2, largest - 0.1
    assert model.in_range(durations, coefficients).all()
    model.feature_high[column] = largest - 0.2
    assert "log duration" in str(model.out_of_range(durations, coefficients)[0])


def test_what_never_varied_in_training_is_out_of_range_as_soon_as_it_does() -> None:
    model = cost_models.thrust_model()
    yaw = [i for i, name in enumerate(FEATURE_NAMES) if name.startswith("yaw")]
    model.feature_low[yaw], model.feature_high[yaw] = -1e-6, 1e-6
    durations, coefficients = reference.random_plans(1, 2, seed=13)
    coefficients[:, 3] = 0.0
    assert model.out_of_range(durations, coefficients) == (None,)
    coefficients[0, 3, 0, 1] = 0.1
    assert "yaw rate" in str(model.out_of_range(durations, coefficients)[0])


def test_a_plan_that_is_not_finite_is_out_of_range_and_costs_nothing_finite() -> None:
    model = cost_models.random_model()
    durations, coefficients = reference.random_plans(2, 3, seed=14)
    coefficients[1, 0, 0, 3] = np.nan
    value, _, _ = model.value_and_gradient(durations, coefficients)
    assert np.isfinite(value[0])
    assert np.isnan(value[1])
    assert model.out_of_range(durations, coefficients)[1] is not None
    assert not model.in_range(durations, coefficients)[1]


def test_extreme_plans_raise_no_warning() -> None:
    model = replace(cost_models.random_model(), feature_spread=np.full(114, 1e-38))
    single = replace(model, network=model.network.astype(np.float32))
    durations, coefficients = reference.random_plans(1, 3, seed=15)
    value, _, _ = single.value_and_gradient(durations, coefficients * 1e3)
    assert not np.isfinite(value).all()
    assert np.isfinite(segment_features(durations, coefficients * 1e3)).all()
