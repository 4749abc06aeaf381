"""Packets to and from the simulated MAVLink vehicle, byte by byte: put together by hand from the message tables."""

from __future__ import annotations

import math
from typing import Any

import pytest
from virtual_mavlink import Client

from sim_bridge.mavlink import telemetry
from sim_bridge.mavlink.codec import Codec
from sim_bridge.mavlink.command_service import acknowledgement
from sim_bridge.mavlink.signing import Signatures
from sim_bridge.mavlink.vocabulary import Result

HALF = math.sqrt(0.5)

ARM = bytes.fromhex(
    "FD 20 00 00 00 F5 BF 4C 00 00 00 00 80 3F 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00"
    "00 00 00 00 00 00 90 01 01 01 55 D7"
)
OFFBOARD = bytes.fromhex(
    "FD 20 00 00 01 F5 BF 4C 00 00 00 00 80 3F 00 00 C0 40 00 00 00 00 00 00 00 00 00 00 00 00 00 00"
    "00 00 00 00 00 00 B0 00 01 01 7F 73"
)
GUIDED_NOGPS = bytes.fromhex(
    "FD 20 00 00 00 F5 BF 4C 00 00 00 00 80 3F 00 00 A0 41 00 00 00 00 00 00 00 00 00 00 00 00 00 00"
    "00 00 00 00 00 00 B0 00 01 01 3F DE"
)
ATTITUDE_TARGET = bytes.fromhex(
    "FD 27 00 00 00 F5 BF 52 00 00 E8 03 00 00 00 00 80 3F 00 00 00 00 00 00 00 00 00 00 00 00 00 00"
    "00 00 00 00 00 00 00 00 00 00 9A 99 19 3F 01 01 07 72 CF"
)
READ = bytes.fromhex("FD 12 00 00 00 F5 BF 14 00 00 FF FF 01 01 43 4F 4D 5F 4F 42 4C 5F 52 43 5F 41 43 54 30 88")
WRITE_INT_BYTEWISE = bytes.fromhex(
    "FD 17 00 00 00 F5 BF 17 00 00 05 00 00 00 01 01 43 4F 4D 5F 4F 42 4C 5F 52 43 5F 41 43 54 00 00 06 4E 90"
)
WRITE_INT_CAST = bytes.fromhex(
    "FD 17 00 00 00 F5 BF 17 00 00 00 00 00 00 01 01 47 55 49 44 5F 4F 50 54 49 4F 4E 53 00 00 00 00 06 02 CF"
)
ORIGIN = bytes.fromhex("FD 0D 00 00 00 F5 BF 30 00 00 4C 52 40 1C 44 F4 17 05 40 72 07 00 01 24 EA")
ODOMETRY = (
    bytes.fromhex(
        "FD E9 00 00 00 F5 BF 4B 01 00 40 42 0F 00 00 00 00 00 00 00 80 3F 00 00 00 40 00 00 40 C0"
        "F3 04 35 3F 00 00 00 00 00 00 00 00 F3 04 35 3F"
    )
    + bytes(192)
    + bytes.fromhex("14 0C 00 02 64 0F 82")
)
TIMESYNC = bytes.fromhex("FD 0C 00 00 00 F5 BF 6F 00 00 00 00 00 00 00 00 00 00 15 CD 5B 07 3F F2")


def give(client: Client, packet: bytes) -> None:
    client.vehicle.receive(packet, client.now_ns)
    client.wait(120)


def test_an_attitude_target_comes_in() -> None:
    client = Client()
    give(client, ATTITUDE_TARGET)
    assert client.pilot.target.attitude == (1.0, 0.0, 0.0, 0.0)
    assert client.pilot.target.thrust == pytest.approx(0.6)


def test_offboard_and_arming_come_in() -> None:
    client = Client()
    client.fly(1200, 0.0)
    give(client, OFFBOARD)
    assert client.pilot.mode == 6 << 16
    give(client, ARM)
    assert client.pilot.armed


def test_guided_without_gps_comes_in() -> None:
    client = Client("ardupilot")
    give(client, GUIDED_NOGPS)
    assert client.pilot.mode == 20


def test_a_parameter_is_read_and_written_bytewise() -> None:
    client = Client()
    give(client, READ)
    give(client, WRITE_INT_BYTEWISE)
    assert [message.param_type for message in client.of("PARAM_VALUE")] == [6, 6]
    assert client.vehicle.parameters["COM_OBL_RC_ACT"] == 5


def test_a_parameter_is_written_by_cast() -> None:
    client = Client("ardupilot")
    give(client, WRITE_INT_CAST)
    assert client.vehicle.parameters["GUID_OPTIONS"] == 0


def test_the_origin_comes_in() -> None:
    client = Client("ardupilot", own_mocap=False)
    give(client, ORIGIN)
    assert client.pilot.origin == (473977420, 85455940, 488000)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_odometry_comes_in(flavour: str) -> None:
    client = Client(flavour, own_mocap=False)
    give(client, ODOMETRY)
    assert client.pilot.estimator.position == pytest.approx((1.0, 2.0, -3.0), abs=0.01)
    assert client.pilot.estimator.attitude == pytest.approx((HALF, 0.0, 0.0, HALF), abs=0.01)


def test_timesync_is_answered_with_our_clock_and_theirs() -> None:
    client = Client()
    client.wait(1996)
    client.vehicle.receive(TIMESYNC, 2_000_000_000)
    (answer,) = [packet for packet in client.vehicle.outgoing() if packet[7] == 111 and packet[10:18] != bytes(8)]
    assert answer[10:] == bytes.fromhex("00 94 35 77 00 00 00 00 15 CD 5B 07") + answer[-2:]


def first(message: Any) -> bytes:
    """As the first packet of a fresh channel."""
    return Codec(1, 1, Signatures(None, accepts_unsigned=True)).encode(message, 0)


def test_the_first_packet_of_px4_is_its_heartbeat() -> None:
    client = Client()
    client.vehicle.advance_to(4_000_000)
    assert client.vehicle.outgoing()[0] == bytes.fromhex(
        "FD 09 00 00 00 01 01 00 00 00 00 00 04 03 02 0C 19 03 03 C1 B5"
    )


def test_heartbeat_of_an_armed_copter() -> None:
    client = Client("ardupilot")
    client.take_off()
    told = bytes.fromhex("FD 09 00 00 00 01 01 00 00 00 14 00 00 00 02 03 99 04 03 28 A2")
    assert first(telemetry.heartbeat(client.pilot)) == told


def test_acknowledgements() -> None:
    accepted = first(acknowledgement(400, Result.ACCEPTED, 245, 191))
    assert accepted == bytes.fromhex("FD 0A 00 00 00 01 01 4D 00 00 90 01 00 00 00 00 00 00 F5 BF C8 39")
    refused = first(acknowledgement(176, Result.TEMPORARILY_REJECTED, 245, 191))
    assert refused == bytes.fromhex("FD 0A 00 00 00 01 01 4D 00 00 B0 00 01 00 00 00 00 00 F5 BF 98 BA")


def test_ekf_status_report_with_a_position() -> None:
    client = Client("ardupilot")
    client.wait(3000)
    client.pilot.estimator.ratio = 0.0
    told = bytes.fromhex("FD 16 00 00 00 01 01 C1 00 00") + bytes(20) + bytes.fromhex("3F 03 1E 87")
    assert first(telemetry.ekf_status_report(client.pilot)) == told
