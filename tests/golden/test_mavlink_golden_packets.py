"""The MAVLink link's packets, byte by byte, from the specification: pymavlink at both ends would hide its own errors.

What goes out and comes in is compared with literal bytes, and those with the specification's arithmetic
(`mavlink_specification`). Quaternions are literal too, and are checked by what they do to the nose.
"""

from __future__ import annotations

import asyncio
import hashlib
import math
import struct
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from mavlink_specification import DEFINITIONS, NUMBERS_AND_EXTRAS, crc, crc_extra, packet, signed

from drivers.mavlink import arming
from drivers.mavlink.arming import Controls
from drivers.mavlink.codec import Codec
from drivers.mavlink.commands import Commands
from drivers.mavlink.frames_wire import attitude_from
from drivers.mavlink.odometry_wire import Odometry, message
from drivers.mavlink.options import Frame
from drivers.mavlink.peer import Peer, Receiver
from drivers.mavlink.picture import Picture
from drivers.mavlink.px4 import Px4
from drivers.mavlink.session import Session
from drivers.mavlink.setpoint_wire import attitude_target
from drivers.mavlink.signing import Key, Timestamps

KEY = hashlib.sha256(b"golden").digest()
OURS, VEHICLE = (245, 191), (1, 1)
PEER: Peer = ("127.0.0.1", 14580)


def test_the_checksum_is_the_published_one() -> None:
    assert crc(b"123456789") == 0x6F91


@pytest.mark.parametrize("name", DEFINITIONS)
def test_definitions_have_the_published_crc_extra(name: str) -> None:
    assert crc_extra(name) == NUMBERS_AND_EXTRAS[name][1]


@dataclass
class Wire:
    """A transport that keeps what is sent."""

    stream: bool = False
    faults: int = 0
    called: str | None = None
    sent: list[bytes] = field(default_factory=list)
    receive: Receiver | None = None

    async def open(self, receive: Receiver) -> None:
        self.receive = receive

    def send(self, data: bytes, _peer: Peer | None, /) -> bool:
        self.sent.append(data)
        return True

    def send_now(self, data: bytes, peer: Peer | None, /) -> bool:
        return self.send(data, peer)

    def close(self) -> None:
        self.receive = None


class Still:
    """A clock that stands."""

    NOW_NS = 1_000_000

    def now_ns(self) -> int:
        return self.NOW_NS

    async def sleep_until(self, deadline_ns: int) -> None:
        raise AssertionError(f"nothing waits here until {deadline_ns}")


def session(wire: Wire) -> Session:
    return Session(wire, Codec(*OURS), Still(), VEHICLE)


C10, S10 = math.cos(math.radians(10.0)), math.sin(math.radians(10.0))
NOSE_DOWN = (0.0, 0.08715574274765817, 0.0, 0.9961946980917455)
"""Ours (x, y, z, w), body FLU: ten degrees about y, which points left, lowers the nose; it points to +x."""
DOWN_EAST = (0.704416026402759, 0.061628416716219, -0.061628416716219, 0.704416026402759)
"""w, x, y, z, FRD in NED: yaw 90 deg, since +x is east, then pitch -10 deg."""
DOWN_AHEAD = (0.9961946980917455, 0.0, -0.08715574274765817, -0.0)
"""In the frame whose x is ours: pitch -10 deg."""


def turned(q: tuple[float, ...], v: tuple[float, float, float]) -> tuple[float, float, float]:
    """The body's vector in the frame, by the rotation matrix of (w, x, y, z)."""
    w, x, y, z = q
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    a, b, c = (sum(m * part for m, part in zip(row, v, strict=True)) for row in rows)
    return a, b, c


def test_the_literal_attitudes_mean_what_they_say() -> None:
    """The nose points east and down, the thrust (up) leans the way that it is to fly."""
    assert turned(DOWN_EAST, (1.0, 0.0, 0.0)) == pytest.approx((0.0, C10, S10), abs=1e-7)
    assert turned(DOWN_EAST, (0.0, 0.0, -1.0)) == pytest.approx((0.0, S10, -C10), abs=1e-7)
    assert turned(DOWN_EAST, (0.0, 1.0, 0.0)) == pytest.approx((-1.0, 0.0, 0.0), abs=1e-7)  # right of east: south
    assert turned(DOWN_AHEAD, (1.0, 0.0, 0.0)) == pytest.approx((C10, 0.0, S10), abs=1e-7)
    assert turned(DOWN_AHEAD, (0.0, 0.0, -1.0)) == pytest.approx((S10, 0.0, -C10), abs=1e-7)
    assert turned(DOWN_AHEAD, (0.0, 1.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0), abs=1e-7)


