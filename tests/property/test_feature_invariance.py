"""Moving a plan, or turning the whole of it about z, changes no feature; mirroring it swaps signs and no sizes."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from tracking_cost_torch import random_plans

from lcd_flight.planning.cost.features import FEATURE_NAMES, segment_features, segment_features_pullback


@settings(deadline=None, max_examples=50)
@given(
    seed=st.integers(0, 10_000),
    segments=st.integers(1, 5),
    shift=st.tuples(*[st.floats(-100.0, 100.0)] * 3),
    turn=st.floats(-7.0, 7.0),
)
def test_moving_and_turning_change_nothing(
    seed: int, segments: int, shift: tuple[float, float, float], turn: float
) -> None:
    durations, coefficients = random_plans(3, segments, seed)
    moved = coefficients.copy()
    c, s = np.cos(turn), np.sin(turn)
    moved[:, 0] = c * coefficients[:, 0] - s * coefficients[:, 1]
    moved[:, 1] = s * coefficients[:, 0] + c * coefficients[:, 1]
    moved[:, :3, :, 0] += np.array(shift)[:, None]
    moved[:, 3, :, 0] += turn
    np.testing.assert_allclose(
        segment_features(durations, moved), segment_features(durations, coefficients), rtol=1e-8, atol=1e-8
    )


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 10_000))
def test_mirroring_y_flips_motion_to_the_side_and_yaw_and_nothing_else(seed: int) -> None:
    durations, coefficients = random_plans(3, 2, seed)
    mirrored = coefficients.copy()
    mirrored[:, [1, 3]] *= -1.0
    flips = ("tilt rate y", "tilt acceleration y", "yaw")
    signs = np.array([-1.0 if name.startswith(flips) else 1.0 for name in FEATURE_NAMES])
    np.testing.assert_allclose(
        segment_features(durations, mirrored), segment_features(durations, coefficients) * signs, rtol=1e-9, atol=1e-9
    )


@settings(deadline=None, max_examples=50)
@given(seed=st.integers(0, 10_000), segments=st.integers(1, 4))
def test_no_gradient_points_along_a_move_or_a_turn(seed: int, segments: int) -> None:
    durations, coefficients = random_plans(2, segments, seed)
    weights = np.random.default_rng(seed).normal(size=(2, segments, len(FEATURE_NAMES)))
    _, grad = segment_features_pullback(durations, coefficients, weights)
    scale = np.abs(grad).max()
    assert np.all(grad[:, :3, :, 0] == 0.0)
    turned = np.stack([-coefficients[:, 1], coefficients[:, 0]], axis=1)
    along = (grad[:, :2] * turned).sum(axis=(1, 3)) + grad[:, 3, :, 0]
    assert np.all(np.abs(along) < 1e-9 * scale * np.abs(coefficients).sum())
