"""What networks see of a plan: sizes, names, slopes; and models of whole trajectories, plain and convex."""

import cost_models
import numpy as np
import pytest
import tracking_cost_torch as reference

from lcd_flight.model import InputError, Trajectories
from lcd_flight.planning.cost.inputs import INPUTS
from lcd_flight.planning.cost.model_file import load_model, save_model


@pytest.mark.parametrize(("name", "width"), [("windows", 114), ("knots", 39), ("coefficients", 96)])
def test_sizes_of_three_segments_and_a_name_for_each(name, width):
    inputs = INPUTS[name]
    features = inputs.features(*reference.random_plans(4, 3, seed=0))
    assert features.shape == (4, 3 if name == "windows" else 1, width)
    assert len(inputs.names(3)) == len(set(inputs.names(3))) == width


@pytest.mark.parametrize("name", ["knots", "coefficients"])
def test_the_pullback_is_the_slope_along_what_a_planner_may_change(name):
    """Coefficients of the inner knots and durations move; the waypoints' columns are left out (they stand still)."""
    inputs, rng = INPUTS[name], np.random.default_rng(1)
    durations, coefficients = reference.random_plans(4, 3, seed=1)
    weights = rng.normal(size=inputs.features(durations, coefficients).shape)
    if name == "knots":
        weights[..., :12] = 0.0
    grad_durations, grad_coefficients = inputs.pullback(durations, coefficients, weights)
    d_durations, d_coefficients = rng.normal(size=durations.shape), rng.normal(size=coefficients.shape)
    step = 1e-6
    ahead = inputs.features(durations + step * d_durations, coefficients + step * d_coefficients)
    back = inputs.features(durations - step * d_durations, coefficients - step * d_coefficients)
    slope = ((ahead - back) / (2 * step) * weights).sum(axis=(1, 2))
    told = (grad_durations * d_durations).sum(axis=1) + (grad_coefficients * d_coefficients).sum(axis=(1, 2, 3))
    assert np.allclose(slope, told, rtol=1e-6, atol=1e-6)


def test_knots_are_what_their_names_say():
    durations, coefficients = reference.random_plans(3, 3, seed=2)
    plans = Trajectories(durations, coefficients)
    features = dict(zip(INPUTS["knots"].names(3), INPUTS["knots"].features(durations, coefficients)[1, 0], strict=True))
    plan = plans[1]
    knots = np.cumsum(plan.durations_s)
    assert features["duration 2"] == plan.durations_s[1]
    inside = plan.coefficients[2, 1]
    assert features["acceleration of z at knot 2"] == pytest.approx(2.0 * inside[2])
    assert features["jerk of z at knot 2"] == pytest.approx(6.0 * inside[3])
    last = np.polynomial.polynomial.polyval(plan.durations_s[2], plan.coefficients[0, 2])
    assert features["x of waypoint 4"] == pytest.approx(last - plan.coefficients[0, 0, 0])
    assert len(knots) == 3


@pytest.mark.parametrize("convex", [False, True])
@pytest.mark.parametrize("name", ["knots", "coefficients"])
def test_values_and_slopes_of_whole_models(name, convex):
    model = cost_models.random_whole_model(name, convex=convex)
    durations, coefficients = reference.random_plans(4, 3, seed=3)
    rng = np.random.default_rng(4)
    change = np.zeros(coefficients.shape)
    change[:, :, 1:, 1:4] = rng.normal(size=(4, 4, 2, 3))  # leaves the knots' waypoints where they are ...
    if name == "knots":
        change[:, :, 1:, 7] = -(change[..., 1:, 1:4] * durations[:, None, 1:, None] ** np.arange(1, 4)).sum(-1) / (
            durations[:, None, 1:] ** 7
        )  # ... at the segments' ends too
    value, _, grad = model.value_and_gradient(durations, coefficients)
    step = 1e-6
    ahead, back = (model.value_and_gradient(durations, coefficients + s * change)[0] for s in (step, -step))
    assert np.allclose((ahead - back) / (2 * step), (grad * change).sum(axis=(1, 2, 3)), rtol=1e-4, atol=1e-6)
    assert (np.log(model.predict_max_error_m(durations, coefficients)) <= value).all()


def test_a_convex_network_is_convex_in_the_coefficients():
    network = cost_models.random_network((96, 16, 8), "elu", 5, convex=True)
    rng = np.random.default_rng(6)
    a, b, share = rng.normal(size=(500, 96)) * 3, rng.normal(size=(500, 96)) * 3, rng.uniform(size=(500, 1))
    between, ends = network.forward(share * a + (1 - share) * b)[0], (network.forward(a)[0], network.forward(b)[0])
    assert (between <= share[:, 0] * ends[0] + (1 - share[:, 0]) * ends[1] + 1e-9).all()
    plain = cost_models.random_network((96, 16, 8), "elu", 5, convex=False)
    between, ends = plain.forward(share * a + (1 - share) * b)[0], (plain.forward(a)[0], plain.forward(b)[0])
    assert not (between <= share[:, 0] * ends[0] + (1 - share[:, 0]) * ends[1] + 1e-9).all()


@pytest.mark.parametrize("name", ["knots", "coefficients"])
@pytest.mark.parametrize("convex", [False, True])
def test_whole_models_are_saved_and_loaded(name, convex, tmp_path):
    model = cost_models.random_whole_model(name, convex=convex)
    plans = Trajectories(*reference.random_plans(4, 3, seed=7))
    path = tmp_path / "whole.safetensors"
    save_model(path, model, cost_models.CARD, plans)
    loaded = load_model(path)
    assert loaded.inputs is INPUTS[name]
    assert bool(loaded.network.skips) == convex
    told, wanted = (m.value_and_gradient(plans.durations_s, plans.coefficients) for m in (loaded, model))
    assert all(np.array_equal(a, b) for a, b in zip(told, wanted, strict=True))


def test_a_whole_model_refuses_another_number_of_waypoints():
    model = cost_models.random_whole_model("knots")
    with pytest.raises(InputError, match="of another number of waypoints"):
        model.value_and_gradient(*reference.random_plans(2, 5, seed=8))
