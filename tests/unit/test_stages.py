"""Long work in stages: the time that is left follows the pace, and times add up over runs."""

import json
from contextlib import suppress

import pytest

from lcd_flight.learning import stages as stages_module
from lcd_flight.learning.stages import Stage, Stages
from lcd_flight.model import InputError


class Clock:
    """Time that passes when told to."""

    def __init__(self):
        self.now_s = 100.0

    def monotonic(self):
        return self.now_s


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(stages_module, "time", clock)
    return clock


def course(*expected_s):
    return [Stage(f"stage {i}", f"key {i}", seconds) for i, seconds in enumerate(expected_s)]


def test_the_time_that_is_left_follows_the_pace(clock, tmp_path):
    """10 s were expected and 20 taken, so the next 30 will take 60; what was found done tells nothing of the pace."""
    told = []
    stages = Stages(course(10.0, 100.0, 30.0), tmp_path / "book.json", told.append)
    with stages.run(0):
        clock.now_s += 20.0
    with stages.run(1):
        clock.now_s += 0.1
    with stages.run(2) as report:
        assert told[-1].seconds_left == pytest.approx(60.0)
        clock.now_s += 15.0
        report(None)
    assert told[-1].seconds_left == pytest.approx(45.0)
    assert [(p.stage, p.stages, p.name) for p in told] == [(n, 3, f"stage {n - 1}") for n in (1, 2, 3, 3)]


def test_times_add_up_over_interrupted_runs(clock, tmp_path):
    book = tmp_path / "new" / "book.json"
    first = Stages(course(10.0, 10.0), book, lambda progress: None)
    with suppress(KeyboardInterrupt), first.run(0):
        clock.now_s += 7.0
        raise KeyboardInterrupt
    again = Stages(course(10.0, 10.0), book, lambda progress: None)
    with again.run(0):
        clock.now_s += 4.0
    with again.run(1):
        clock.now_s += 2.0
    assert again.seconds == pytest.approx(13.0)
    assert json.loads(book.read_text()) == pytest.approx({"key 0": 11.0, "key 1": 2.0})


def test_the_time_of_other_work_does_not_count(clock, tmp_path):
    book = tmp_path / "book.json"
    with Stages([Stage("a", "of seed 1", 1.0)], book, lambda progress: None).run(0):
        clock.now_s += 5.0
    other = Stages([Stage("a", "of seed 2", 1.0)], book, lambda progress: None)
    assert other.seconds == 0.0


@pytest.mark.parametrize("text", ["{", "[1]", '{"key 0": "long"}'])
def test_a_damaged_book_is_named(tmp_path, text):
    book = tmp_path / "book.json"
    book.write_text(text)
    with pytest.raises(InputError, match=r"book\.json: damaged .*; delete it"):
        Stages(course(1.0), book, lambda progress: None)
