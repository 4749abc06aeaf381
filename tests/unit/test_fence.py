from __future__ import annotations

import pytest

from lcd_flight.model import Geofence, Vector3
from lcd_flight.safety.fence import STOPPING_DECELERATION, stopping_margin_m, stopping_point_m

FENCE = Geofence((-2.0, -2.0, 0.0), (2.0, 2.0, 3.0))


def test_at_rest_it_stops_where_it_is() -> None:
    assert stopping_point_m((1.0, 2.0, 3.0), (0.0, 0.0, 0.0)) == (1.0, 2.0, 3.0)


def test_stopping_distance_is_v_squared_over_2a_along_the_way() -> None:
    x, y, z = stopping_point_m((0.0, 0.0, 1.0), (3.0, -4.0, 0.0))
    distance = 25.0 / (2.0 * STOPPING_DECELERATION)
    assert (x, y, z) == pytest.approx((0.6 * distance, -0.8 * distance, 1.0))


@pytest.mark.parametrize(
    ("p_W", "v_W", "margin_m"),
    [
        ((1.5, 0.0, 1.0), (0.0, 0.0, 0.0), 0.5),
        ((1.5, 0.0, 1.0), (2.0, 0.0, 0.0), 0.0),
        ((1.5, 0.0, 1.0), (2.2, 0.0, 0.0), -0.105),
        ((-1.5, 0.0, 1.0), (2.2, 0.0, 0.0), 0.5),
        ((0.0, 0.0, 2.9), (0.0, 0.0, 2.0), -0.4),
        ((1.5, 0.0, 1.0), (1.0, 2.4, 0.0), 0.175),
        ((2.5, 0.0, 1.0), (-3.0, 0.0, 0.0), -0.5),
    ],
)
def test_margin(p_W: Vector3, v_W: Vector3, margin_m: float) -> None:
    assert stopping_margin_m(FENCE, p_W, v_W) == pytest.approx(margin_m)


def test_the_floor_is_the_ground_and_no_wall() -> None:
    assert stopping_margin_m(FENCE, (0.0, 0.0, -0.01), (0.0, 0.0, -1.0)) > 0.0
