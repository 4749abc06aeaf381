"""What the script zooms with: unpacked as the script does it, in Python."""

from __future__ import annotations

import base64
import json
import struct
import zlib

import numpy as np
import pytest

from lcd_flight.model.types import FloatArray
from lcd_flight.review.chart import Trace
from lcd_flight.review.detail import packed, samples


def unpacked(text: str) -> list[tuple[FloatArray, FloatArray]]:
    """Times and values of each trace, by the format that `detail.py` states."""
    data = zlib.decompress(base64.b64decode(text))
    (size,) = struct.unpack_from("<I", data)
    header = json.loads(data[4 : 4 + size])
    place = 4 + size
    bases = []
    for count in header["counts"]:
        bases.append(np.frombuffer(data, "<f4", count, place).astype(np.float64))
        place += 4 * count
    found = []
    for row in header["traces"]:
        count = header["counts"][row["base"]]
        low_bytes, high_bytes = (np.frombuffer(data, np.uint8, count, place + n * count) for n in (0, 1))
        place += 2 * count
        levels = np.cumsum(low_bytes.astype(np.int64) + 256 * high_bytes.astype(np.int64)) % 65536
        values = row["low"] + levels * (row["high"] - row["low"]) / 65534
        found.append((bases[row["base"]], np.where(levels == 65535, np.nan, values)))
    assert place == len(data)
    return found


def trace(time_s: FloatArray, values: FloatArray) -> Trace:
    return Trace("x", time_s, values, "flown")


def test_short_flights_are_whole() -> None:
    time_s = np.arange(1000) / 100
    values = np.sin(time_s)
    values[300:310] = np.nan
    ((times, back),) = unpacked(packed([trace(time_s, values)]))
    np.testing.assert_allclose(times, time_s, atol=1e-6)
    np.testing.assert_allclose(back, values, atol=2.0 / 65534)


def test_traces_of_one_flight_share_their_times() -> None:
    time_s, other_s = np.arange(50) / 100, np.arange(70) / 100
    rows = [trace(time_s, time_s), trace(other_s, -other_s), trace(time_s, 2 * time_s)]
    back = unpacked(packed(rows))
    assert [len(values) for _, values in back] == [50, 70, 50]
    assert back[0][0] is not back[1][0]
    assert back[0][0] is back[2][0]
    np.testing.assert_allclose(back[2][1], 2 * time_s, atol=1e-4)


def test_long_flights_share_an_allowance_and_lose_no_peak() -> None:
    rng = np.random.default_rng(3)
    time_s = np.arange(60_000) / 100
    columns = [rng.normal(size=60_000) for _ in range(10)]
    columns[4][12_345] = 99.0
    columns[7][54_321] = -99.0
    back = unpacked(packed([trace(time_s, values) for values in columns], most_samples=40_000))
    assert sum(len(values) for _, values in back) <= 40_000
    for values, (times, kept) in zip(columns, back, strict=True):
        step = (values.max() - values.min()) / 65534
        assert kept.max() == pytest.approx(values.max(), abs=step)
        assert kept.min() == pytest.approx(values.min(), abs=step)
        assert times[int(np.argmax(kept))] == pytest.approx(time_s[int(np.argmax(values))], abs=0.3)


def test_of_a_stretch_the_order_is_kept() -> None:
    values = np.concatenate([np.zeros(40), [-1.0, 1.0], np.zeros(38), [1.0, -1.0], np.zeros(38)])
    _, kept = samples(np.arange(120.0), values, 20)
    assert [value for value in kept.tolist() if value != 0.0] == [-1.0, 1.0, 1.0, -1.0]


def test_stretches_without_values_stay_without() -> None:
    values = np.full(1000, np.nan)
    values[500:] = 1.0
    times, kept = samples(np.arange(1000.0), values, 100)
    assert np.isnan(kept[times < 490]).all()
    assert (kept[times > 510] == 1.0).all()


@pytest.mark.parametrize("values", [[np.nan] * 5, [2.5] * 5, [7.0]])
def test_what_never_changes_survives(values: list[float]) -> None:
    ((_, back),) = unpacked(packed([trace(np.arange(float(len(values))), np.array(values))]))
    np.testing.assert_array_equal(back, values)


def test_the_path_of_a_long_flight_keeps_its_coordinates_together() -> None:
    """Least and greatest values of x and y are of different instants: what is played must not be made of them."""
    time_s = np.arange(20_000) / 100
    rows = [Trace(name, time_s, wave(time_s), "flown", f"0/{name}") for name, wave in (("x", np.cos), ("y", np.sin))]
    back = unpacked(packed(rows, most_samples=8_000))
    assert len(back) == 4
    (times, x), (_, y) = back[2:]
    assert len(times) == 2_000
    np.testing.assert_allclose(np.hypot(x, y), 1.0, atol=1e-4)
    np.testing.assert_allclose(x, np.cos(times), atol=1e-4)


def test_a_short_flight_is_there_once() -> None:
    time_s = np.arange(100) / 100
    assert len(unpacked(packed([Trace("x", time_s, time_s, "flown", "0/x")]))) == 1
