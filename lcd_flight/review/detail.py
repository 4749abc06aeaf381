"""The traces once more for the script, finer than they are drawn at first: what zooming and playing read.

All traces of a page share one allowance, so that no flight makes a page too large. Short flights are whole; of longer
ones each stretch of time keeps its least and its greatest value, in the order in which they came, so no peak is lost.
"""

from __future__ import annotations

import base64
import math
import struct
import zlib
from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from lcd_flight.model.types import FloatArray
from lcd_flight.review.chart import Trace

MOST_SAMPLES = 440_000
"""On one page. A sample costs 1.5 to 2.5 bytes, so the whole stays well below 2 MB."""

_LEVELS = 65534
"""A trace's values are rounded to so many steps of its range."""
_NOTHING = 65535
"""Stands where there is no value."""


def packed(traces: Sequence[Trace], most_samples: int = MOST_SAMPLES) -> str:
    """The traces as text, in their order; of long flights those that the path is played by come a second time, evenly.

    Base64 of zlib of: the header's length (u32), the header (JSON: sample counts, and range, time base and role of each
    trace), then for each time base its times (f32, s), then for each trace its values as differences of u16, all low
    bytes before all high ones, which packs best. All little-endian.
    """
    played = [trace for trace in traces if trace.role]
    most = max(200, most_samples // max(1, len(traces) + len(played)))
    times: list[bytes] = []
    rows: list[dict[str, float | str]] = []
    columns: list[bytes] = []
    bases: dict[tuple[int, bool], int] = {}
    for trace, even in [*((trace, False) for trace in traces), *((trace, True) for trace in played)]:
        if even and len(trace.values) <= most:
            continue
        time_s, values = evenly(trace.time_s, trace.values, most) if even else samples(trace.time_s, trace.values, most)
        base = bases.setdefault((id(trace.time_s), even), len(times))
        if base == len(times):
            times.append(time_s.astype("<f4").tobytes())
        low, high, levels = _quantised(values)
        rows.append({"base": base, "low": low, "high": high, "role": trace.role})
        columns.append(_differences(levels))
    header = msgspec.json.encode({"counts": [len(part) // 4 for part in times], "traces": rows})
    data = b"".join([struct.pack("<I", len(header)), header, *times, *columns])
    return base64.b64encode(zlib.compress(data, 9)).decode("ascii")


def evenly(time_s: FloatArray, values: FloatArray, most: int) -> tuple[FloatArray, FloatArray]:
    """Times and values at equal steps, both ends among them: coordinates of a path belong to one instant."""
    chosen = np.linspace(0, len(values) - 1, min(most, len(values))).round().astype(np.int64)
    return time_s[chosen], values[chosen]


def samples(time_s: FloatArray, values: FloatArray, most: int) -> tuple[FloatArray, FloatArray]:
    """At most about `most` times and values: all, or the least and the greatest of equal stretches.

    The two of a stretch stand a quarter before and after its middle, so that all traces of a flight share their times.
    """
    count = len(values)
    if count <= most:
        return time_s, values
    width = math.ceil(count / (most // 2))
    bins = math.ceil(count / width)
    padded = np.full(bins * width, np.nan)
    padded[:count] = values
    table = padded.reshape(bins, width)
    unknown = np.isnan(table)
    low = np.where(unknown, np.inf, table).argmin(axis=1)
    high = np.where(unknown, -np.inf, table).argmax(axis=1)
    chosen = np.sort(np.stack([low, high], axis=1), axis=1)
    starts = np.arange(bins) * width
    at = np.clip(np.stack([starts + width * 0.25, starts + width * 0.75], axis=1).ravel(), 0, count - 1)
    return np.interp(at, np.arange(count), time_s), np.take_along_axis(table, chosen, axis=1).ravel()


def _quantised(values: FloatArray) -> tuple[float, float, NDArray[np.uint16]]:
    """Least, greatest, and the values as steps between them."""
    known = np.isfinite(values)
    low, high = (float(values[known].min()), float(values[known].max())) if known.any() else (0.0, 0.0)
    step = (high - low) / _LEVELS or 1.0
    levels = np.full(len(values), _NOTHING, dtype=np.uint16)
    levels[known] = np.rint((values[known] - low) / step).astype(np.uint16)
    return low, high, levels


def _differences(levels: NDArray[np.uint16]) -> bytes:
    """Each level minus the one before, modulo 65536; low bytes, then high bytes."""
    steps = np.diff(levels, prepend=np.uint16(0)).astype("<u2")
    return steps.view(np.uint8).reshape(-1, 2).T.tobytes()
