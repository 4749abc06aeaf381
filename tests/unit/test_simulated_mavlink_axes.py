"""The simulated vehicle's own frame conversions, against rotation matrices that are written down here."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lcd_flight.model import FloatArray
from sim_bridge.mavlink.frames import (
    Hamilton,
    angles,
    forward_right_down,
    heading,
    inverse,
    level,
    ned_attitude,
    product,
    swapped,
    turn,
    wrapped,
)

NED_FROM_ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
FRD_FROM_FLU = np.diag([1.0, -1.0, -1.0])
HALF = math.sqrt(0.5)

numbers = st.floats(-1.0, 1.0)
quaternions = st.tuples(numbers, numbers, numbers, numbers).filter(lambda q: math.hypot(*q) > 0.1)


def matrix(w: float, x: float, y: float, z: float) -> FloatArray:
    """Columns are the body's axes."""
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@settings(derandomize=True)
@given(quaternions)
def test_an_attitude_in_ned_is_the_matrix_of_both_changes_of_axes(q: tuple[float, float, float, float]) -> None:
    size = math.hypot(*q)
    x, y, z, w = (part / size for part in q)
    expected = NED_FROM_ENU @ matrix(w, x, y, z) @ FRD_FROM_FLU.T
    np.testing.assert_allclose(matrix(*ned_attitude((x, y, z, w))), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("q_WB", "q"),
    [
        ((0.0, 0.0, 0.0, 1.0), (HALF, 0.0, 0.0, HALF)),
        ((0.0, 0.0, HALF, HALF), (1.0, 0.0, 0.0, 0.0)),
    ],
)
def test_nose_east_and_nose_north(q_WB: Hamilton, q: Hamilton) -> None:
    assert ned_attitude(q_WB) == pytest.approx(q)


def test_vectors_change_axes_and_back() -> None:
    assert swapped((1.0, 2.0, 3.0)) == (2.0, 1.0, -3.0)
    assert swapped(swapped((1.0, 2.0, 3.0))) == (1.0, 2.0, 3.0)
    assert forward_right_down((1.0, 2.0, 3.0)) == (1.0, -2.0, -3.0)


@settings(derandomize=True)
@given(quaternions, quaternions, st.tuples(numbers, numbers, numbers))
def test_turning_and_combining_are_those_of_matrices(a: Hamilton, b: Hamilton, v: tuple[float, float, float]) -> None:
    p, q = ((w / math.hypot(w, x, y, z), *(i / math.hypot(w, x, y, z) for i in (x, y, z))) for w, x, y, z in (a, b))
    assert len(p) == len(q) == 4
    np.testing.assert_allclose(matrix(*product(p, q)), matrix(*p) @ matrix(*q), atol=1e-12)
    np.testing.assert_allclose(turn(p, v), matrix(*p) @ np.array(v), atol=1e-12)
    np.testing.assert_allclose(matrix(*inverse(p)), matrix(*p).T, atol=1e-12)


@settings(derandomize=True)
@given(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0))
def test_angles_are_those_that_were_put_in(roll: float, pitch: float, yaw: float) -> None:
    about_x = (math.cos(roll / 2), math.sin(roll / 2), 0.0, 0.0)
    about_y = (math.cos(pitch / 2), 0.0, math.sin(pitch / 2), 0.0)
    q = product(level(yaw), product(about_y, about_x))
    assert angles(q) == pytest.approx((roll, pitch, yaw), abs=1e-9)
    assert heading(q) == pytest.approx(yaw, abs=1e-9)


def test_angles_wrap() -> None:
    assert wrapped(math.pi) == pytest.approx(-math.pi)
    assert wrapped(-7.0) == pytest.approx(-7.0 + math.tau)
