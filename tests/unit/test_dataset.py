"""Data sets: written whole, read back the same, and whatever is damaged or foreign is named and refused."""

import json
import re
import sys

import numpy as np
import pyarrow.parquet
import pytest

from lcd_flight import files
from lcd_flight.learning import shard_file
from lcd_flight.learning.dataset import Dataset, open_dataset
from lcd_flight.learning.rollouts import Plans, Rollouts, Source
from lcd_flight.learning.schema import COLUMNS
from lcd_flight.learning.shard_file import read_header
from lcd_flight.model import InputError, RolloutLabels

ARROW = {"int64": "int64", "int8": "int8", "uint64": "uint64", "bool": "bool", "float32": "float"}
CONFIGURATION = {"seed": 3, "world": {"name": "meadow", "speed": 2.0}, "drags": [1, 2]}


def rollouts(rows=20, seed=0):
    r = np.random.default_rng(seed)
    column = lambda *shape: r.random((rows, *shape)).astype(np.float32).astype(np.float64)  # noqa: E731
    segment = column(3)
    segment[0, 2] = np.nan
    labels = RolloutLabels(
        *(column() for _ in range(5)), segment, column(4), *(column() for _ in range(5)), column() > 0.5
    )
    plans = Plans(
        (1 << 40) + np.arange(rows),
        np.arange(rows) % 3 == 0,
        np.where(np.arange(rows) < 5, Source.OPTIMUM, Source.SEARCH),
        column(24).astype(np.float32),
        column(3).astype(np.float32),
    )
    return Rollouts(plans, np.arange(rows) % 5 + 1, np.arange(rows, dtype=np.uint64) + np.uint64(1 << 63), labels)


def assert_equal(a, b):
    for name in Plans.__slots__:
        assert np.array_equal(getattr(a.plans, name), getattr(b.plans, name)), name
    assert np.array_equal(a.drag, b.drag)
    assert np.array_equal(a.noise_seed, b.noise_seed)
    for name in RolloutLabels.__slots__:
        assert np.array_equal(getattr(a.labels, name), getattr(b.labels, name), equal_nan=name != "valid"), name


@pytest.fixture
def folder(tmp_path):
    made = Dataset(tmp_path / "data", CONFIGURATION)
    made.write(0, rollouts(20, seed=0))
    made.write(1, rollouts(7, seed=1))
    return made


def test_what_is_written_is_read_again(folder):
    assert_equal(folder.read(0), rollouts(20, seed=0))
    assert folder.read(0).noise_seed.dtype == np.uint64
    assert [len(shard) for shard in folder.shards()] == [20, 7]
    assert folder.rows(1) == 7
    assert folder.rows(2) == 0


def test_a_folder_is_understood_from_its_files(folder):
    found = open_dataset(folder.folder)
    assert found.configuration == CONFIGURATION
    assert found.hash == folder.hash
    assert found.numbers() == [0, 1]


def test_each_shard_carries_its_configuration_and_the_versions(folder):
    metadata = json.loads(pyarrow.parquet.read_metadata(folder.path(1)).metadata[b"lcd_flight"])
    assert metadata["configuration"] == CONFIGURATION
    assert metadata["hash"] == folder.hash
    assert metadata["shard"] == 1
    assert {"lcd-flight", "numpy", "numba", "python"} <= set(metadata["flown_by"]["versions"])
    assert metadata["flown_by"]["processor"]
    assert "pyarrow" in metadata["written_by"]


def test_a_shard_tells_its_sources_and_crashes(folder):
    header = folder.header(0)
    assert header.sources == {"optimum": 5, "search": 15}
    assert header.crashed == int(rollouts(20, seed=0).labels.crashed.sum())
    assert header.invalid == int((~rollouts(20, seed=0).labels.valid).sum())


