"""Mixes: shares as asked for, dealt out so that any beginning of a data set holds about the same mix."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lcd_flight.learning.mix import SOURCES, Mix, Order, parse_mix, shard_rows
from lcd_flight.learning.rollouts import Source
from lcd_flight.model import InputError


def rows_of(order, source):
    return int(order.rows[order.source == source].sum())


def test_the_usual_mix_in_a_shard():
    order = Order.of(Mix())
    shares = {name: rows_of(order, source) / Mix().rows for name, source in SOURCES.items()}
    assert shares == pytest.approx(
        {"search": 0.88, "random": 0.09, "optimum": 0.03, "times": 0.0, "plans": 0.0}, abs=0.001
    )
    assert order.rows.sum() == Mix().rows
    assert len(order.source) == Mix().tasks
    assert 0.99 * Mix().shard_rows < Mix().rows <= Mix().shard_rows
    assert set(order.rows[order.source == Source.SEARCH]) == {320}


@settings(deadline=None, max_examples=60)
@given(st.lists(st.integers(0, 9), min_size=5, max_size=5).filter(sum), st.integers(1, 4000))
def test_any_beginning_holds_the_mix_to_a_task_of_each_source(weights, rows):
    shares = dict(zip(SOURCES, np.array(weights) / sum(weights), strict=True))
    mix = Mix(**shares, population=4, generations=5, jitters=7, shard_rows=4000)
    order = Order.of(mix).until(min(rows, mix.rows))
    assert order.rows.sum() >= min(rows, mix.rows)
    assert order.rows[:-1].sum() < min(rows, mix.rows)
    for name, source in SOURCES.items():
        due = shares[name] * order.rows.sum()
        assert abs(rows_of(order, source) - due) <= 2 * mix.rows_of_a_task(source) + 20


def test_a_shorter_shard_is_the_beginning_of_a_longer_one():
    whole = Order.of(Mix())
    for rows in (1, 400, 5_000):
        part = whole.until(rows)
        assert np.array_equal(part.source, whole.source[: len(part.source)])
    assert np.array_equal(whole.until(Mix().rows).source, whole.source)
    assert whole.until(1).rows.sum() < 10


def test_where_tasks_begin():
    order = Order.of(Mix(search=0.5, random=0.5, optimum=0.0, population=2, generations=3, draws=2, shard_rows=24))
    assert order.first[0] == 0
    assert np.array_equal(np.diff(order.first), order.rows[:-1])
    assert sorted(order.rows.tolist()) == [2] * 6 + [6] * 2


def test_rows_of_the_shards():
    assert shard_rows(100, 40) == [40, 40, 20]
    assert shard_rows(80, 40) == [40, 40]


def test_a_mix_from_text():
    assert parse_mix("search=0.88, random=0.09,optimum=0.03") == Mix()
    assert parse_mix("times=1") == Mix(search=0.0, random=0.0, optimum=0.0, times=1.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("serach=1", r"'serach' is none; write NAME=SHARE, with names from search, random, optimum, times, plans"),
        ("", r"'' is none"),
        ("search=much", r"search=much: the share must be a number"),
        ("search", r"search=: the share must be a number"),
        ("search=0.9", r"add up to 1 are wanted, not search=0.9, random=0"),
        ("search=1.5,random=-0.5", r"shares from 0 to 1"),
        ("search=nan,random=1", r"shares from 0 to 1"),
        ("search=0.001,random=0.999", r"search=0.001 is less than a task in a shard; give 0.00977 or more"),
    ],
)
def test_what_is_no_mix_is_one_clear_line(text, message):
    with pytest.raises(InputError, match=message):
        parse_mix(text)


def test_shards_that_are_too_small_for_a_search():
    with pytest.raises(
        InputError, match=r"search=0\.88 is less than a task in a shard; give shards of at least 320 rows"
    ):
        Mix(shard_rows=20)
