"""Manifest and card: functions of the shards, made again from them, and what finds a shard that was changed."""

import hashlib
import json

import pytest

from lcd_flight.learning.collect import CollectConfig, Mix, collect
from lcd_flight.learning.dataset_card import CARD
from lcd_flight.learning.folder_lock import alone_in
from lcd_flight.learning.manifest import NAME, Manifest, totals
from lcd_flight.learning.schema import COLUMNS, SCHEMA_VERSION
from lcd_flight.model import InputError
from lcd_flight.plugins import simulator
from lcd_flight.worlds import load_world

MIX = Mix(search=0.0, random=0.5, optimum=0.5, shard_rows=24)
CONFIG = CollectConfig(load_world("crazyflie-saturated"), seed=1, mix=MIX)


@pytest.fixture
def dataset(tmp_path):
    return collect(CONFIG, 40, tmp_path / "data", simulator())


def again(dataset):
    return collect(CONFIG, 40, dataset.folder, None)


def test_the_manifest_tells_what_there_is(dataset):
    manifest = json.loads((dataset.folder / NAME).read_bytes())
    assert manifest["schema_version"] == SCHEMA_VERSION
    assert manifest["hash"] == dataset.hash
    assert manifest["rows"] == 40
    assert manifest["sources"] == {"optimum": 20, "random": 20}
    assert manifest["configuration"] == dataset.configuration
    for number, shard in enumerate(manifest["shards"]):
        content = dataset.path(number).read_bytes()
        assert shard["file"] == dataset.path(number).name
        assert shard["size_bytes"] == len(content)
        assert shard["sha256"] == hashlib.sha256(content).hexdigest()
        assert shard["crashed"] == int(dataset.read(number).labels.crashed.sum())
    assert sum(shard["rows"] for shard in manifest["shards"]) == 40


@pytest.mark.parametrize("left", [None, b"", b"[]", b'{"shards": 5}', b'{"shards": []}'])
def test_it_is_made_again_from_the_files(dataset, left):
    paths = [dataset.folder / NAME, dataset.folder / CARD]
    before = [path.read_bytes() for path in paths]
    for path in paths:
        path.unlink() if left is None else path.write_bytes(left)
    again(dataset)
    assert [path.read_bytes() for path in paths] == before


def test_a_shard_that_was_changed_is_found_although_it_can_be_read(dataset):
    path = dataset.path(1)
    changed = path.read_bytes()
    middle = len(changed) // 5
    path.write_bytes(changed[:middle] + bytes([changed[middle] ^ 4]) + changed[middle + 1 :])
    assert dataset.rows(1) == 16
    with pytest.raises(InputError, match=r"shard-00001\.parquet: damaged \(not what manifest\.json says was written\)"):
        again(dataset)
    path.unlink()
    collect(CONFIG, 40, dataset.folder, simulator())
    assert dataset.rows(1) == 16


def test_a_manifest_that_is_behind_a_grown_shard_is_caught_up(dataset):
    """Killed between the shard and the manifest."""
    old = (dataset.folder / NAME).read_bytes()
    collect(CONFIG, 44, dataset.folder, simulator())
    new = (dataset.folder / NAME).read_bytes()
    (dataset.folder / NAME).write_bytes(old)
    collect(CONFIG, 44, dataset.folder, None)
    assert (dataset.folder / NAME).read_bytes() == new


def test_the_card_tells_people(dataset):
    card = (dataset.folder / CARD).read_text()
    assert "40 rollouts in 2 shards" in card
    assert "optimum 20 (50.0%), random 20 (50.0%)" in card
    assert f"Schema version {SCHEMA_VERSION}, configuration {dataset.hash}" in card
    assert "4 waypoints, mean speed 2.37 m/s, seed 1; 50% turn by the short way" in card
    for column in COLUMNS:
        assert f"| {column.name} | {column.type}" in card


def test_totals_of_headers_and_of_the_manifest_agree(dataset):
    headers = [dataset.header(number) for number in dataset.numbers()]
    assert totals(headers) == Manifest(dataset).totals()


def test_one_writer_at_a_time(dataset):
    with alone_in(dataset.folder), pytest.raises(InputError, match="another `lcd collect` is at work there"):
        again(dataset)
    again(dataset)


def test_a_folder_that_cannot_be_written_to_is_found_before_any_work(tmp_path):
    (tmp_path / "data").write_text("")
    with pytest.raises(InputError, match=r"data: cannot be written to \(.*\); give another folder"):
        collect(CONFIG, 40, tmp_path / "data", None)
    with pytest.raises(InputError, match=r"cannot be written to"):
        collect(CONFIG, 40, tmp_path / "data" / "deeper", None)
