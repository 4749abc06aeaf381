"""Whatever arrives, decoding gives a frame or a ValueError; what was encoded comes back."""

from __future__ import annotations

import contextlib

import msgspec
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lcd_flight.wire.mocap_frame import MocapFrame, decode, encode, topic

FUZZ = settings(derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])

NAMES = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), min_size=1, max_size=64)
NUMBERS = st.floats(allow_nan=False)
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS)
COUNTS = st.integers(0, 2**63 - 1)
TIMES = st.integers(-(2**63), 2**63 - 1)

FRAMES = st.builds(
    MocapFrame,
    body=NAMES,
    sequence=COUNTS,
    frame_number=COUNTS,
    source_time_ns=TIMES,
    send_time_ns=TIMES,
    clock_id=NAMES,
    axes=st.sampled_from(["enu", "ned", "y_up"]),
    position=VECTORS,
    quaternion=st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS),
    velocity=st.none() | VECTORS,
    body_rates=st.none() | VECTORS,
    occluded=st.booleans(),
)

MSGPACK_VALUES = st.recursive(
    st.none() | st.booleans() | COUNTS | st.floats() | st.text(max_size=8) | st.binary(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=10,
)


def decodes_or_refuses(data: bytes) -> None:
    with contextlib.suppress(ValueError):
        assert isinstance(decode(data), MocapFrame)


@FUZZ
@given(FRAMES)
def test_what_was_encoded_comes_back(frame: MocapFrame) -> None:
    data = encode(frame)
    assert decode(data) == frame
    assert data.startswith(topic(frame.body))


@FUZZ
@given(st.binary(max_size=300))
def test_random_bytes(data: bytes) -> None:
    decodes_or_refuses(data)
    decodes_or_refuses(topic("cf1") + data)


@FUZZ
@given(FRAMES, st.data())
def test_mutated_frames(frame: MocapFrame, data: st.DataObject) -> None:
    mutated = bytearray(encode(frame))
    for _ in range(data.draw(st.integers(1, 4))):
        mutated[data.draw(st.integers(0, len(mutated) - 1))] = data.draw(st.integers(0, 255))
    decodes_or_refuses(bytes(mutated[: data.draw(st.integers(0, len(mutated)))]))
    decodes_or_refuses(bytes(mutated))


@FUZZ
@given(st.dictionaries(st.sampled_from(MocapFrame.__struct_fields__), MSGPACK_VALUES))
def test_well_formed_msgpack_with_the_right_keys_and_wrong_values(content: dict[str, object]) -> None:
    decodes_or_refuses(topic("cf1") + msgspec.msgpack.encode(content))