def test_columns_are_those_of_the_schema(folder):
    table = pyarrow.parquet.read_table(folder.path(0))
    assert table.column_names == [column.name for column in COLUMNS]
    assert all(str(table.schema.field(c.name).type).startswith(ARROW[c.type]) for c in COLUMNS if not c.shape)
    shapes = {c.name: table.schema.field(c.name).type.list_size for c in COLUMNS if c.shape}
    assert shapes == {"z": 24, "theta": 3, "segment_max_error_m": 3, "waypoint_error_m": 4}
    assert np.array_equal(table["crashed"].to_numpy(), rollouts(20, seed=0).labels.crashed)


def test_the_same_rows_give_the_same_bytes(folder, tmp_path):
    again = Dataset(tmp_path / "again", CONFIGURATION)
    again.write(0, rollouts(20, seed=0))
    assert again.path(0).read_bytes() == folder.path(0).read_bytes()


@pytest.mark.parametrize("keep", [0.0, 0.3, 0.99])
def test_a_shard_cut_short_is_named(folder, keep):
    path = folder.path(1)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(keep * len(whole))])
    with pytest.raises(InputError, match=rf"{re.escape(str(path))}: damaged .*delete it"):
        folder.rows(1)


def test_a_flipped_bit_is_found_when_the_rows_are_read(folder):
    folder.write(0, rollouts(2_000))
    path = folder.path(0)
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 0x10
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"shard-00000\.parquet: damaged \(could not verify page integrity"):
        folder.read(0)


def test_another_configuration_is_refused_with_the_difference(folder):
    other = Dataset(folder.folder, {**CONFIGURATION, "world": {"name": "meadow", "speed": 2.5}})
    with pytest.raises(
        InputError, match=r"shard-00000\.parquet: made by another configuration \(world\.speed: 2\.5, there 2\.0\)"
    ):
        other.rows(0)
    with pytest.raises(InputError, match="another configuration"):
        other.read(1)


def test_a_shard_under_another_number_is_refused(folder):
    folder.path(1).rename(folder.path(4))
    with pytest.raises(InputError, match=r"shard-00004\.parquet: holds shard 1"):
        folder.rows(4)


def test_a_foreign_parquet_file_is_refused(folder):
    pyarrow.parquet.write_table(pyarrow.table({"x": [1, 2]}), folder.path(0))
    with pytest.raises(InputError, match="not a shard of `lcd collect`"):
        read_header(folder.path(0))


def test_a_foreign_name_is_refused(folder):
    (folder.folder / "shard-old.parquet").write_bytes(folder.path(0).read_bytes())
    with pytest.raises(InputError, match=r"shard-old\.parquet: not a shard of `lcd collect`, which has a number"):
        folder.numbers()


def test_an_older_schema_is_refused_with_the_remedy(folder, monkeypatch):
    monkeypatch.setattr(shard_file, "SCHEMA_VERSION", 1)
    folder.write(2, rollouts())
    monkeypatch.undo()
    with pytest.raises(InputError, match=r"schema version 1, this program reads 2; collect .* into another folder"):
        folder.rows(2)


def test_a_folder_without_shards_is_named(tmp_path):
    with pytest.raises(InputError, match="no data set there"):
        open_dataset(tmp_path)


def test_a_failed_write_leaves_the_old_shard_and_nothing_else(folder, monkeypatch):
    before = folder.path(1).read_bytes()

    def full_disk(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files.os, "fsync", full_disk)
    with pytest.raises(InputError, match=r"shard-00001\.parquet: cannot be written .*No space left"):
        folder.write(1, rollouts(20))
    assert folder.path(1).read_bytes() == before
    assert {p.name for p in folder.folder.iterdir()} == {"shard-00000.parquet", "shard-00001.parquet"}


def test_a_place_that_is_a_file_is_named(tmp_path):
    (tmp_path / "data").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        Dataset(tmp_path / "data", CONFIGURATION).write(0, rollouts())


def test_a_missing_extra_is_one_clear_line(monkeypatch, folder):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"this needs pyarrow.*pip install 'lcd-flight\[train\]'"):
        folder.rows(0)
