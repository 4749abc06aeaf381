"""What the MAVLink link sends and hears, byte for byte.

The bytes were made from the protocol's message definitions with another packer and another checksum than pymavlink's:
an error that both ends of a test had made would show here.
"""

from __future__ import annotations

import math
import struct

import pytest

from drivers.mavlink import frames_wire, odometry_wire, setpoint_wire
from drivers.mavlink.ardupilot import ArduPilot
from drivers.mavlink.codec import Codec
from drivers.mavlink.commands import Commands
from drivers.mavlink.dialect import Message, mavlink
from drivers.mavlink.odometry_wire import Odometry
from drivers.mavlink.peer import Peer, Receiver
from drivers.mavlink.picture import Picture
from drivers.mavlink.px4 import Px4
from drivers.mavlink.session import Session
from drivers.mavlink.signing import Key
from lcd_flight.model.frames import from_yaw, multiply, yaw_of

TILT = math.radians(10.0)
NORTH = from_yaw(math.pi / 2.0)
NOSE_DOWN = (0.0, math.sin(TILT / 2.0), 0.0, math.cos(TILT / 2.0))
RIGHT_DOWN = (math.sin(TILT / 2.0), 0.0, 0.0, math.cos(TILT / 2.0))


class Wire:
    """A transport that keeps what is sent, and the clock of the session at its end."""

    stream = False
    faults = 0
    called = None

    def __init__(self) -> None:
        self.sent: list[str] = []

    async def open(self, receive: Receiver) -> None:
        """Nothing is heard here."""

    def send(self, data: bytes, _peer: Peer | None, /) -> bool:
        self.sent.append(data.hex())
        return True

    def send_now(self, data: bytes, peer: Peer | None, /) -> bool:
        return self.send(data, peer)

    def close(self) -> None:
        """Nothing is held."""

    def now_ns(self) -> int:
        return 0

    async def sleep_until(self, deadline_ns: int) -> None:
        """Nobody waits."""


def told(command: int, *parameters: float, confirmation: int = 0) -> str:
    """A command as it goes out."""
    wire = Wire()
    session = Session(wire, Codec(245, 191), wire, (1, 1))
    Commands(session, wire, (245, 191)).tell(command, *parameters, confirmation=confirmation)
    return wire.sent[0]


def encoded(message: Message) -> str:
    return Codec(245, 191).encode(message, 0).hex()


def settled(message: Message) -> Message:
    """Without the rounding of the last bit, which is not the same on every machine, and without minus zero."""
    message.q = [round(part, 12) + 0.0 for part in message.q]
    return message


def heard(data: str) -> Picture:
    picture = Picture("enu")
    for message in Codec(245, 191).decode(bytearray.fromhex(data)):
        picture.take(message, 0)
    return picture


def test_heartbeat() -> None:
    wire = Wire()
    Session(wire, Codec(245, 191), wire, (1, 1)).beat(0)
    assert wire.sent == ["fd09000000f5bf000000000000001208000403eda5"]


def test_level_nose_east_at_half_thrust() -> None:
    message = setpoint_wire.attitude_target(from_yaw(0.0), 0.5, now_ns=123_456_000_000, target=(1, 1), frame="enu")
    assert encoded(settled(message)) == (
        "fd27000000f5bf52000040e20100f304353f0000000000000000f304353f0000000000000000000000000000003f010107cb2f"
    )


def test_nose_north_and_down_flies_north() -> None:
    message = setpoint_wire.attitude_target(multiply(NORTH, NOSE_DOWN), 0.625, now_ns=0, target=(1, 1), frame="enu")
    assert encoded(settled(message)) == (
        "fd27000000f5bf520000000000009e067f3f00000000b67eb2bd000000000000000000000000000000000000203f010107bff1"
    )


def test_right_side_down_in_a_frame_of_its_own() -> None:
    message = setpoint_wire.attitude_target(RIGHT_DOWN, 0.25, now_ns=0, target=(1, 1), frame="flu")
    assert encoded(settled(message)) == (
        "fd27000000f5bf520000000000009e067f3fb67eb23d00000000000000000000000000000000000000000000803e01010795e2"
    )


def test_pose() -> None:
    seen = Odometry(5_000_000_000, (1.0, 2.0, 3.0), NORTH, (0.0, 2.0, 0.5), (0.125, 0.25, 0.375), resets=3)
    message = odometry_wire.message(seen, "enu")
    message.vy = round(message.vy, 12) + 0.0
    variances = {
        "p": struct.pack("<f", 0.005**2).hex(),
        "q": struct.pack("<f", 0.02**2).hex(),
        "v": struct.pack("<f", 0.05**2).hex(),
        "w": struct.pack("<f", 0.2**2).hex(),
    }
    assert variances == {"p": "17b7d137", "q": "17b7d139", "v": "0ad7233b", "w": "0ad7233d"}
    assert encoded(settled(message)) == (
        "fde9000000f5bf4b0100404b4c0000000000000000400000803f000040c00000803f0000000000000000000000000000004000000000"
        "000000bf0000003e000080be0000c0be17b7d137000000000000000000000000000000000000000017b7d1370000000000000000"
        "000000000000000017b7d13700000000000000000000000017b7d139000000000000000017b7d1390000000017b7d1390ad7233b"
        "00000000000000000000000000000000000000000ad7233b000000000000000000000000000000000ad7233b0000000000000000"
        "000000000ad7233d00000000000000000ad7233d000000000ad7233d140c030264063e"
    )


