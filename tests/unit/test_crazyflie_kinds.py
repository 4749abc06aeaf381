from __future__ import annotations

import math

import pytest

from sim_bridge.crazyflie.kinds import F16, F32, I8, I16, U8, U16, U32, Kind


@pytest.mark.parametrize(
    ("kind", "value", "data"),
    [
        (U8, 2, "02"),
        (U16, 38842, "BA97"),
        (U32, 0x51D0F11E, "1EF1D051"),
        (I8, -1, "FF"),
        (I16, -1500.9, "24FA"),
        (F32, 0.01, "0AD7233C"),
        (F16, 1.0, "003C"),
    ],
)
def test_numbers_and_their_bytes(kind: Kind, value: float, data: str) -> None:
    assert kind.pack(value) == bytes.fromhex(data)
    assert kind.unpack(bytes.fromhex(data) + b"more") == pytest.approx(math.trunc(value) if value < -1 else value)


@pytest.mark.parametrize(
    ("kind", "value", "data"),
    [
        (U8, 256.0, "FF"),
        (U8, -1.0, "00"),
        (I8, 1e9, "7F"),
        (I16, -math.inf, "0080"),
        (U16, math.nan, "0000"),
        (F16, 1e9, "007C"),
        (F32, -1e300, "000080FF"),
    ],
)
def test_what_does_not_fit_becomes_the_nearest_that_does(kind: Kind, value: float, data: str) -> None:
    assert kind.pack(value) == bytes.fromhex(data)


def test_too_few_bytes_are_no_number() -> None:
    assert F32.unpack(b"\0\0\0") is None
