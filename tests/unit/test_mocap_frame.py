"""What is refused as a mocap frame, and why."""

from __future__ import annotations

import msgspec
import pytest

from lcd_flight.wire import mocap_frame
from lcd_flight.wire.mocap_frame import MAX_BYTES, MocapFrame, decode, encode, topic

FRAME = MocapFrame(
    body="cf1",
    sequence=7,
    frame_number=1234,
    source_time_ns=10,
    send_time_ns=20,
    clock_id="host",
    position=(1.0, -2.5, 0.5),
    quaternion=(0.0, 0.0, 0.0, 1.0),
)


def changed(**fields: object) -> bytes:
    """The frame's bytes with some keys of the map replaced (or removed: None)."""
    content = {**msgspec.to_builtins(FRAME), **fields}
    kept = {key: value for key, value in content.items() if value is not None}
    return topic("cf1") + msgspec.msgpack.encode(kept)


def test_the_helper_of_these_tests_makes_good_frames() -> None:
    assert decode(changed()) == FRAME


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"position": [1.0, 2.0]}, "length 3"),
        ({"position": ["1", 2.0, 3.0]}, r"float.*position"),
        ({"position": None}, "position"),
        ({"quaternion": [0.0, 0.0, 0.0]}, "length 4"),
        ({"velocity": [0.0]}, "velocity"),
        ({"body_rates": 3.0}, "body_rates"),
        ({"sequence": -1}, "sequence"),
        ({"sequence": 2**63}, "sequence"),
        ({"sequence": 1.5}, "sequence"),
        ({"source_time_ns": 2**63}, "source_time_ns"),
        ({"clock_id": ""}, "clock_id"),
        ({"axes": "nwu"}, "axes"),
        ({"occluded": 1}, "occluded"),
        ({"colour": "red"}, "colour"),
        ({"body": "cf2"}, r"topic b'mocap/cf1' is not that of rigid body 'cf2'"),
        ({"body": "x" * 65}, "body"),
    ],
)
def test_a_wrong_field_is_refused_by_name(fields: dict[str, object], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        decode(changed(**fields))


@pytest.mark.parametrize(
    ("version", "reason"),
    [
        (2, "version 2 is newer than version 1, which is read here: update lcd-flight"),
        (0, "version 0 is older than version 1, which is read here: update the publisher"),
    ],
)
def test_another_version_is_refused_as_such_even_where_its_fields_differ(version: int, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        decode(changed(version=version))
    with pytest.raises(ValueError, match=reason):
        decode(changed(version=version, position=None, pose=[1, 2, 3]))


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\0",
        b"mocap/cf1",
        b"mocap/cf1\0",
        b"mocap/cf1\0\x80",
        b"mocap/cf1\0\xc1",
        encode(FRAME)[:-1],
        encode(FRAME) + b"\0",
        encode(FRAME).replace(b"mocap/", b"mocup/"),
        encode(FRAME).replace(b"cf1", b"\xff\xfe1"),
        b"mocap/cf1\0" + b"\x91" * (MAX_BYTES - 20),
    ],
    ids=["empty", "zero", "topic", "no map", "empty map", "reserved", "cut", "longer", "prefix", "utf-8", "nested"],
)
def test_broken_bytes_are_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match=r"mocap|topic"):
        decode(data)


def test_a_frame_that_is_too_long_is_refused_unread() -> None:
    with pytest.raises(ValueError, match=f"at most {MAX_BYTES}"):
        decode(encode(FRAME) + bytes(MAX_BYTES))


def test_the_longest_frame_fits() -> None:
    longest = msgspec.structs.replace(
        FRAME,
        body="\U0001f681" * 64,
        clock_id="\U0001f681" * 64,
        sequence=2**63 - 1,
        frame_number=2**63 - 1,
        source_time_ns=-(2**63),
        send_time_ns=2**63 - 1,
        velocity=(0.1, 0.2, 0.3),
        body_rates=(0.1, 0.2, 0.3),
    )
    assert decode(encode(longest)) == longest


@pytest.mark.parametrize("body", ["", "a\0b", "x" * 65])
def test_a_name_that_cannot_be_a_topic_is_refused(body: str) -> None:
    with pytest.raises(ValueError, match="1 to 64 characters"):
        topic(body)


def test_one_body_does_not_hear_another_whose_name_begins_alike() -> None:
    assert not topic("cf10").startswith(topic("cf1"))


def test_the_codec_states_its_version() -> None:
    assert FRAME.version == mocap_frame.VERSION