@pytest.mark.parametrize(
    ("data", "command", "parameters", "confirmation"),
    [
        pytest.param(
            "fd20000000f5bf4c00000000803f0000c0400000000000000000000000000000000000000000b00001019139",
            176, Px4().mode_command(Px4().flight_mode), 0, id="PX4, OFFBOARD",
        ),
        pytest.param(
            "fd21000000f5bf4c00000000803f000080400000c04000000000000000000000000000000000b00001010122e0",
            176, Px4().mode_command(Px4().land_mode), 1, id="PX4, LAND, asked again",
        ),
        pytest.param(
            "fd20000000f5bf4c00000000803f000080400000000000000000000000000000000000000000b0000101c50a",
            176, ArduPilot().mode_command(ArduPilot().flight_mode), 0, id="ArduPilot, GUIDED",
        ),
        pytest.param(
            "fd20000000f5bf4c00000000803f0000000000000000000000000000000000000000000000009001010155d7",
            400, (1.0,), 0, id="arm",
        ),
        pytest.param(
            "fd20000000f5bf4c0000000000000098a5460000000000000000000000000000000000000000900101017773",
            400, (0.0, 21196.0), 0, id="forced disarm",
        ),
        pytest.param(
            "fd20000000f5bf4c00000000f84100409c460000000000000000000000000000000000000000ff010101c9ca",
            511, (31.0, 20_000.0), 0, id="attitude at 50 Hz",
        ),
    ],
)  # fmt: skip
def test_commands(data: str, command: int, parameters: tuple[float, ...], confirmation: int) -> None:
    assert told(command, *parameters, confirmation=confirmation) == data


def test_parameters() -> None:
    read = mavlink.MAVLink_param_request_read_message(1, 1, b"EKF2_EV_CTRL", -1)
    assert encoded(read) == "fd10000000f5bf140000ffff0101454b46325f45565f4354524c6117"
    wire = Px4().value_to(15.0, mavlink.MAV_PARAM_TYPE_INT32)
    integer = mavlink.MAVLink_param_set_message(1, 1, b"EKF2_EV_CTRL", wire, mavlink.MAV_PARAM_TYPE_INT32)
    assert encoded(integer) == "fd17000000f5bf1700000f0000000101454b46325f45565f4354524c0000000006b37a"
    wire = ArduPilot().value_to(0.5, mavlink.MAV_PARAM_TYPE_REAL32)
    real = mavlink.MAVLink_param_set_message(1, 1, b"GUID_TIMEOUT", wire, mavlink.MAV_PARAM_TYPE_REAL32)
    assert encoded(real) == "fd17000000f5bf1700000000003f0101475549445f54494d454f555400000000094351"


def test_clock_and_origin() -> None:
    clock = mavlink.MAVLink_timesync_message(123_456_789_012_345, 42)
    assert encoded(clock) == "fd09000000f5bf6f000079df0d86487000002ad7a2"
    origin = mavlink.MAVLink_set_gps_global_origin_message(1, 473977420, 85455940, 488000)
    assert encoded(origin) == "fd0d000000f5bf3000004c52401c44f41705407207000124ea"


def test_signature() -> None:
    class Fixed:
        first = 0

        def at(self, _now_ns: int) -> int:
            return 0x0123456789AB

    codec = Codec(245, 191, Key(bytes(range(32))), Fixed())  # type: ignore[arg-type]
    message = mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3)
    assert codec.encode(message, 0).hex() == ("fd09010000f5bf0000000000000012080004030a5d00ab89674523013c16b85a159a")


class TestHeard:
    def test_heartbeat(self) -> None:
        picture = heard("fd09000007010100000000000600020c9d04030477")
        assert (picture.custom_mode, picture.armed, picture.kind) == (6 << 16, True, 12)
        assert Px4().mode_name(6 << 16) == "OFFBOARD"

    def test_attitude(self) -> None:
        """Nose north, right side down."""
        picture = heard("fd0c00000001011f0000881300009e067f3fb67eb23d4d1d")
        assert picture.q_WB is not None
        assert picture.boot_ms == 5000
        assert yaw_of(picture.q_WB) == pytest.approx(math.pi / 2.0)
        assert picture.q_WB == pytest.approx(multiply(NORTH, RIGHT_DOWN), abs=1e-6)
        assert frames_wire.attitude(picture.q_WB, "enu")[1] > 0.0

    def test_position(self) -> None:
        assert heard("fd10000000010120000088130000000000400000803f000040c0ea5f").p_WB == (1.0, 2.0, 3.0)

    def test_status(self) -> None:
        picture = heard("fd1f00000001010100000000001000000010000000000000b42dffff000000000000000000000000508e2f")
        assert picture.battery_V == pytest.approx(11.7)
        assert picture.prearm_ok is False

    def test_ardupilots_estimator(self) -> None:
        picture = heard("fd160000000101c1000000000000000000000000000000000000000000003f031e87")
        assert picture.estimator_flags == 0x33F
        assert ArduPilot().estimate_objection(picture.estimator_flags) == ""

    def test_integers_as_either_flavour_sends_them(self) -> None:
        codec = Codec(245, 191)
        (px4,) = codec.decode(
            bytearray.fromhex("fd1900000001011600000f00000001000000454b46325f45565f4354524c000000000669ed")
        )
        (ardupilot,) = codec.decode(
            bytearray.fromhex("fd1900000001011600000000004101000000475549445f4f5054494f4e530000000006f9d3")
        )
        assert Px4().value_from(px4.param_value, px4.param_type) == 15.0
        assert ArduPilot().value_from(ardupilot.param_value, ardupilot.param_type) == 8.0

    def test_acknowledgement(self) -> None:
        (message,) = Codec(245, 191).decode(bytearray.fromhex("fd0a00000001014d00009001010000000000f5bf3574"))
        assert (message.command, message.result) == (400, 1)
        assert (message.target_system, message.target_component) == (245, 191)
