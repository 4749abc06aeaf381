"""Polynomial CSV of uav_trajectories and of the Crazyflie tools: one segment a row.

Columns: duration in s, then eight coefficients (ascending powers of the segment's own time in s) of x, y, z in m and
of yaw in rad: 33 numbers. Writers differ, and all of this is read: a header or none, `Duration` or `duration`, `#`
before it, spaces for padding, and a comma at the end of a row (github.com/whoenig/uav_trajectories; NumPy's savetxt).
"""

from __future__ import annotations

import math

import numpy as np

from lcd_flight.model import COEFFICIENTS, Trajectory

AXES = ("x", "y", "z", "yaw")
COLUMNS = ("duration", *(f"{axis}^{power}" for axis in AXES for power in range(COEFFICIENTS)))


def encode(trajectory: Trajectory) -> str:
    """The file's text; every number in as many digits as give it back to the bit."""
    rows = [
        [duration_s, *trajectory.coefficients[:, segment].ravel().tolist()]
        for segment, duration_s in enumerate(trajectory.durations_s.tolist())
    ]
    return "\n".join([",".join(COLUMNS), *(",".join(map(repr, row)) for row in rows), ""])


def decode(text: str) -> Trajectory:
    """The trajectory in a file's text, exactly as it stands there: whether it is continuous is not looked at.

    Raises:
        ValueError: no segment, or a row that is not 33 finite numbers with a duration above 0; names the line.
    """
    lines = [(number, line.strip()) for number, line in enumerate(text.splitlines(), start=1)]
    rows = [_row(number, line) for number, line in lines if line and not _is_header(line)]
    if not rows:
        raise ValueError(f"holds no segment; write rows of {len(COLUMNS)} numbers: {', '.join(COLUMNS[:3])} ...")
    table = np.array(rows)
    return Trajectory(table[:, 0], table[:, 1:].reshape(len(rows), len(AXES), COEFFICIENTS).transpose(1, 0, 2).copy())


def _is_header(line: str) -> bool:
    """A comment, or the names of the columns."""
    return line.startswith("#") or line.lower().startswith(COLUMNS[0])


def _row(number: int, line: str) -> list[float]:
    """The 33 numbers of one line."""
    cells = [cell.strip() for cell in line.removesuffix(",").split(",")]
    if len(cells) != len(COLUMNS):
        raise ValueError(f"line {number} has {len(cells)} numbers; a segment has {len(COLUMNS)}")
    values = [_number(number, name, cell) for name, cell in zip(COLUMNS, cells, strict=True)]
    if not values[0] > 0.0:
        raise ValueError(f"line {number}: duration {cells[0]} s; it must be above 0")
    return values


def _number(line: int, column: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"line {line}: {column} is {cell!r}; write a finite number")
    return value
