"""The rule of fresh seeds: whoever changes planner, methods, evaluation or models gets other tasks."""

import shutil
from pathlib import Path

import pytest

from lcd_flight.learning import freshness
from lcd_flight.learning.freshness import FIRST_REPORTED_SEED, about_seed, fresh_seed, seed_of
from lcd_flight.model import InputError

HOUSE = Path(freshness.__file__).parents[1]


@pytest.fixture
def house(tmp_path, monkeypatch):
    """A copy of what the seed depends on."""
    copy = tmp_path / "lcd_flight"
    shutil.copytree(HOUSE / "planning", copy / "planning")
    (copy / "learning").mkdir()
    for name in ("methods.py", "evaluate.py", "sampling.py", "train.py"):
        shutil.copy(HOUSE / "learning" / name, copy / "learning" / name)
    monkeypatch.setattr(freshness, "_HOUSE", copy)
    monkeypatch.setattr(freshness, "MODELS", copy / "planning" / "models")
    return copy


def test_it_is_no_development_seed_and_always_the_same():
    assert FIRST_REPORTED_SEED <= fresh_seed() < 1_000_000_000
    assert fresh_seed() == fresh_seed() == seed_of("fresh")


def test_where_the_house_stands_does_not_matter(request):
    here = fresh_seed()
    request.getfixturevalue("house")
    assert fresh_seed() == here


@pytest.mark.parametrize(
    "changed",
    [
        "planning/planner.py",
        "planning/cost/network.py",
        "planning/models/crazyflie-paper.safetensors",
        "learning/methods.py",
        "learning/evaluate.py",
        "learning/sampling.py",
    ],
)
def test_one_byte_anywhere_gives_other_tasks(house, changed):
    before = fresh_seed()
    with (house / changed).open("ab") as file:
        file.write(b"\n")
    assert fresh_seed() != before


def test_a_new_model_or_a_new_name_gives_other_tasks(house):
    seeds = {fresh_seed()}
    models = house / "planning" / "models"
    shutil.copy(models / "crazyflie-paper.safetensors", models / "mine.safetensors")
    seeds.add(fresh_seed())
    (models / "mine.safetensors").rename(models / "yours.safetensors")
    seeds.add(fresh_seed())
    assert len(seeds) == 3


def test_what_decides_no_plan_changes_nothing(house):
    before = fresh_seed()
    (house / "learning" / "train.py").write_text("")
    (house / "planning" / "notes.txt").write_text("x")
    assert fresh_seed() == before


@pytest.mark.parametrize("text", ["-1", "1.5", "new", "", "²"])
def test_what_is_no_seed_is_refused(text):
    with pytest.raises(InputError, match="give a whole number from 0 up, or fresh"):
        seed_of(text)


def test_people_are_told_what_a_seed_is_worth():
    assert about_seed(seed_of("999")) == "seed 999: for development"
    assert about_seed(1000) == "seed 1000: chosen by hand"
    assert "fresh" in about_seed(fresh_seed())