NOW_MS = 0x01020304
SETPOINT = {"time_boot_ms": NOW_MS, "target_system": 1, "target_component": 1, "type_mask": 7, "thrust": 0.5}
SETPOINTS: dict[Frame, tuple[tuple[float, ...], str]] = {
    "enu": (
        DOWN_EAST,
        "fd 27 00 00 00 f5 bf 52 00 00"  # 39 bytes of payload: thrust_body, three zeros, is left out
        "04 03 02 01"
        "9c 54 34 3f  14 6e 7c 3d  14 6e 7c bd  9c 54 34 3f"
        "00 00 00 00  00 00 00 00  00 00 00 00"  # rates, which type_mask ignores
        "00 00 00 3f"
        "01 01 07"
        "6c ac",
    ),
    "flu": (
        DOWN_AHEAD,
        "fd 27 00 00 00 f5 bf 52 00 00"
        "04 03 02 01"
        "9e 06 7f 3f  00 00 00 00  b6 7e b2 bd  00 00 00 80"  # minus zero is zero
        "00 00 00 00  00 00 00 00  00 00 00 00"
        "00 00 00 3f"
        "01 01 07"
        "70 1b",
    ),
}


@pytest.mark.parametrize("frame", ["enu", "flu"])
def test_set_attitude_target(frame: Frame) -> None:
    q, literal = SETPOINTS[frame]
    data = bytes.fromhex(literal)
    assert packet("SET_ATTITUDE_TARGET", {**SETPOINT, "q": q}, 0, OURS) == data
    target = attitude_target(NOSE_DOWN, 0.5, now_ns=NOW_MS * 1_000_000 + 999_999, target=VEHICLE, frame=frame)
    assert Codec(*OURS).encode(target, 0) == data


POSITIONS: dict[Frame, tuple[float, float, float]] = {"enu": (-0.5, 1.5, -0.75), "flu": (1.5, 0.5, -0.75)}
"""(1.5, -0.5, 0.75) of ours: south and east and up; ahead, right and up."""
_VARIANCES = "17 b7 d1 37", "17 b7 d1 39", "0a d7 23 3b", "0a d7 23 3d"
"""0.005^2, 0.02^2, 0.05^2 and 0.2^2: m, rad, m/s, rad/s."""
_GAP = "00 00 00 00" * 5, "00 00 00 00" * 4, "00 00 00 00" * 3, "00 00 00 00" * 2, "00 00 00 00", ""
ODOMETRIES: dict[Frame, tuple[str, str]] = {
    "enu": ("00 00 00 bf  00 00 c0 3f  00 00 40 bf  9c 54 34 3f  14 6e 7c 3d  14 6e 7c bd  9c 54 34 3f", "e2 04"),
    "flu": ("00 00 c0 3f  00 00 00 3f  00 00 40 bf  9e 06 7f 3f  00 00 00 00  b6 7e b2 bd  00 00 00 80", "e4 ef"),
}
"""Position and attitude, and the checksum."""


def diagonal(first: float, second: float) -> tuple[float, ...]:
    """The upper triangle, row by row, of a matrix of 6 x 6 with these on its diagonal."""
    rows = [[first if row < 3 else second] + [0.0] * (5 - row) for row in range(6)]
    return tuple(value for row in rows for value in row)


