"""The planner's variables: what |z| means, and their pullback against finite differences and torch's autograd."""

import math

import numpy as np
import pytest

from lcd_flight.model import InputError
from lcd_flight.planning.knots import Whitening
from lcd_flight.planning.minimum_snap import minimum_snap_batch, snap


def tasks(count, segments, seed=0):
    rng = np.random.default_rng(seed)
    waypoints = np.cumsum(rng.uniform(-2.0, 2.0, (count, segments + 1, 4)), axis=1)
    return waypoints, rng.uniform(0.5, 2.0, (count, segments))


def variables(whitening, seed=1, size=0.3):
    rng = np.random.default_rng(seed)
    return size * rng.normal(size=whitening.z_shape), size * rng.normal(size=whitening.durations_s.shape)


def test_zero_is_minimum_snap():
    waypoints, durations = tasks(3, 4)
    whitening = Whitening.of(waypoints, durations)
    expected = minimum_snap_batch(waypoints, durations)
    plans = whitening.plan(np.zeros(whitening.z_shape), np.zeros(durations.shape))
    np.testing.assert_array_equal(whitening.minimum.coefficients, expected.coefficients)
    np.testing.assert_allclose(plans.coefficients, expected.coefficients, rtol=1e-12, atol=1e-12)


def test_the_square_of_z_is_the_relative_extra_snap():
    whitening = Whitening.of(*tasks(5, 3))
    z, theta = variables(whitening)
    ratio = snap(whitening.plan(z, 0.0 * theta)), snap(whitening.minimum)
    squares = (z**2).sum(axis=(1, 2))
    position = ratio[0][:, :3].sum(axis=1) / ratio[1][:, :3].sum(axis=1) - 1.0
    np.testing.assert_allclose(position, squares[:, :3].sum(axis=1), rtol=1e-8)
    np.testing.assert_allclose(ratio[0][:, 3] / ratio[1][:, 3] - 1.0, squares[:, 3], rtol=1e-8)


def test_with_theta_alone_the_plan_is_minimum_snap_at_the_new_durations():
    whitening = Whitening.of(*tasks(4, 3))
    _, theta = variables(whitening)
    plans = whitening.plan(np.zeros(whitening.z_shape), theta)
    np.testing.assert_allclose(plans.durations_s.sum(axis=1), whitening.durations_s.sum(axis=1), rtol=1e-14)
    assert np.abs(plans.durations_s / whitening.durations_s - 1.0).max() > 0.1
    expected = minimum_snap_batch(whitening.waypoints, plans.durations_s)
    np.testing.assert_allclose(plans.coefficients, expected.coefficients, rtol=1e-9, atol=1e-9)


def test_a_yaw_that_never_changes_stays():
    waypoints, durations = tasks(2, 3)
    waypoints[..., 3] = 0.7
    whitening = Whitening.of(waypoints, durations)
    plans = whitening.plan(*variables(whitening))
    assert (plans.coefficients[:, 3, :, 0] == 0.7).all()
    assert (plans.coefficients[:, 3, :, 1:] == 0.0).all()


def test_two_waypoints_have_no_free_knots():
    whitening = Whitening.of(*tasks(2, 1))
    assert whitening.z_shape == (2, 0, 3, 4)
    z, theta = variables(whitening)
    plans = whitening.plan(z, theta)
    np.testing.assert_allclose(plans.durations_s, whitening.durations_s)
    grad_z, grad_theta = whitening.pullback(z, theta, np.ones((2, 1)), np.ones(plans.coefficients.shape))
    assert grad_z.shape == whitening.z_shape
    np.testing.assert_allclose(grad_theta, 0.0, atol=1e-12)


def test_rows_are_alone_and_take_repeats_them():
    whitening = Whitening.of(*tasks(4, 3))
    chosen = whitening.take([2, 2, 0])
    z, theta = variables(chosen)
    plans = chosen.plan(z, theta)
    waypoints, durations = tasks(4, 3)
    for row, index in enumerate([2, 2, 0]):
        alone = Whitening.of(waypoints[index : index + 1], durations[index : index + 1])
        single = alone.plan(z[row : row + 1], theta[row : row + 1])
        np.testing.assert_array_equal(single.coefficients[0], plans.coefficients[row])


def test_single_precision_variables_are_planned_in_double():
    whitening = Whitening.of(*tasks(2, 3))
    z, theta = (v.astype(np.float32) for v in variables(whitening))
    narrow, wide = whitening.plan(z, theta), whitening.plan(z.astype(float), theta.astype(float))
    np.testing.assert_array_equal(narrow.coefficients, wide.coefficients)


def test_variables_that_are_not_numbers_give_a_plan_that_is_not():
    whitening = Whitening.of(*tasks(2, 3))
    z, theta = variables(whitening)
    z[1, 0, 0, 0] = math.nan
    plans = whitening.plan(z, theta)
    assert np.isfinite(plans.coefficients[0]).all()
    assert not np.isfinite(plans.coefficients[1]).all()


def test_bad_tasks_are_refused():
    waypoints, durations = tasks(2, 3)
    waypoints[1, 2] = waypoints[1, 1]
    with pytest.raises(InputError, match="task 1, waypoint 2"):
        Whitening.of(waypoints, durations)


