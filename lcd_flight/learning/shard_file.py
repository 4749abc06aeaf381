"""One shard of a data set as a Parquet file: rows in the columns of `schema.py`, and in its footer what they are of."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from lcd_flight.learning.extras import require_pyarrow
from lcd_flight.learning.fingerprint import Description
from lcd_flight.learning.rollouts import Plans, Rollouts, Source
from lcd_flight.learning.schema import COLUMNS, SCHEMA_VERSION
from lcd_flight.model import InputError, RolloutLabels

_KEY = b"lcd_flight"


@dataclass(frozen=True, slots=True)
class ShardHeader:
    """What a shard says about itself."""

    number: int
    rows: int
    sources: dict[str, int]
    """Rows of each source that occurs."""
    crashed: int
    """Rows that crashed."""
    invalid: int
    """Those of them that left the model's validity."""
    configuration: Description
    flown_by: Description
    """Versions and processor that flew it."""


def encode(rollouts: Rollouts, metadata: Description) -> Any:
    """A shard's bytes: the rows, and `metadata` beside what is told of them and of this program."""
    pyarrow, parquet = require_pyarrow()
    text = json.dumps({"schema_version": SCHEMA_VERSION, **_summary(rollouts), **metadata}, sort_keys=True)
    values = _arrays(rollouts)
    columns = {column.name: _column(values[column.name].astype(column.type)) for column in COLUMNS}
    sink = pyarrow.BufferOutputStream()
    parquet.write_table(
        pyarrow.table(columns).replace_schema_metadata({_KEY: text.encode()}),
        sink,
        compression="none",
        use_dictionary=False,
        write_statistics=False,
        write_page_checksum=True,
    )
    return sink.getvalue()


def read_header(path: Path) -> ShardHeader:
    """What a shard says about itself, without reading its rows.

    Raises:
        InputError: it is damaged, not one of ours, or of another schema version.
    """
    pyarrow, parquet = require_pyarrow()
    try:
        footer = parquet.read_metadata(path)
    except (OSError, pyarrow.ArrowException) as error:
        raise _damaged(path, error) from error
    metadata: dict[str, Any] = json.loads((footer.metadata or {}).get(_KEY, b"{}"))
    if not metadata:
        raise InputError(f"{path}: not a shard of `lcd collect`; move it out of the folder")
    if metadata["schema_version"] != SCHEMA_VERSION:
        theirs, remedy = metadata["schema_version"], "collect the data anew, into another folder"
        raise InputError(f"{path}: schema version {theirs}, this program reads {SCHEMA_VERSION}; {remedy}")
    return ShardHeader(
        number=metadata["shard"],
        rows=footer.num_rows,
        sources=metadata["sources"],
        crashed=metadata["crashed"],
        invalid=metadata["invalid"],
        configuration=metadata["configuration"],
        flown_by=metadata["flown_by"],
    )


def read_rows(path: Path) -> Rollouts:
    """The rows of a shard, checksums verified.

    Raises:
        InputError: it is damaged.
    """
    pyarrow, parquet = require_pyarrow()
    try:
        table = parquet.read_table(path, page_checksum_verification=True, use_threads=False).combine_chunks()
    except (OSError, pyarrow.ArrowException) as error:
        raise _damaged(path, error) from error
    columns = {name: _values(table.column(name)) for name in table.column_names}
    widened = {f.name: _widened(columns[f.name]) for f in fields(RolloutLabels)}
    plans = {f.name: columns[f.name] for f in fields(Plans)} | {"source": columns["source"].astype(np.int64)}
    return Rollouts(Plans(**plans), columns["drag"].astype(np.int64), columns["noise_seed"], RolloutLabels(**widened))


def _summary(rollouts: Rollouts) -> Description:
    """What the manifest tells of a shard."""
    counts = Counter(rollouts.plans.source.tolist())
    return {
        "sources": {Source(value).name.lower(): count for value, count in sorted(counts.items())},
        "crashed": int(rollouts.labels.crashed.sum()),
        "invalid": int((~rollouts.labels.valid).sum()),
    }


def _arrays(rollouts: Rollouts) -> dict[str, Any]:
    """Every column by name."""
    plans = {f.name: getattr(rollouts.plans, f.name) for f in fields(Plans)}
    labels = {f.name: getattr(rollouts.labels, f.name) for f in fields(RolloutLabels)}
    own = {"drag": rollouts.drag, "noise_seed": rollouts.noise_seed, "crashed": rollouts.labels.crashed}
    return {**plans, **own, **labels}


def _column(values: Any) -> Any:
    """(N, D) arrays as lists of fixed size."""
    pyarrow, _ = require_pyarrow()
    flat = pyarrow.array(np.ascontiguousarray(values).reshape(-1))
    return flat if values.ndim == 1 else pyarrow.FixedSizeListArray.from_arrays(flat, values.shape[1])


def _values(column: Any) -> Any:
    """A column as an array, (N,) or (N, D)."""
    pyarrow, _ = require_pyarrow()
    chunk = column.combine_chunks()
    if isinstance(chunk, pyarrow.ChunkedArray):
        chunk = chunk.chunk(0)
    if not pyarrow.types.is_fixed_size_list(chunk.type):
        return chunk.to_numpy(zero_copy_only=False)
    return chunk.flatten().to_numpy(zero_copy_only=False).reshape(len(chunk), chunk.type.list_size)


def _widened(values: Any) -> Any:
    return values.astype(np.float64) if values.dtype == np.float32 else values


def _damaged(path: Path, error: Exception) -> InputError:
    reason = str(error).splitlines()[0]
    return InputError(
        f"{path}: damaged ({reason}); delete it and run the same `lcd collect` again, it makes what is missing"
    )