@pytest.mark.parametrize("frame", ["enu", "flu"])
def test_odometry(frame: Frame) -> None:
    """It moves with 2 m/s along +x, nose down: 2 cos 10 deg forward, and 2 sin 10 deg up along its own axis."""
    place, checksum = ODOMETRIES[frame]
    first, second, third, fourth = _VARIANCES
    data = bytes.fromhex(
        "fd e9 00 00 00 f5 bf 4b 01 00"  # message 0x14b, 233 bytes
        "05 04 03 02 01 00 00 00" + place + "5c 1c fc 3f  00 00 00 80  d4 d0 b1 be"
        "00 00 80 3e  00 00 00 bf  00 00 80 3f"
        + "".join(value + gap for value, gap in zip([first] * 3 + [second] * 3, _GAP, strict=True))
        + "".join(value + gap for value, gap in zip([third] * 3 + [fourth] * 3, _GAP, strict=True))
        + "14 0c"  # LOCAL_FRD, BODY_FRD
        "03 02 64"  # resets, VISION, quality
         + checksum
    )
    x, y, z = POSITIONS[frame]
    vx, vy, vz = 2.0 * C10, -0.0, -2.0 * S10
    told = packet(
        "ODOMETRY",
        {
            "time_usec": 0x0102030405, "frame_id": 20, "child_frame_id": 12, "x": x, "y": y, "z": z,
            "q": SETPOINTS[frame][0], "vx": vx, "vy": vy, "vz": vz,
            "rollspeed": 0.25, "pitchspeed": -0.5, "yawspeed": 1.0,
            "pose_covariance": diagonal(0.005**2, 0.02**2), "velocity_covariance": diagonal(0.05**2, 0.2**2),
            "reset_counter": 3, "estimator_type": 2, "quality": 100,
        },
        0,
        OURS,
    )  # fmt: skip
    assert told == data
    seen = Odometry(0x0102030405 * 1000 + 999, (1.5, -0.5, 0.75), NOSE_DOWN, (2.0, 0.0, 0.0), (0.25, 0.5, -1.0), 3)
    assert Codec(*OURS).encode(message(seen, frame), 0) == data


HEARTBEAT = {"type": 18, "autopilot": 8, "system_status": 4, "mavlink_version": 3}
"""ONBOARD_CONTROLLER, INVALID, ACTIVE."""
PX4_HEARTBEAT = bytes.fromhex("fd 09 00 00 00 01 01 00 00 00  00 00 06 00  02 0c 81 04 03  d2 91")
"""Armed, in OFFBOARD: custom_mode 6 << 16."""


def test_our_heartbeat_is_an_onboard_computers() -> None:
    wire = Wire()
    session(wire).beat(0)
    data = bytes.fromhex("fd 09 00 00 00 f5 bf 00 00 00  00 00 00 00  12 08 00 04 03  ed a5")
    assert packet("HEARTBEAT", HEARTBEAT, 0, OURS) == data
    assert wire.sent == [data]


def test_the_emergency_stop_is_a_forced_disarm() -> None:
    """Its confirmation, the last byte, is 0 and left out."""
    wire = Wire()
    commands = Commands(session(wire), Still(), OURS)
    arming.cut(Controls(Px4(), commands, Picture("enu"), Still()))
    data = bytes.fromhex(
        "fd 20 00 00 00 f5 bf 4c 00 00"
        "00 00 00 00  00 98 a5 46  00 00 00 00  00 00 00 00  00 00 00 00  00 00 00 00  00 00 00 00"
        "90 01  01 01"
        "77 73"
    )
    told = {"target_system": 1, "target_component": 1, "command": 400, "param2": 21196.0}
    assert packet("COMMAND_LONG", told, 0, OURS) == data
    assert wire.sent == [data]


def test_a_question_for_the_time_is_answered_with_our_clock() -> None:
    wire = Wire()
    asyncio.run(session(wire).open())
    assert wire.receive is not None
    wire.receive(PX4_HEARTBEAT, PEER)
    wire.receive(bytes.fromhex("fd 0a 00 00 01 01 01 6f 00 00  00 00 00 00 00 00 00 00  34 12  fb 8f"), PEER)
    data = bytes.fromhex("fd 0a 00 00 00 f5 bf 6f 00 00  40 42 0f 00 00 00 00 00  34 12  c7 84")
    assert packet("TIMESYNC", {"tc1": Still.NOW_NS, "ts1": 0x1234}, 0, OURS) == data
    assert wire.sent == [data]


