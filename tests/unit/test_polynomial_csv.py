"""Polynomial CSV: written and read to the bit, in the dialects of other programs, and what is wrong is named."""

from __future__ import annotations

import numpy as np
import pytest

from lcd_flight.model import Trajectory
from lcd_flight.wire.polynomial_csv import COLUMNS, decode, encode

HEADER = (
    "duration,x^0,x^1,x^2,x^3,x^4,x^5,x^6,x^7,y^0,y^1,y^2,y^3,y^4,y^5,y^6,y^7,"
    "z^0,z^1,z^2,z^3,z^4,z^5,z^6,z^7,yaw^0,yaw^1,yaw^2,yaw^3,yaw^4,yaw^5,yaw^6,yaw^7"
)
ROWS = (
    "1.050000,0.5,0,0,0,1,2,3,4,-1.5,0,0,0,-0.25,0,0,0,1.0,0,0,0,0,0,0,0.125,0.1,0,0,0,0,0,0,0",
    "2.000000,7.25,0.5,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,-3.5",
)


def test_the_columns_are_those_of_uav_trajectories() -> None:
    assert ",".join(COLUMNS) == HEADER


def test_a_file_as_other_programs_write_it() -> None:
    found = decode("\n".join([HEADER, *ROWS, ""]))
    assert found.durations_s.tolist() == [1.05, 2.0]
    assert found.coefficients.shape == (4, 2, 8)
    x, y, z, yaw = found.coefficients
    assert x[0].tolist() == [0.5, 0, 0, 0, 1, 2, 3, 4]
    assert y[0].tolist() == [-1.5, 0, 0, 0, -0.25, 0, 0, 0]
    assert z[0].tolist() == [1.0, 0, 0, 0, 0, 0, 0, 0.125]
    assert yaw[0].tolist() == [0.1, 0, 0, 0, 0, 0, 0, 0]
    assert x[1].tolist() == [7.25, 0.5, 0, 0, 0, 0, 0, 0]
    assert yaw[1, 7] == -3.5


@pytest.mark.parametrize(
    "text",
    [
        "\n".join(ROWS),
        "\n".join([HEADER + ",", *(row + "," for row in ROWS)]),
        "\r\n".join([HEADER.replace("duration", "Duration"), *ROWS, ""]),
        "\n".join(["# " + HEADER, *(row.replace(",", ",    ") for row in ROWS)]),
        "\n\n".join([HEADER, *ROWS]),
    ],
    ids=["no header", "commas at the end", "capitals and CRLF", "savetxt", "empty lines"],
)
def test_every_dialect_is_the_same_trajectory(text: str) -> None:
    found, plain = decode(text), decode("\n".join([HEADER, *ROWS]))
    assert np.array_equal(found.coefficients, plain.coefficients)
    assert np.array_equal(found.durations_s, plain.durations_s)


def test_what_is_written() -> None:
    trajectory = Trajectory(np.array([0.1]), np.arange(32.0).reshape(4, 1, 8) / 3.0)
    header, row, end = encode(trajectory).split("\n")
    assert header == HEADER
    assert row.split(",")[:4] == ["0.1", "0.0", "0.3333333333333333", "0.6666666666666666"]
    assert float(row.split(",")[-1]) == 31.0 / 3.0
    assert end == ""


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "holds no segment; write rows of 33 numbers"),
        (HEADER, "holds no segment"),
        (f"{HEADER}\n1,2,3", "line 2 has 3 numbers; a segment has 33"),
        (ROWS[0] + ",0,0", "line 1 has 35 numbers"),
        (f"{HEADER}\n{ROWS[0]}\n{ROWS[1].replace('7.25', 'nan')}", r"line 3: x\^0 is 'nan'; write a finite number"),
        (ROWS[1].replace("-3.5", "1e999"), r"line 1: yaw\^7 is '1e999'"),
        (ROWS[1].replace("0.5", "half"), r"line 1: x\^1 is 'half'"),
        (ROWS[0].replace("1.050000", "0"), "line 1: duration 0 s; it must be above 0"),
        (ROWS[0].replace("1.050000", "-1"), "line 1: duration -1 s"),
        ("PK\x03\x04", "line 1 has 1 numbers"),
    ],
)
def test_what_is_wrong_is_named(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        decode(text)
