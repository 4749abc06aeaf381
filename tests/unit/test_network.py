"""The ensemble's networks: forward and backward against torch, in both precisions, at both ends of the range."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import torch
import tracking_cost_torch as reference

from lcd_flight.planning.cost.network import ACTIVATIONS, Activation, Network, activate


@pytest.fixture(autouse=True)
def _double() -> Iterator[None]:
    with reference.double_precision():
        yield


def pair(sizes: list[int], members: int, activation: Activation) -> tuple[Network, list[torch.nn.Sequential]]:
    peers = [reference.network(sizes, activation, seed) for seed in range(members)]
    return Network.of(*reference.stacked(peers), activation), peers


@pytest.mark.parametrize("activation", ACTIVATIONS)
@pytest.mark.parametrize("sizes", [[5, 1], [7, 4, 1], [20, 16, 8, 4, 1], [9, 300, 130, 1]])
@pytest.mark.parametrize("members", [1, 3])
def test_outputs_and_gradients_agree_with_torch(sizes: list[int], members: int, activation: Activation) -> None:
    network, peers = pair(sizes, members, activation)
    rng = np.random.default_rng(1)
    inputs, weights = 3.0 * rng.normal(size=(11, sizes[0])), rng.normal(size=(members, 11))
    x = torch.tensor(inputs, requires_grad=True)
    wanted = torch.stack([peer(x)[:, 0] for peer in peers])
    (wanted * torch.from_numpy(weights)).sum().backward()
    outputs, tape = network.forward(inputs)
    np.testing.assert_allclose(outputs, wanted.detach().numpy(), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(network.backward(tape, weights), x.grad.numpy(), rtol=1e-12, atol=1e-12)


def test_single_precision_is_near_double_precision() -> None:
    network, _ = pair([344, 128, 128, 32, 1], 2, "silu")
    single = network.astype(np.float32)
    inputs = np.random.default_rng(2).normal(size=(50, 344))
    (wide, tape), (narrow, narrow_tape) = network.forward(inputs), single.forward(inputs)
    assert narrow.dtype == np.float32
    np.testing.assert_allclose(narrow, wide, atol=1e-6)
    ones = np.ones((2, 50))
    np.testing.assert_allclose(single.backward(narrow_tape, ones), network.backward(tape, ones), atol=1e-6)


@pytest.mark.parametrize("activation", ACTIVATIONS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_activations_stay_finite_far_out(activation: Activation, dtype: type) -> None:
    x = np.array([-1e4, -90.0, -1.0, 0.0, 1.0, 90.0, 1e4], dtype=dtype)
    value, slope = activate(x, activation)
    assert value.dtype == slope.dtype == dtype
    assert np.isfinite(value).all()
    assert np.isfinite(slope).all()
    assert value[-1] == x[-1]
    assert slope[-1] == 1.0


def test_what_is_not_finite_comes_out_so() -> None:
    network, _ = pair([4, 3, 1], 1, "silu")
    inputs = np.zeros((2, 4))
    inputs[1, 2] = np.nan
    outputs, _ = network.forward(inputs)
    assert np.isfinite(outputs[0, 0])
    assert np.isnan(outputs[0, 1])


def test_a_backward_pass_may_be_repeated() -> None:
    network, _ = pair([6, 5, 1], 2, "silu")
    inputs = np.random.default_rng(3).normal(size=(4, 6))
    _, tape = network.forward(inputs)
    weights = np.ones((2, 4))
    assert np.array_equal(network.backward(tape, weights), network.backward(tape, weights))
    assert np.all(weights == 1.0)


def test_a_row_gives_the_same_bits_alone_and_among_others() -> None:
    network, _ = pair([344, 128, 128, 32, 1], 2, "silu")
    single = network.astype(np.float32)
    inputs = np.random.default_rng(4).normal(size=(11, 344))
    outputs, tape = single.forward(inputs)
    grad = single.backward(tape, np.ones((2, 11)))
    for n in range(11):
        alone, alone_tape = single.forward(inputs[n : n + 1])
        assert np.array_equal(alone[:, 0], outputs[:, n])
        assert np.array_equal(single.backward(alone_tape, np.ones((2, 1)))[0], grad[n])


def test_no_rows_are_no_trouble() -> None:
    network, _ = pair([6, 5, 1], 2, "silu")
    outputs, tape = network.forward(np.zeros((0, 6)))
    assert outputs.shape == (2, 0)
    assert network.backward(tape, outputs).shape == (0, 6)
