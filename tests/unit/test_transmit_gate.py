from __future__ import annotations

import math

import pytest

from lcd_flight.model import AttitudeThrust, Severity
from lcd_flight.model.frames import IDENTITY, from_yaw, multiply, tilt_of, yaw_of
from lcd_flight.model.types import Quaternion
from lcd_flight.safety.gate import MAX_AGE_NS, GateLimits, clamp_and_warn, gate, is_fresh
from lcd_flight.worlds import load_vehicle

LIMITS = GateLimits(thrust_N=0.5, tilt_rad=math.radians(60.0), yaw_rate=5.0)
FALLBACK = AttitudeThrust(0.28, from_yaw(0.4))


def tilted(angle_rad: float, yaw_rad: float = 0.0) -> Quaternion:
    """About the world's y axis, after the yaw."""
    return multiply((0.0, math.sin(angle_rad / 2), 0.0, math.cos(angle_rad / 2)), from_yaw(yaw_rad))


def codes(setpoint: AttitudeThrust) -> list[str]:
    return [finding.code for finding in gate(setpoint, LIMITS, FALLBACK)[1]]


def test_a_sound_setpoint_passes_unchanged() -> None:
    setpoint = AttitudeThrust(0.3, IDENTITY, 0.2)
    assert gate(setpoint, LIMITS, FALLBACK) == (setpoint, ())


@pytest.mark.parametrize("thrust_N", [0.0, 1e-9, 0.5 - 1e-9, 0.5])
def test_thrust_up_to_the_limits_passes(thrust_N: float) -> None:
    assert gate(AttitudeThrust(thrust_N, IDENTITY), LIMITS, FALLBACK)[0].thrust_N == thrust_N


@pytest.mark.parametrize(("thrust_N", "sent_N"), [(0.5 + 1e-9, 0.5), (7.0, 0.5), (-1e-9, 0.0), (-3.0, 0.0)])
def test_thrust_beyond_is_clamped_and_reported(thrust_N: float, sent_N: float) -> None:
    setpoint, findings = gate(AttitudeThrust(thrust_N, IDENTITY), LIMITS, FALLBACK)
    assert setpoint.thrust_N == sent_N
    assert [(f.code, f.severity, f.value, f.limit) for f in findings] == [
        ("gate_thrust", Severity.WARN, thrust_N, sent_N)
    ]


@pytest.mark.parametrize(
    "setpoint",
    [
        AttitudeThrust(math.nan, IDENTITY),
        AttitudeThrust(math.inf, IDENTITY),
        AttitudeThrust(0.3, (math.nan, 0.0, 0.0, 1.0)),
        AttitudeThrust(0.3, IDENTITY, math.nan),
        AttitudeThrust(0.3, (0.0, 0.0, 0.0, 0.0)),
        AttitudeThrust(0.3, (0.0, 0.0, 0.0, 0.49)),
    ],
)
def test_what_is_no_setpoint_is_replaced(setpoint: AttitudeThrust) -> None:
    sent, findings = gate(setpoint, LIMITS, FALLBACK)
    assert sent == FALLBACK
    assert [finding.code for finding in findings] == ["gate_invalid"]


@pytest.mark.parametrize("angle_deg", [61.0, 90.0, 135.0, 180.0])
@pytest.mark.parametrize("yaw_deg", [0.0, 70.0])
def test_tilt_is_taken_back_to_the_limit(angle_deg: float, yaw_deg: float) -> None:
    setpoint = AttitudeThrust(0.3, tilted(math.radians(angle_deg), math.radians(yaw_deg)))
    sent, findings = gate(setpoint, LIMITS, FALLBACK)
    assert tilt_of(sent.q_WB) == pytest.approx(LIMITS.tilt_rad)
    assert [finding.code for finding in findings] == ["gate_tilt"]


def test_tilt_is_taken_back_in_its_own_plane() -> None:
    sent, _ = gate(AttitudeThrust(0.3, tilted(math.radians(75.0), 0.6)), LIMITS, FALLBACK)
    assert sent.q_WB == pytest.approx(tilted(LIMITS.tilt_rad, 0.6))


def test_tilt_within_the_limit_passes() -> None:
    sent, findings = gate(AttitudeThrust(0.3, tilted(math.radians(59.9), 0.3)), LIMITS, FALLBACK)
    assert not findings
    assert yaw_of(sent.q_WB) == pytest.approx(yaw_of(tilted(math.radians(59.9), 0.3)))


def test_length_is_corrected_and_reported_beyond_rounding() -> None:
    sent, findings = gate(AttitudeThrust(0.3, (0.0, 0.0, 0.0, 1.0 + 1e-6)), LIMITS, FALLBACK)
    assert sent.q_WB == IDENTITY
    assert not findings
    assert codes(AttitudeThrust(0.3, (0.0, 0.0, 0.0, 1.1))) == ["gate_unit"]


def test_yaw_rate_is_clamped() -> None:
    assert gate(AttitudeThrust(0.3, IDENTITY, -9.0), LIMITS, FALLBACK)[0].yaw_rate == -5.0
    assert codes(AttitudeThrust(0.3, IDENTITY, 9.0)) == ["gate_yaw_rate"]


def test_every_change_is_reported() -> None:
    assert codes(AttitudeThrust(9.0, tilted(2.0), 9.0)) == ["gate_thrust", "gate_yaw_rate", "gate_tilt"]


def test_clamp_and_warn_names_what_it_changed() -> None:
    value, finding = clamp_and_warn(3.0, 0.0, 2.0, "thrust", "N")
    assert value == 2.0
    assert finding is not None
    assert finding.message == "transmit gate: thrust 3 N clamped to 2"


@pytest.mark.parametrize(("age_ns", "fresh"), [(0, True), (MAX_AGE_NS, True), (MAX_AGE_NS + 1, False)])
def test_a_setpoint_older_than_50_ms_is_not_sent(age_ns: int, fresh: bool) -> None:
    assert MAX_AGE_NS == 50_000_000
    assert is_fresh(1_000_000_000, 1_000_000_000 + age_ns) is fresh


def test_limits_are_the_onboard_controllers() -> None:
    vehicle = load_vehicle("crazyflie")
    share = 1.0 if vehicle.onboard is None else vehicle.onboard.thrust_limit
    assert GateLimits.of(vehicle).thrust_N == pytest.approx(share * vehicle.max_thrust_N)
