"""What the simulated autopilot says of its motion, against where it truly is (x east, y north, z up)."""

from __future__ import annotations

import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import common
from virtual_mavlink import HOVER, REQUEST, Client, turned

from lcd_flight.model.frames import conjugate, rotate, yaw_of

BOTH = pytest.mark.parametrize("flavour", ["px4", "ardupilot"])


@pytest.fixture(params=["px4", "ardupilot"])
def moving(request: pytest.FixtureRequest) -> Client:
    """Rolled to the right, its nose north."""
    client = Client(request.param)
    client.take_off()
    client.fly(400, 1.1 * HOVER[request.param], turned(roll_deg=20.0))
    return client


def asked(client: Client, kind: int, name: str) -> Any:
    """A message that is wanted now: it comes before time goes on."""
    client.forget()
    client.command(REQUEST, kind)
    return client.of(name)[0]


def test_position_and_velocity_are_north_east_down(moving: Client) -> None:
    east, north, up = moving.state.p_WB
    v_east, v_north, v_up = moving.state.v_WB_W
    told = asked(moving, 32, "LOCAL_POSITION_NED")
    assert (told.x, told.y, told.z) == pytest.approx((north, east, -up), abs=0.05)
    assert (told.vx, told.vy, told.vz) == pytest.approx((v_north, v_east, -v_up), abs=0.15)
    assert math.hypot(v_north, v_east) > 0.3, "it moves"


def test_attitude_is_told_in_angles_and_as_a_quaternion(moving: Client) -> None:
    _, _, left_side_up = rotate(moving.state.q_WB, (0.0, 1.0, 0.0))
    angles = asked(moving, 30, "ATTITUDE")
    assert left_side_up > 0.2, "it has rolled"
    assert angles.roll == pytest.approx(math.asin(left_side_up), abs=0.03)
    told = moving.pilot.estimator.attitude
    q = asked(moving, 31, "ATTITUDE_QUATERNION")
    assert (q.q1, q.q2, q.q3, q.q4) == pytest.approx(told, abs=0.05)


def test_yaw_is_told_clockwise_from_north(moving: Client) -> None:
    moving.fly(800, HOVER[moving.flavour], turned(yaw_deg=60.0))
    yaw = math.pi / 2 - yaw_of(moving.state.q_WB)
    assert yaw > 0.3, "it has turned to the right"
    assert asked(moving, 30, "ATTITUDE").yaw == pytest.approx(yaw, abs=0.03)


def test_rates_are_those_of_forward_right_down(moving: Client) -> None:
    moving.target(HOVER[moving.flavour])
    moving.wait(60)
    p, q, r = moving.state.w_WB_B
    told = asked(moving, 30, "ATTITUDE")
    assert (told.rollspeed, told.pitchspeed, told.yawspeed) == pytest.approx((p, -q, -r), abs=0.2)
    assert p < -0.5, "it rolls back to the left"


def test_odometry_has_the_velocity_in_the_body(moving: Client) -> None:
    forward, left, up = rotate(conjugate(moving.state.q_WB), moving.state.v_WB_W)
    told = asked(moving, 331, "ODOMETRY")
    assert (told.vx, told.vy, told.vz) == pytest.approx((forward, -left, -up), abs=0.15)
    assert (told.frame_id, told.child_frame_id) == (common.MAV_FRAME_LOCAL_NED, common.MAV_FRAME_BODY_FRD)


def test_attitude_target_is_what_was_taken(moving: Client) -> None:
    told = asked(moving, 83, "ATTITUDE_TARGET")
    assert told.thrust == pytest.approx(1.1 * HOVER[moving.flavour])


@BOTH
def test_without_a_position_none_is_told(flavour: str) -> None:
    client = Client(flavour, own_mocap=False)
    for kind in (32, 331, 242, 83):
        assert client.command(REQUEST, kind) == 0
    told = {message.get_type() for message in client.heard}
    assert not told & {"LOCAL_POSITION_NED", "ODOMETRY", "HOME_POSITION", "ATTITUDE_TARGET"}


def test_estimator_status_says_whether_there_is_a_position() -> None:
    seeing, blind = Client(), Client(own_mocap=False)
    for client in (seeing, blind):
        client.wait(1000)
    assert seeing.of("ESTIMATOR_STATUS")[-1].flags & 0x8 == 0x8
    assert blind.of("ESTIMATOR_STATUS")[-1].flags & 0x8 == 0
    assert blind.of("ESTIMATOR_STATUS")[-1].flags & 0x80 == 0x80


def test_severities_come_with_the_texts() -> None:
    client = Client()
    client.wait(10)
    client.mode(6 << 16)
    client.wait(10)
    assert [(text.severity, text.text[:9]) for text in client.of("STATUSTEXT")] == [
        (6, "Ready for"),
        (2, "Switching"),
        (2, "ible"),
    ]


def test_a_mavlink_1_packet_is_understood() -> None:
    client = Client()
    request = common.MAVLink_command_long_message(1, 1, REQUEST, 0, 148, 0, 0, 0, 0, 0, 0)
    packet = request.pack(common.MAVLink(None, srcSystem=245), force_mavlink1=True)
    assert packet[0] == 0xFE
    client.vehicle.receive(packet, 0)
    client.wait(10)
    assert client.of("AUTOPILOT_VERSION")


def test_a_packet_with_a_wrong_checksum_is_noise() -> None:
    client = Client()
    client.wait(100)
    packet = bytearray(common.MAVLink_timesync_message(0, 7).pack(common.MAVLink(None, srcSystem=245)))
    packet[-1] ^= 1
    client.forget()
    client.vehicle.receive(bytes(packet), client.now_ns)
    client.wait(4)
    assert not [message for message in client.of("TIMESYNC") if message.tc1]


def test_flags_that_nobody_knows_make_a_packet_unknown() -> None:
    client = Client()
    mav = common.MAVLink(None, srcSystem=245)
    packet = bytearray(common.MAVLink_timesync_message(0, 7).pack(mav))
    packet[2] = 0x04
    crc = common.x25crc(packet[1:-2])
    crc.accumulate(bytes((34,)))
    packet[-2:] = crc.crc.to_bytes(2, "little")
    client.wait(100)
    client.forget()
    client.vehicle.receive(bytes(packet), client.now_ns)
    client.wait(4)
    assert not [message for message in client.of("TIMESYNC") if message.tc1]
