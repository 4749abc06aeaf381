"""The mocap frame, byte by byte, so that an error made on both sides is seen.

Written out from the msgpack specification: fix map 0x8n, fix string 0xan, float64 0xcb, uint16 0xcd, uint64 0xcf,
fix array 0x9n, nil 0xc0, false 0xc2, true 0xc3.
"""

from __future__ import annotations

import pytest

from lcd_flight.wire.mocap_frame import MocapFrame, decode, encode, topic

ONE = b"\xcb\x3f\xf0\x00\x00\x00\x00\x00\x00"
MINUS_TWO_AND_A_HALF = b"\xcb\xc0\x04\x00\x00\x00\x00\x00\x00"
HALF = b"\xcb\x3f\xe0\x00\x00\x00\x00\x00\x00"
ZERO = b"\xcb\x00\x00\x00\x00\x00\x00\x00\x00"

POSE_ONLY = MocapFrame(
    body="cf1",
    sequence=7,
    frame_number=1234,
    source_time_ns=1_000_000_000_000,
    send_time_ns=1_000_000_000_005,
    clock_id="host",
    position=(1.0, -2.5, 0.5),
    quaternion=(0.0, 0.0, 0.0, 1.0),
)
POSE_ONLY_BYTES = (
    b"mocap/cf1\x00"
    b"\x8d"
    b"\xa7version\x01"
    b"\xa4body\xa3cf1"
    b"\xa8sequence\x07"
    b"\xacframe_number\xcd\x04\xd2"
    b"\xaesource_time_ns\xcf\x00\x00\x00\xe8\xd4\xa5\x10\x00"
    b"\xacsend_time_ns\xcf\x00\x00\x00\xe8\xd4\xa5\x10\x05"
    b"\xa8clock_id\xa4host"
    b"\xa4axes\xa3enu"
    b"\xa8position\x93"
    + ONE
    + MINUS_TWO_AND_A_HALF
    + HALF
    + b"\xaaquaternion\x94"
    + ZERO
    + ZERO
    + ZERO
    + ONE
    + b"\xa8velocity\xc0"
    b"\xaabody_rates\xc0"
    b"\xa8occluded\xc2"
)

WITH_TWIST = MocapFrame(
    body="b",
    sequence=0,
    frame_number=0,
    source_time_ns=-1,
    send_time_ns=0,
    clock_id="c",
    axes="y_up",
    position=(0.0, 0.0, 0.0),
    quaternion=(1.0, 0.0, 0.0, 0.0),
    velocity=(0.5, 0.0, 1.0),
    body_rates=(-2.5, 1.0, 0.0),
    occluded=True,
)
WITH_TWIST_BYTES = (
    b"mocap/b\x00"
    b"\x8d"
    b"\xa7version\x01"
    b"\xa4body\xa1b"
    b"\xa8sequence\x00"
    b"\xacframe_number\x00"
    b"\xaesource_time_ns\xff"
    b"\xacsend_time_ns\x00"
    b"\xa8clock_id\xa1c"
    b"\xa4axes\xa4y_up"
    b"\xa8position\x93"
    + ZERO
    + ZERO
    + ZERO
    + b"\xaaquaternion\x94"
    + ONE
    + ZERO
    + ZERO
    + ZERO
    + b"\xa8velocity\x93"
    + HALF
    + ZERO
    + ONE
    + b"\xaabody_rates\x93"
    + MINUS_TWO_AND_A_HALF
    + ONE
    + ZERO
    + b"\xa8occluded\xc3"
)


@pytest.mark.parametrize(
    ("frame", "data"), [(POSE_ONLY, POSE_ONLY_BYTES), (WITH_TWIST, WITH_TWIST_BYTES)], ids=["pose", "twist"]
)
def test_bytes_of_a_frame(frame: MocapFrame, data: bytes) -> None:
    assert encode(frame) == data
    assert decode(data) == frame


def test_a_publisher_may_leave_out_what_has_a_default_and_write_whole_numbers() -> None:
    data = (
        b"mocap/b\x00"
        b"\x88"
        b"\xa4body\xa1b"
        b"\xa8sequence\x00"
        b"\xacframe_number\x00"
        b"\xaesource_time_ns\x00"
        b"\xacsend_time_ns\x00"
        b"\xa8clock_id\xa1c"
        b"\xa8position\x93\x01\xff\x00"
        b"\xaaquaternion\x94\x00\x00\x00\x01"
    )
    frame = decode(data)
    assert frame.position == (1.0, -1.0, 0.0)
    assert (frame.version, frame.axes, frame.velocity, frame.occluded) == (1, "enu", None, False)


def test_bytes_of_a_topic() -> None:
    assert topic("cf1") == b"mocap/cf1\x00"
    assert topic("é") == b"mocap/\xc3\xa9\x00"
