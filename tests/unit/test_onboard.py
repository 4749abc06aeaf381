"""The onboard PID cascade and mixer, held to what crazyflie-firmware does (files named in `kernels.onboard`)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from lcd_flight.control.geometric import Rotation, rotation_of
from lcd_flight.model import Vehicle
from lcd_flight.model.frames import from_yaw, multiply
from lcd_flight.worlds import load_vehicle
from sim_bridge.craft import craft_of
from sim_bridge.kernels.onboard import (
    FULL_SCALE,
    Onboard,
    PidMemory,
    Setpoint,
    cascade,
    mixed,
    onboard,
    received,
    roll_pitch_yaw,
    speed_of,
    tilt_and_heading,
)

VEHICLE = load_vehicle("crazyflie")
BOARD: Onboard = onboard(VEHICLE, VEHICLE)
ZERO = (0.0, 0.0, 0.0)
FRESH = PidMemory(ZERO, ZERO, ZERO, ZERO)
LEVEL = rotation_of((0.0, 0.0, 0.0, 1.0))


def turned(roll: float, pitch: float, yaw: float) -> Rotation:
    """Degrees, about z, then y, then x."""
    r, p = 0.5 * math.radians(roll), 0.5 * math.radians(pitch)
    q = multiply(from_yaw(math.radians(yaw)), (0.0, math.sin(p), 0.0, math.cos(p)))
    return rotation_of(multiply(q, (math.sin(r), 0.0, 0.0, math.cos(r))))


@dataclass
class FirmwarePid:
    """pid.c, read line by line (no filter, no feed-forward, no output limit)."""

    kp: float
    ki: float
    kd: float
    limit: float
    integral: float = 0.0
    before: float = 0.0

    def update(self, desired: float, measured: float, is_yaw: bool = False) -> float:
        def capped(angle: float) -> float:
            return angle - 360.0 if angle > 180.0 else angle + 360.0 if angle < -180.0 else angle

        error, delta = desired - measured, -(measured - self.before)
        if is_yaw:
            error, delta = capped(error), capped(delta)
        self.integral = max(-self.limit, min(self.limit, self.integral + error * 0.002))
        self.before = measured
        return self.kp * error + self.kd * delta / 0.002 + self.ki * self.integral


def test_the_cascade_is_the_firmwares_axis_by_axis() -> None:
    """Its gains written out here once more; random setpoints and motions over many periods."""
    rng = np.random.default_rng(0)
    attitude = [FirmwarePid(6.0, 3.0, 0.0, 20.0), FirmwarePid(6.0, 3.0, 0.0, 20.0), FirmwarePid(6.0, 1.0, 0.35, 360.0)]
    rates = [
        FirmwarePid(250.0, 500.0, 2.5, 33.3),
        FirmwarePid(250.0, 500.0, 2.5, 33.3),
        FirmwarePid(120.0, 16.7, 0.0, 166.7),
    ]
    memory = FRESH
    for _ in range(300):
        wanted, angles, spin = rng.uniform(-25.0, 25.0, (3, 3))
        wanted[2], angles[2] = rng.uniform(-180.0, 180.0, 2)
        rate_setpoints = [pid.update(wanted[i], angles[i], is_yaw=i == 2) for i, pid in enumerate(attitude)]
        expected = [pid.update(rate_setpoints[i], spin[i]) for i, pid in enumerate(rates)]
        outputs, memory = cascade(Setpoint(30000.0, tuple(wanted)), tuple(angles), tuple(spin), memory, BOARD)
        assert outputs == pytest.approx(np.clip(expected, -32767.0, 32767.0))


def test_yaw_goes_the_short_way() -> None:
    heading = (0.0, 0.0, 170.0)
    still = FRESH._replace(attitude=heading)
    outputs, _ = cascade(Setpoint(3e4, (0.0, 0.0, -170.0)), heading, ZERO, still, BOARD)
    assert outputs[2] == pytest.approx(120.0 * (6.0 * 20.0 + 20.0 * 0.002) + 16.7 * (120.04 * 0.002))


def test_integrals_are_bounded() -> None:
    memory = FRESH
    for _ in range(100_000):
        _, memory = cascade(Setpoint(3e4, (30.0, -30.0, 90.0)), ZERO, ZERO, memory, BOARD)
    assert memory.attitude_integral == pytest.approx((20.0, -20.0, 360.0))
    assert memory.rate_integral == pytest.approx((33.3, -33.3, 166.7))


def test_no_thrust_stops_the_motors_and_forgets() -> None:
    _, memory = cascade(Setpoint(3e4, (30.0, -30.0, 90.0)), ZERO, ZERO, FRESH, BOARD)
    outputs, memory = cascade(Setpoint(0.0, (30.0, -30.0, 90.0)), ZERO, ZERO, memory, BOARD)
    assert outputs == ZERO
    assert memory.attitude_integral == memory.rate_integral == ZERO
    assert mixed(0.0, outputs, BOARD)[1] == (0.0,) * 4


def test_the_mixer_is_the_firmwares_legacy_one() -> None:
    """M1 front right, M2 back right, M3 back left, M4 front left; its pitch is nose up, its yaw command negated."""
    r, p, y, thrust = 800.0, 300.0, 150.0, 30000.0
    nose_up, yaw = -p, -y
    m1 = thrust - r / 2 + nose_up / 2 + yaw
    m2 = thrust - r / 2 - nose_up / 2 - yaw
    m3 = thrust + r / 2 - nose_up / 2 + yaw
    m4 = thrust + r / 2 + nose_up / 2 - yaw
    asked, given = mixed(thrust, (r, p, y), BOARD)
    assert given == asked == (m4, m1, m2, m3)


def test_too_much_for_one_motor_lowers_all_and_none_goes_below_zero() -> None:
    """power_distribution_quadrotor.c, powerDistributionCap: attitude before thrust."""
    asked, given = mixed(60000.0, (20000.0, 0.0, 0.0), BOARD)
    assert max(asked) == 70000.0
    assert given == tuple(a - (70000.0 - FULL_SCALE) for a in asked)
    _, given = mixed(5000.0, (20000.0, 0.0, 0.0), BOARD)
    assert given == (15000.0, 0.0, 0.0, 15000.0)
    idling = onboard(replace(VEHICLE, onboard=replace(VEHICLE.onboard, thrust_floor=0.1)), VEHICLE)
    assert min(mixed(5000.0, (20000.0, 0.0, 0.0), idling)[1]) == pytest.approx(0.1 * FULL_SCALE)


def test_thrust_counts_are_linear_in_force_and_limited() -> None:
    for thrust_N in (0.1, VEHICLE.weight_N, 0.5):
        counts = received(thrust_N, LEVEL, LEVEL, BOARD).thrust
        speed = speed_of(counts, VEHICLE.rotor_speed_max)
        assert 4.0 * VEHICLE.k_eta * speed**2 == pytest.approx(thrust_N)
    assert received(9.0, LEVEL, LEVEL, BOARD).thrust == 60000.0
    assert received(999.0 / BOARD.counts_per_N, LEVEL, LEVEL, BOARD).thrust == 0.0
    assert received(1001.0 / BOARD.counts_per_N, LEVEL, LEVEL, BOARD).thrust == pytest.approx(1001.0)


def test_roll_pitch_and_yaw_are_read_from_an_attitude() -> None:
    for angles in ((10.0, -20.0, 30.0), (-70.0, 45.0, -170.0), (0.0, 0.0, 179.0)):
        assert roll_pitch_yaw(turned(*angles)) == pytest.approx(angles, abs=1e-9)


def test_with_the_heading_as_wanted_the_setpoint_is_the_attitude() -> None:
    angles = (12.0, -25.0, 40.0)
    assert tilt_and_heading(turned(*angles), turned(3.0, 5.0, 40.0)) == pytest.approx(angles, abs=1e-9)


@pytest.mark.parametrize("heading", [-150.0, -30.0, 0.0, 80.0])
def test_roll_and_pitch_point_the_thrust_along_the_wanted_one_at_any_heading(heading: float) -> None:
    wanted = turned(12.0, -25.0, 40.0)
    roll, pitch, yaw = tilt_and_heading(wanted, turned(4.0, -7.0, heading))
    assert turned(roll, pitch, heading)[2] == pytest.approx(wanted[2], abs=1e-9)
    assert yaw == pytest.approx(40.0)


def test_the_thrust_scale_is_of_the_vehicle_that_is_believed() -> None:
    weaker = VEHICLE.weaker(0.9)
    assert onboard(weaker, VEHICLE).counts_per_N == BOARD.counts_per_N
    assert onboard(weaker, weaker).counts_per_N == pytest.approx(BOARD.counts_per_N / 0.9)


def without_onboard(vehicle: Vehicle) -> Vehicle:
    return replace(vehicle, onboard=None)


def test_vehicles_that_cannot_fly_setpoints_are_refused() -> None:
    with pytest.raises(ValueError, match="crazyflie has no onboard controller"):
        onboard(without_onboard(VEHICLE), VEHICLE)
    with pytest.raises(ValueError, match=r"the onboard rate 250.0 Hz is no multiple of 100 Hz"):
        onboard(replace(VEHICLE, onboard=replace(VEHICLE.onboard, rate_hz=250.0)), VEHICLE)
    assert craft_of(without_onboard(VEHICLE), VEHICLE, "paper").steps == 2
