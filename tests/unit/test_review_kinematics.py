"""Angles, rates and lags against flights whose answers are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import synthetic_flight
from synthetic_flight import log_of

from lcd_flight.control.geometric import attitude_setpoint
from lcd_flight.model import GRAVITY_M_PER_S2, AttitudeThrust, Trajectory
from lcd_flight.model.frames import from_yaw, multiply
from lcd_flight.model.types import FloatArray, Quaternion
from lcd_flight.record import Series
from lcd_flight.review.kinematics import (
    attitude_error_rad,
    attitude_lag_s,
    euler_deg,
    reference_rates,
    thrust_direction_error_rad,
    tilt_rad,
)

TILT: Quaternion = (np.sin(0.25), 0.0, 0.0, np.cos(0.25))  # 0.5 rad about x


def series() -> Series:
    return log_of(synthetic_flight.flight()).series


def rotation(reference_a_W: FloatArray, yaw: float) -> FloatArray:
    """R_WD as the control law has it, columns b1, b2, b3."""
    force = tuple((reference_a_W + np.array([0.0, 0.0, GRAVITY_M_PER_S2])).tolist())
    return np.array(attitude_setpoint(force, (np.cos(yaw), np.sin(yaw)))).T  # type: ignore[arg-type]


def test_attitude_in_degrees() -> None:
    sin, cos = 0.5, np.sqrt(0.75)  # 60 degrees about each axis
    q = np.array([[sin, 0.0, 0.0, cos], [0.0, sin, 0.0, cos], [0.0, 0.0, sin, cos]])
    np.testing.assert_allclose(euler_deg(q), 60.0 * np.eye(3), atol=1e-9)
    np.testing.assert_allclose(tilt_rad(q), np.radians([60.0, 60.0, 0.0]), atol=1e-9)


def test_yaw_goes_on_beyond_half_a_turn() -> None:
    yaw = np.radians(np.arange(0.0, 720.0, 10.0))
    q = np.stack([0.0 * yaw, 0.0 * yaw, np.sin(yaw / 2), np.cos(yaw / 2)], axis=1)
    assert euler_deg(q)[:, 2].tolist() == pytest.approx(np.arange(0.0, 720.0, 10.0).tolist(), abs=1e-6)


def test_reference_rates_are_those_of_the_desired_attitude() -> None:
    """The derivative of the attitude that the control law derives from the reference, by small differences."""
    rng = np.random.default_rng(5)
    trajectory = Trajectory(np.array([2.0]), rng.normal(size=(4, 1, 8)) * (0.4 ** np.arange(8)))
    times_s = np.linspace(0.1, 1.9, 19)
    references = [trajectory.reference(time_s) for time_s in times_s.tolist()]
    step_s = 1e-5
    found = reference_rates(
        replace(
            series(),
            reference_a_W=np.array([row.a_W for row in references]),
            reference_j_W=np.array([row.j_W for row in references]),
            reference_yaw_rad=np.array([row.yaw_rad for row in references]),
            reference_yaw_rate=np.array([row.yaw_rate for row in references]),
        )
    )
    for time_s, rates in zip(times_s.tolist(), found, strict=True):
        before, now, after = (trajectory.reference(time_s + sign * step_s) for sign in (-1, 0, 1))
        change = (rotation(np.array(after.a_W), after.yaw_rad) - rotation(np.array(before.a_W), before.yaw_rad)) / (
            2.0 * step_s
        )
        cross = rotation(np.array(now.a_W), now.yaw_rad).T @ change
        np.testing.assert_allclose(rates, (cross[2, 1], cross[0, 2], cross[1, 0]), rtol=1e-4, atol=1e-5)


def test_where_there_is_no_reference_there_are_no_rates() -> None:
    rates = reference_rates(series())
    assert np.isnan(rates[:20]).all()
    assert np.isfinite(rates[30:-1]).all()


def test_free_fall_has_no_direction() -> None:
    falling = np.tile([0.0, 0.0, -GRAVITY_M_PER_S2], (len(series()), 1))
    assert np.isnan(reference_rates(replace(series(), reference_a_W=falling))).all()


def test_angles_to_the_setpoint() -> None:
    """A setpoint that is tilted by 0.5 rad after a turn by 0.2 rad about the vertical."""
    pairs = []
    for inputs, tick in synthetic_flight.flight():
        state = inputs.pose.state
        assert state is not None
        level = replace(inputs, pose=replace(inputs.pose, state=replace(state, q_WB=(0.0, 0.0, 0.0, 1.0))))
        pairs.append((level, replace(tick, setpoint=AttitudeThrust(0.3, multiply(from_yaw(0.2), TILT)))))
    found = log_of(pairs).series
    assert thrust_direction_error_rad(found)[100] == pytest.approx(0.5)
    assert attitude_error_rad(found)[100] == pytest.approx(2.0 * np.arccos(np.cos(0.1) * np.cos(0.25)))


@pytest.mark.parametrize("delay_s", [0.0, 0.05, 0.1])
def test_a_known_delay_of_the_attitude_is_found(delay_s: float) -> None:
    whole = series()
    ticks = round(delay_s * 100)
    flown = np.roll(whole.setpoint_q_WB, ticks, axis=0)
    flown[~np.isfinite(flown)] = 0.0
    assert attitude_lag_s(replace(whole, q_WB=flown)) == pytest.approx(delay_s, abs=2e-3)


def test_a_delay_between_ticks_is_found() -> None:
    whole = series()
    asked = np.nan_to_num(whole.setpoint_q_WB)
    half = 0.5 * (np.roll(asked, 6, axis=0) + np.roll(asked, 7, axis=0))
    lag_s = attitude_lag_s(replace(whole, q_WB=half / np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-9)))
    assert lag_s == pytest.approx(0.065, abs=1e-3)


def test_of_a_hover_no_delay_can_be_told() -> None:
    whole = series()
    level = np.tile([0.0, 0.0, 0.0, 1.0], (len(whole), 1))
    assert attitude_lag_s(replace(whole, setpoint_q_WB=level)) is None
    assert attitude_lag_s(log_of(synthetic_flight.flight()[:1]).series) is None
    assert attitude_lag_s(log_of(synthetic_flight.flight()[:30]).series) is None
