"""Data sets on disk: a folder of Parquet shards, each written whole or not at all.

There is no index beside the shards: each one carries the whole configuration, its hash, its number and the versions
that wrote it, so that a folder is understood from its files. Pages carry checksums. Whatever is damaged or of another
configuration is named and refused, never mixed in.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from lcd_flight.learning.extras import require_pyarrow
from lcd_flight.learning.fingerprint import Description, differences, fingerprint, versions
from lcd_flight.learning.rollouts import Plans, Rollouts
from lcd_flight.model import InputError, RolloutLabels

SCHEMA_VERSION = 1
_KEY = b"lcd_flight"
_INTEGERS = {"task": np.int64, "source": np.int8, "drag": np.int8, "noise_seed": np.uint64}


@dataclass(frozen=True, slots=True)
class ShardHeader:
    """What a shard says about itself."""

    number: int
    rows: int
    configuration: Description


@dataclass(frozen=True, slots=True)
class Dataset:
    """The shards of one configuration in one folder."""

    folder: Path
    configuration: Description

    @property
    def hash(self) -> str:
        """Of the configuration; in every shard and in the card of a model trained on it."""
        return fingerprint(self.configuration)

    def path(self, number: int) -> Path:
        """Where shard `number` belongs."""
        return self.folder / f"shard-{number:05d}.parquet"

    def numbers(self) -> list[int]:
        """The shards that exist, whole."""
        return sorted(int(p.stem.removeprefix("shard-")) for p in self.folder.glob("shard-*.parquet"))

    def rows(self, number: int) -> int:
        """How many rows shard `number` has; 0 where there is none.

        Raises:
            InputError: it is damaged or of another configuration.
        """
        path = self.path(number)
        return self._checked(path, number).rows if path.exists() else 0

    def read(self, number: int) -> Rollouts:
        """The rows of shard `number`, checksums verified.

        Raises:
            InputError: it is damaged or of another configuration.
        """
        self._checked(self.path(number), number)
        return _read_rows(self.path(number))

    def shards(self) -> Iterator[Rollouts]:
        """All rows, shard by shard."""
        return (self.read(number) for number in self.numbers())

    def write(self, number: int, rollouts: Rollouts) -> None:
        """Put shard `number` in its place in one step: readers see all of it or none.

        Raises:
            InputError: the folder cannot be written to, or the disk is full.
        """
        metadata = {
            "schema_version": SCHEMA_VERSION,
            "shard": number,
            "configuration": self.configuration,
            "hash": self.hash,
            "versions": versions("numpy", "numba", "pyarrow"),
        }
        path = self.path(number)
        partial = path.with_suffix(".partial")
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            _write_table(partial, rollouts, {_KEY: json.dumps(metadata, sort_keys=True).encode()})
            partial.replace(path)
            _sync(self.folder)
        except OSError as error:
            with suppress(OSError):
                partial.unlink()
            raise InputError(f"{path}: cannot be written ({error}); give another folder or make room") from error

    def _checked(self, path: Path, number: int) -> ShardHeader:
        header = read_header(path)
        if header.configuration != self.configuration:
            what = "; ".join(differences(self.configuration, header.configuration)[:3])
            raise InputError(f"{path}: made by another configuration ({what}); give another folder")
        if header.number != number:
            raise InputError(f"{path}: holds shard {header.number}; give it back its name or delete it")
        return header


def open_dataset(folder: Path) -> Dataset:
    """The data set in a folder, its configuration taken from the first shard.

    Raises:
        InputError: there is none, or its first shard is damaged.
    """
    shards = sorted(folder.glob("shard-*.parquet"))
    if not shards:
        raise InputError(
            f"{folder}: no data set there (no shard-*.parquet); make one with `lcd collect --out {folder}`"
        )
    return Dataset(folder, read_header(shards[0]).configuration)


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
        theirs = metadata["schema_version"]
        raise InputError(f"{path}: schema version {theirs}, this program reads {SCHEMA_VERSION}; collect the data anew")
    return ShardHeader(metadata["shard"], footer.num_rows, metadata["configuration"])


def _damaged(path: Path, error: Exception) -> InputError:
    reason = str(error).splitlines()[0]
    return InputError(
        f"{path}: damaged ({reason}); delete it and run the same `lcd collect` again, it makes what is missing"
    )


def _write_table(path: Path, rollouts: Rollouts, metadata: dict[bytes, bytes]) -> None:
    pyarrow, parquet = require_pyarrow()
    columns = {name: _column(name, values) for name, values in _arrays(rollouts).items()}
    table = pyarrow.table(columns).replace_schema_metadata(metadata)
    with path.open("wb") as file:
        parquet.write_table(
            table, file, compression="none", use_dictionary=False, write_statistics=False, write_page_checksum=True
        )
        file.flush()
        os.fsync(file.fileno())


def _arrays(rollouts: Rollouts) -> dict[str, Any]:
    """Every column by name."""
    plans = {f.name: getattr(rollouts.plans, f.name) for f in fields(Plans)}
    labels = {f.name: getattr(rollouts.labels, f.name) for f in fields(RolloutLabels)}
    return {**plans, "drag": rollouts.drag, "noise_seed": rollouts.noise_seed, **labels}


def _column(name: str, values: Any) -> Any:
    """Integers and truth values as they are, floats in float32; (N, D) arrays as lists of fixed size."""
    pyarrow, _ = require_pyarrow()
    kind = _INTEGERS.get(name, np.bool_ if values.dtype == np.bool_ else np.float32)
    flat = pyarrow.array(np.ascontiguousarray(values, dtype=kind).reshape(-1))
    return pyarrow.FixedSizeListArray.from_arrays(flat, values.shape[1]) if values.ndim == 2 else flat


def _read_rows(path: Path) -> Rollouts:
    pyarrow, parquet = require_pyarrow()
    try:
        table = parquet.read_table(path, page_checksum_verification=True, use_threads=False).combine_chunks()
    except (OSError, pyarrow.ArrowException) as error:
        raise _damaged(path, error) from error
    columns = {name: _values(table.column(name)) for name in table.column_names}
    widened = {f.name: _widened(columns[f.name]) for f in fields(RolloutLabels)}
    return Rollouts(
        Plans(columns["task"], columns["source"].astype(np.int64), columns["z"], columns["theta"]),
        columns["drag"].astype(np.int64),
        columns["noise_seed"],
        RolloutLabels(**widened),
    )


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


def _sync(folder: Path) -> None:
    """Make the new name last through a power cut."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