@pytest.mark.parametrize("segments", [2, 3, 5])
def test_the_pullback_agrees_with_finite_differences(segments):
    whitening = Whitening.of(*tasks(2, segments))
    z, theta = variables(whitening)
    rng = np.random.default_rng(2)
    grad_coefficients, grad_durations = rng.normal(size=(2, 4, segments, 8)), rng.normal(size=(2, segments))

    def value(z, theta):
        plans = whitening.plan(z, theta)
        return (plans.coefficients * grad_coefficients).sum() + (plans.durations_s * grad_durations).sum()

    grad_z, grad_theta = whitening.pullback(z, theta, grad_durations, grad_coefficients)
    for _ in range(10):
        dz, dtheta = rng.normal(size=z.shape), rng.normal(size=theta.shape)
        slope = (value(z + 1e-5 * dz, theta + 1e-5 * dtheta) - value(z - 1e-5 * dz, theta - 1e-5 * dtheta)) / 2e-5
        np.testing.assert_allclose((grad_z * dz).sum() + (grad_theta * dtheta).sum(), slope, rtol=1e-6)


def dense_plan(torch, whitening, z, theta, row):
    """The plan of one task in torch, dense and from the definitions: (durations, coefficients (S, 8, 4))."""
    initial = torch.tensor(whitening.durations_s[row])
    stretched = initial * torch.exp(0.7 * torch.tanh(theta / 0.7))
    durations = stretched * initial.sum() / stretched.sum()
    waypoints = torch.tensor(whitening.waypoints[row])
    knots = dense_optimum(torch, waypoints, durations)
    hessian = dense_snap(torch, initial)[0]
    lower = torch.linalg.cholesky(hessian)
    minimum = dense_optimum(torch, waypoints, initial)
    snaps = torch.einsum("ra,rs,sa->a", minimum, dense_snap(torch, initial, everything=True)[0], minimum)
    position = snaps[:3].sum().sqrt()
    scales = torch.stack([position, position, position, snaps[3].sqrt()])
    shift = torch.linalg.solve_triangular(lower.T, z.reshape(-1, 4) * scales, upper=True)
    free = dense_free(len(initial))
    knots = knots.index_add(0, torch.tensor(free), shift)
    maps = [dense_map(torch, t) for t in durations]
    return durations, torch.stack([m @ knots[4 * i : 4 * i + 8] for i, m in enumerate(maps)])


def dense_map(torch, duration):
    """(8, 8) coefficients from p, v, a, j at both ends, by inverting what the derivatives are."""
    rows = [
        [math.perm(k, order) * time ** max(k - order, 0) for k in range(8)]
        for time in (torch.zeros((), dtype=torch.float64), duration)
        for order in range(4)
    ]
    return torch.linalg.inv(torch.stack([torch.stack([torch.as_tensor(e) for e in row]) for row in rows]))


def dense_free(segments):
    """Rows of v, a, j at the inner knots among p, v, a, j at all knots."""
    return [4 * knot + order for knot in range(1, segments) for order in (1, 2, 3)]


def dense_snap(torch, durations, everything=False):
    """Hessian of the snap by the free derivatives, and its coupling to the rest; or by all of them."""
    segments = len(durations)
    total = torch.zeros((4 * segments + 4, 4 * segments + 4), dtype=torch.float64)
    powers = torch.arange(4)
    ratio = torch.tensor([math.perm(k, 4) for k in range(4, 8)], dtype=torch.float64)
    exponents = powers[:, None] + powers[None, :] + 1
    for i, duration in enumerate(durations):
        gram = ratio[:, None] * ratio[None, :] * duration**exponents / exponents
        upper = dense_map(torch, duration)[4:]
        local = torch.nn.functional.pad(
            upper.T @ gram @ upper, (4 * i, 4 * (segments - i - 1), 4 * i, 4 * (segments - i - 1))
        )
        total = total + local
    if everything:
        return total, None
    free = dense_free(segments)
    return total[free][:, free], total[free]


def dense_optimum(torch, waypoints, durations):
    """p, v, a, j of least snap at all knots, (4 K, 4)."""
    hessian, coupling = dense_snap(torch, durations)
    fixed = torch.zeros((4 * len(waypoints), 4), dtype=torch.float64)
    fixed = fixed.index_add(0, 4 * torch.arange(len(waypoints)), waypoints)
    best = torch.linalg.solve(hessian, -coupling @ fixed)
    return fixed.index_add(0, torch.tensor(dense_free(len(durations))), best)


@pytest.mark.parametrize("segments", [2, 3, 4])
def test_plan_and_pullback_agree_with_a_dense_reference_and_autograd(segments):
    torch = pytest.importorskip("torch")
    whitening = Whitening.of(*tasks(3, segments, seed=7))
    z, theta = variables(whitening, seed=8)
    rng = np.random.default_rng(9)
    grad_coefficients, grad_durations = rng.normal(size=(3, 4, segments, 8)), rng.normal(size=(3, segments))
    plans = whitening.plan(z, theta)
    grad_z, grad_theta = whitening.pullback(z, theta, grad_durations, grad_coefficients)
    for row in range(3):
        leaf_z, leaf_theta = torch.tensor(z[row], requires_grad=True), torch.tensor(theta[row], requires_grad=True)
        durations, coefficients = dense_plan(torch, whitening, leaf_z, leaf_theta, row)
        flat = coefficients.permute(2, 0, 1)
        np.testing.assert_allclose(plans.durations_s[row], durations.detach(), rtol=1e-12)
        np.testing.assert_allclose(plans.coefficients[row], flat.detach(), rtol=1e-7, atol=1e-7)
        value = (flat * torch.tensor(grad_coefficients[row])).sum()
        (value + (durations * torch.tensor(grad_durations[row])).sum()).backward()
        np.testing.assert_allclose(grad_z[row], leaf_z.grad, rtol=1e-6, atol=1e-7 * np.abs(grad_z[row]).max())
        np.testing.assert_allclose(grad_theta[row], leaf_theta.grad, rtol=1e-6)