def test_what_a_px4_says_of_itself() -> None:
    told = {"type": 2, "autopilot": 12, "base_mode": 0x81, "custom_mode": 6 << 16, "system_status": 4}
    assert packet("HEARTBEAT", {**told, "mavlink_version": 3}, 0, VEHICLE) == PX4_HEARTBEAT
    w, x, y, z = DOWN_EAST
    turned_to = packet("ATTITUDE_QUATERNION", {"time_boot_ms": 1000, "q1": w, "q2": x, "q3": y, "q4": z}, 1, VEHICLE)
    assert turned_to == bytes.fromhex(
        "fd 14 00 00 01 01 01 1f 00 00  e8 03 00 00  9c 54 34 3f  14 6e 7c 3d  14 6e 7c bd  9c 54 34 3f  64 c9"
    )
    place = packet("LOCAL_POSITION_NED", {"time_boot_ms": 1000, "x": -0.5, "y": 1.5, "z": -0.75}, 2, VEHICLE)
    assert place == bytes.fromhex(
        "fd 10 00 00 02 01 01 20 00 00  e8 03 00 00  00 00 00 bf  00 00 c0 3f  00 00 40 bf  1b 43"
    )
    picture = Picture("enu")
    for one in Codec(*OURS).decode(bytearray(PX4_HEARTBEAT + turned_to + place)):
        picture.take(one, 0)
    assert (picture.armed, picture.custom_mode, picture.kind) == (True, 393216, 12)
    assert picture.q_WB == pytest.approx(NOSE_DOWN, abs=1e-7)
    assert picture.p_WB == pytest.approx((1.5, -0.5, 0.75))
    assert attitude_from((DOWN_AHEAD[0], DOWN_AHEAD[1], DOWN_AHEAD[2], DOWN_AHEAD[3]), "flu") == pytest.approx(
        NOSE_DOWN
    )


def test_px4_puts_the_bytes_of_a_whole_number_where_a_float_stands() -> None:
    data = bytes.fromhex(
        "fd 19 00 00 03 01 01 16 00 00"
        "04 00 00 00  bc 02  64 00"
        "43 4f 4d 5f 4f 42 4c 5f 52 43 5f 41 43 54 00 00"  # COM_OBL_RC_ACT
        "06"  # INT32
        "2e 9b"
    )
    (four,) = struct.unpack("<f", b"\x04\0\0\0")
    told = {"param_id": b"COM_OBL_RC_ACT", "param_value": four, "param_type": 6}
    assert packet("PARAM_VALUE", {**told, "param_count": 700, "param_index": 100}, 3, VEHICLE) == data
    (value,) = Codec(*OURS).decode(bytearray(data))
    assert (value.param_id, Px4().value_from(value.param_value, value.param_type)) == ("COM_OBL_RC_ACT", 4.0)


STAMP = 0x0A0B0C0D0E0F
"""Tens of microseconds since 2015: it is 2018."""
OUR_SIGNED_HEARTBEAT = bytes.fromhex(
    "fd 09 01 00 00 f5 bf 00 00 00  00 00 00 00  12 08 00 04 03  0a 5d  00  0f 0e 0d 0c 0b 0a  ac be 4a e1 fe 57"
)
PX4_SIGNED_HEARTBEAT = bytes.fromhex(
    "fd 09 01 00 09 01 01 00 00 00  00 00 06 00  02 0c 81 04 03  e1 b7  02  0f 0e 0d 0c 0b 0a  22 e2 53 6b 73 ee"
)


@pytest.fixture
def codec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Codec:
    monkeypatch.setattr("drivers.mavlink.signing._real_time", lambda: STAMP)
    return Codec(*OURS, Key(KEY), Timestamps(Key(KEY), tmp_path))


def test_a_signed_packet(codec: Codec) -> None:
    assert signed(packet("HEARTBEAT", HEARTBEAT, 0, OURS, flags=1), KEY, 0, STAMP) == OUR_SIGNED_HEARTBEAT
    wire = Wire()
    Session(wire, codec, Still(), VEHICLE).beat(0)
    assert wire.sent == [OUR_SIGNED_HEARTBEAT]


def test_a_signed_packet_is_believed_once_and_only_whole(codec: Codec) -> None:
    told = {"type": 2, "autopilot": 12, "base_mode": 0x81, "custom_mode": 6 << 16, "system_status": 4}
    unsigned = packet("HEARTBEAT", {**told, "mavlink_version": 3}, 9, VEHICLE, flags=1)
    assert signed(unsigned, KEY, 2, STAMP) == PX4_SIGNED_HEARTBEAT
    forged = bytearray(PX4_SIGNED_HEARTBEAT)
    forged[-1] ^= 1
    later = bytearray(PX4_SIGNED_HEARTBEAT)
    later[-8] = 0xFF  # the most significant byte of the time stamp: years ahead, with the old signature
    assert codec.decode(forged) == []
    assert codec.decode(later) == []
    assert codec.decode(bytearray(PX4_HEARTBEAT)) == []
    (heartbeat,) = codec.decode(bytearray(PX4_SIGNED_HEARTBEAT))
    assert heartbeat.custom_mode == 6 << 16
    assert codec.decode(bytearray(PX4_SIGNED_HEARTBEAT)) == []
