"""The packets of the Crazyflie link, byte for byte, and their signs. cflib is the other opinion."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
from cflib.crazyflie.commander import Commander
from cflib.crazyflie.localization import Localization
from hypothesis import assume, given
from hypothesis import strategies as st

from drivers.crazyflie import crtp_wire
from lcd_flight.model import AttitudeThrust, Quaternion
from lcd_flight.model.frames import body_x_axis, body_z_axis, from_yaw, multiply, rotate, seen_from_heading
from sim_bridge.kernels.onboard import tilt_and_heading

AHEAD = (1.0, 0.0, 0.0)
ANGLE = 0.2


def turned(axis: int, angle_rad: float) -> Quaternion:
    """A rotation about one body axis."""
    half = [0.0, 0.0, 0.0]
    half[axis] = math.sin(0.5 * angle_rad)
    return (half[0], half[1], half[2], math.cos(0.5 * angle_rad))


def fields(packet: bytes) -> tuple[float, ...]:
    """Roll, pitch, yaw and thrust as they stand in the packet."""
    header, *values = struct.unpack("<BfffH", packet)
    assert header == 0x3C
    return tuple(values)


class Recorder:
    """Stands in for cflib's Crazyflie."""

    def __init__(self) -> None:
        self.sent: list[bytes] = []

    def send_packet(self, packet: object) -> None:
        self.sent.append(bytes([packet.get_header(), *packet.data]))  # type: ignore[attr-defined]


def test_a_setpoint_is_what_cflib_sends() -> None:
    recorder = Recorder()
    Commander(recorder).send_setpoint(1.5, -2.5, 33.0, 38842)
    assert recorder.sent == [crtp_wire.rpyt(1.5, -2.5, 33.0, 38842)]


def test_stop_and_notification_are_what_cflib_sends() -> None:
    recorder = Recorder()
    Commander(recorder).send_stop_setpoint()
    Commander(recorder).send_notify_setpoint_stop()
    assert recorder.sent == [crtp_wire.STOP, crtp_wire.NOTIFY_STOP]


def test_a_pose_is_what_cflib_sends() -> None:
    class Crazyflie(Recorder):
        def add_port_callback(self, _port: int, _callback: object) -> None:
            """Not of interest."""

    recorder = Crazyflie()
    Localization(recorder).send_extpose((1.0, 2.0, 3.0), (0.1, 0.2, 0.3, 0.9))
    assert recorder.sent == [crtp_wire.extpose((1.0, 2.0, 3.0), (0.1, 0.2, 0.3, 0.9))]


def test_golden_bytes() -> None:
    assert crtp_wire.UNLOCK.hex() == "3c00000000000000800000000000" + "00"
    assert crtp_wire.rpyt(10.0, 5.0, 90.0, 0x9876).hex() == "3c00002041" + "0000a0c0" + "0000b442" + "7698"
    assert crtp_wire.arming(True, 12).hex() == "9d0101"
    assert crtp_wire.arming(False, 12).hex() == "9d0100"
    assert crtp_wire.arming(True, 11).hex() == "dc0101"
    assert crtp_wire.emergency_watchdog(12).hex() == "9d04"
    assert crtp_wire.emergency_watchdog(10).hex() == "6d04"
    assert crtp_wire.extpose((0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0)).hex() == "6d08" + "00" * 8 + "0000803f" + (
        "00" * 12 + "0000803f"
    )


@pytest.mark.parametrize(
    ("attitude", "roll", "pitch", "yaw"),
    [
        pytest.param(turned(0, ANGLE), +1, 0, 0, id="right side down"),
        pytest.param(turned(1, ANGLE), 0, -1, 0, id="nose down is negative on the wire"),
        pytest.param(turned(2, ANGLE), 0, 0, +1, id="counter-clockwise"),
    ],
)
def test_signs(attitude: Quaternion, roll: int, pitch: int, yaw: int) -> None:
    packet = crtp_wire.setpoint(AttitudeThrust(0.3, attitude), AHEAD, 30_000)
    degrees = math.degrees(ANGLE)
    assert fields(packet) == pytest.approx((roll * degrees, pitch * degrees, yaw * degrees, 30_000), abs=1e-4)


def test_roll_and_pitch_are_those_of_the_heading_that_the_vehicle_has() -> None:
    """It faces east and shall accelerate east, facing north: that is forward, nose down, whatever yaw is asked for."""
    wanted = multiply(from_yaw(0.5 * math.pi), turned(0, ANGLE))  # thrust towards +x
    assert body_z_axis(wanted)[0] > 0.1
    roll, pitch, yaw = crtp_wire.roll_pitch_yaw_deg(wanted, AHEAD)
    assert (roll, pitch, yaw) == pytest.approx((0.0, math.degrees(ANGLE), 90.0), abs=1e-9)


unit = st.floats(-1.0, 1.0)


@given(st.tuples(unit, unit, unit, unit), st.floats(-math.pi, math.pi), st.floats(-1.0, 1.0))
def test_the_thrust_points_where_it_should_at_any_heading(q: Quaternion, heading: float, tilt: float) -> None:
    """Roll and pitch, turned into an attitude at the present heading, have the thrust axis that was asked for."""
    length = math.hypot(*q)
    assume(length > 0.1)
    wanted: Quaternion = (q[0] / length, q[1] / length, q[2] / length, q[3] / length)
    nose_W = body_x_axis(multiply(from_yaw(heading), turned(1, tilt)))
    roll, pitch, _ = crtp_wire.roll_pitch_yaw_deg(wanted, nose_W)
    flown = multiply(multiply(from_yaw(heading), turned(1, math.radians(pitch))), turned(0, math.radians(roll)))
    assert body_z_axis(flown) == pytest.approx(body_z_axis(wanted), abs=1e-9)


@given(st.tuples(unit, unit, unit, unit), st.tuples(unit, unit, unit, unit))
def test_it_is_what_rehearsals_fly(a: Quaternion, b: Quaternion) -> None:
    """The simulated flight loop converts setpoints for its onboard controller by the same function."""
    assume(min(math.hypot(*a), math.hypot(*b)) > 0.1)
    wanted, present = (tuple(np.array(q) / math.hypot(*q)) for q in (a, b))
    columns = [tuple(rotate(q, axis) for axis in np.eye(3).tolist()) for q in (wanted, present)]
    assume(all(math.hypot(x[0], x[1]) > 0.01 for x, _, _ in columns))  # a nose that points up has no heading
    forward, _ = seen_from_heading(columns[0][2], columns[1][0])
    assume(math.hypot(forward, columns[0][2][2]) > 0.01)  # nor has thrust to the side a pitch
    for ours, theirs in zip(
        crtp_wire.roll_pitch_yaw_deg(wanted, columns[1][0]), tilt_and_heading(*columns), strict=True
    ):
        assert math.cos(math.radians(ours - theirs)) == pytest.approx(1.0, abs=1e-6)
