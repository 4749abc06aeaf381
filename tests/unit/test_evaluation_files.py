"""Evaluations on disk: interrupted ones go on to the same bytes, and files hold every flight."""

import json
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from known_simulator import KnownSimulator, tasks_with_errors

from lcd_flight.learning import evaluation_files, methods
from lcd_flight.learning.evaluate import evaluate
from lcd_flight.learning.evaluation import EvaluationOptions
from lcd_flight.learning.evaluation_files import Parts, hash_of_tasks, write_flights
from lcd_flight.learning.evaluation_report import report, write_report
from lcd_flight.learning.extras import require_pyarrow
from lcd_flight.model import InputError
from lcd_flight.worlds import load_world

WORLD = load_world("crazyflie-saturated")
TASKS = tasks_with_errors([0.1, 0.2, 1.6, 1.7, 0.9])
OPTIONS = EvaluationOptions(seed=3, drags=(1, 4), noise_seeds=2)
NAMES = ["minimum-snap", "second"]


@pytest.fixture(autouse=True)
def second(monkeypatch):
    """Another method, so that there is something to be interrupted in."""
    monkeypatch.setitem(methods.METHODS, "second", methods.minimum_snap)


def parts_in(root, options=OPTIONS, simulator=None):
    return Parts.of(root, WORLD, TASKS, options, simulator or KnownSimulator())


def flights(tmp_path, evaluation, name="flights.parquet"):
    write_flights(tmp_path / name, [evaluation])
    return (tmp_path / name).read_bytes()


def test_interrupted_it_goes_on_to_the_same_bytes(tmp_path):
    parts = parts_in(tmp_path / "work")
    with pytest.raises(KeyboardInterrupt):
        evaluate(WORLD, NAMES, TASKS, KnownSimulator(interrupted_in=3), OPTIONS, parts=parts)
    rest, seen = KnownSimulator(), []
    resumed = evaluate(WORLD, NAMES, TASKS, rest, OPTIONS, seen.append, parts)
    assert len(rest.calls) == 2
    assert (seen[0].done, seen[-1].done, seen[-1].total) == (15, 20, 20)
    whole = evaluate(WORLD, NAMES, TASKS, KnownSimulator(), OPTIONS)
    assert flights(tmp_path, resumed) == flights(tmp_path, whole, "whole.parquet")


def test_what_was_finished_keeps_its_time(tmp_path):
    parts = parts_in(tmp_path)
    first = evaluate(WORLD, NAMES, TASKS, KnownSimulator(), OPTIONS, parts=parts)
    again = evaluate(WORLD, NAMES, TASKS, KnownSimulator(), OPTIONS, parts=parts)
    assert report([again]) == report([first])


def test_parts_belong_to_just_one_evaluation(tmp_path, monkeypatch):
    folders = {parts_in(tmp_path).folder, parts_in(tmp_path, EvaluationOptions(seed=4)).folder}
    folders.add(Parts.of(tmp_path, load_world("crazyflie-paper"), TASKS, OPTIONS, KnownSimulator()).folder)
    folders.add(Parts.of(tmp_path, WORLD, tasks_with_errors([0.1]), OPTIONS, KnownSimulator()).folder)
    source = tmp_path / "method.py"
    source.write_text("x = 1")
    monkeypatch.setattr(evaluation_files, "_sources", lambda simulator: [source])
    folders.add(parts_in(tmp_path).folder)
    source.write_text("x = 2")
    folders.add(parts_in(tmp_path).folder)
    assert len(folders) == 6


def test_a_damaged_part_is_named(tmp_path):
    parts = parts_in(tmp_path)
    evaluate(WORLD, ["minimum-snap"], TASKS, KnownSimulator(), OPTIONS, parts=parts)
    victim = next(parts.folder.glob("*.npz"))
    victim.write_bytes(victim.read_bytes()[:100])
    with pytest.raises(InputError, match=rf"{victim.name}: damaged .*; delete it"):
        evaluate(WORLD, ["minimum-snap"], TASKS, KnownSimulator(), OPTIONS, parts=parts)


def test_discarded_parts_leave_nothing(tmp_path):
    parts = parts_in(tmp_path)
    evaluate(WORLD, NAMES, TASKS, KnownSimulator(), OPTIONS, parts=parts)
    assert list(tmp_path.iterdir()) == [parts.folder]
    parts.discard()
    assert not list(tmp_path.iterdir())


def test_every_flight_is_a_row(tmp_path):
    evaluation = evaluate(WORLD, NAMES, TASKS, KnownSimulator(), OPTIONS)
    flights(tmp_path, evaluation)
    _, parquet = require_pyarrow()
    rows = parquet.read_table(tmp_path / "flights.parquet").to_pylist()
    assert len(rows) == 2 * 5 * 2 * 2
    for row in rows:
        assert row["max_error_m"] == pytest.approx(TASKS.waypoints_m[row["task"], 0, 0])
        assert row["crashed"] == (row["max_error_m"] > 1.5)
        assert row["noise_seed"] == evaluation.noise[row["task"], row["noise"]]
        assert row["drag"] in (1, 4)
    assert {(r["method"], r["world"], r["timing"]) for r in rows} == {(n, WORLD.name, "retimed") for n in NAMES}
    mine = [r["crashed"] for r in rows if r["method"] == "second"]
    assert 100.0 * np.mean(mine) == pytest.approx(evaluation.methods["second"].crash_rate)


def test_the_report_of_several_worlds(tmp_path):
    evaluations = [
        evaluate(load_world(name), NAMES, TASKS, KnownSimulator(), OPTIONS) for name in (WORLD.name, "crazyflie-paper")
    ]
    write_report(tmp_path, evaluations, [("second", "minimum-snap")])
    said = json.loads((tmp_path / "evaluation.json").read_text())
    assert set(said["worlds"]) == {WORLD.name, "crazyflie-paper"}
    one = said["worlds"][WORLD.name]
    assert one["methods"]["second"]["crash_rate"] == pytest.approx(40.0)
    assert set(one["by_drag"]) == {"1", "4"}
    (compared,) = one["comparisons"]
    assert (compared["a"], compared["b"], compared["difference"], compared["p_value"]) == (*NAMES[::-1], 0.0, 1.0)
    for kind in ("crash-rates", "errors"):
        words = "".join(ET.parse(tmp_path / f"{kind}-{WORLD.name}.svg").getroot().itertext())  # noqa: S314 - our own
        assert all(name in words for name in NAMES)
    assert "40.0 (24.5) %" in (tmp_path / f"crash-rates-{WORLD.name}.svg").read_text()


def test_the_report_of_one_world_is_its_own_object():
    evaluation = evaluate(WORLD, NAMES, TASKS, KnownSimulator(), OPTIONS)
    assert report([evaluation])["methods"].keys() == set(NAMES)


def test_the_tasks_hash_sees_every_number():
    turned = tasks_with_errors([0.1, 0.2, 1.6, 1.7, 0.9])
    assert hash_of_tasks(turned) == hash_of_tasks(TASKS)
    turned.yaws_rad[4, 3] += 1e-12
    assert hash_of_tasks(turned) != hash_of_tasks(TASKS)


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").touch()
    evaluation = evaluate(WORLD, NAMES, TASKS, KnownSimulator(), OPTIONS)
    with pytest.raises(InputError, match="cannot be written"):
        write_report(tmp_path / "file", [evaluation])
