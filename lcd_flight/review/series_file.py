"""The series of a flight for other programs: one row a tick, as CSV or Parquet.

Columns are those of `Series`, in SI units and radians; vectors become a column for each component (`p_WB_x`). What was
not known is an empty cell in CSV, null in Parquet.
"""

from __future__ import annotations

import csv
import dataclasses
import io
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lcd_flight.files import write_whole
from lcd_flight.model import RefusedError
from lcd_flight.record import FlightLog, Series

_COMPONENTS = {
    "pose_counts": ("received", "lost", "late", "rejected"),
    "link_counts": ("sent", "received", "lost"),
}
_AXES = ("x", "y", "z", "w")


def columns(series: Series) -> dict[str, NDArray[Any]]:
    """Name to (T,) column, in the order of `Series`, and the distance from the reference at the end."""
    named: dict[str, NDArray[Any]] = {}
    for field in dataclasses.fields(series):
        values: NDArray[Any] = getattr(series, field.name)
        if values.ndim == 1:
            named[field.name] = values
            continue
        for number, component in enumerate(_components(field.name, values.shape[1])):
            named[f"{field.name}_{component}"] = values[:, number]
    named["error_m"] = series.error_m
    return named


def write_csv(log: FlightLog, path: Path) -> Path:
    """Write the series as CSV with a heading; floats with the fewest digits that read back as the same number.

    Raises:
        InputError: the file cannot be written.
    """
    named = columns(log.series)
    stream = io.StringIO(newline="")
    writer = csv.writer(stream)
    writer.writerow(named)
    writer.writerows(zip(*(_cells(values) for values in named.values()), strict=True))
    write_whole(path, stream.getvalue())
    return path


def write_parquet(log: FlightLog, path: Path) -> Path:
    """Write the series as Parquet, with mission, vehicle and link in the file's metadata.

    Raises:
        InputError: the file cannot be written.
        RefusedError: pyarrow is not installed.
    """
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        raise RefusedError("--parquet takes pyarrow: pip install 'lcd-flight[tables]'; --csv takes nothing") from error
    header = log.header
    table = pyarrow.table(
        {name: pyarrow.array(values, from_pandas=True) for name, values in columns(log.series).items()}
    )
    about = {"mission": header.name, "vehicle": header.vehicle.name, "link": header.link, "log": log.path.name}
    stream = io.BytesIO()
    parquet.write_table(table.replace_schema_metadata(about), stream)
    write_whole(path, stream.getvalue())
    return path


def _components(name: str, width: int) -> tuple[str, ...]:
    if name == "motor_shares":
        return tuple(str(number + 1) for number in range(width))
    return _COMPONENTS.get(name, _AXES[:width])


def _cells(values: NDArray[Any]) -> list[Any]:
    """As the writer takes them: nothing for what was not known, 0 and 1 for flags."""
    cells: list[Any] = values.tolist()
    if values.dtype == np.bool_:
        return [int(value) for value in cells]
    if values.dtype.kind == "f":
        return ["" if math.isnan(value) else repr(value) for value in cells]
    return cells
