"""Whatever word is accepted means the same to PyYAML; whatever is refused says what to write instead."""

from __future__ import annotations

import math
import re

import yaml
from hypothesis import given
from hypothesis import strategies as st

from lcd_flight.mission.scalars import read_word

NUMBERISH = st.text(alphabet="0123456789.eE+-_:xXoObBaAfFnN", min_size=1, max_size=12)
WORDS = st.sampled_from(
    ["yes", "No", "ON", "off", "true", "False", "null", "~", "y", "N", "2026-1-2", ".inf", ".NaN", "="]
)
TEXT = st.text(alphabet=st.characters(codec="ascii", categories=["L", "N"]), min_size=1, max_size=12)


def by_pyyaml(word: str) -> object:
    return yaml.safe_load(f"[{word}]")[0]


@given(NUMBERISH | WORDS | TEXT)
def test_an_accepted_word_means_the_same_to_pyyaml(word: str) -> None:
    try:
        theirs = by_pyyaml(word)
    except (yaml.YAMLError, ValueError):
        return  # no plain scalar by itself, e.g. `-`, or a date that is none
    ours = read_word(word)
    if isinstance(theirs, dict):
        return  # a mapping in short form, e.g. `0:`
    if not ours.trap:
        assert (type(ours.value), ours.value) == (type(theirs), theirs)


@given(NUMBERISH)
def test_the_remedy_of_a_number_is_accepted_and_means_it(word: str) -> None:
    read = read_word(word)
    proposed = re.search(r"; write ([^ ,]+), or ", read.trap)
    if proposed:
        remedy = read_word(proposed[1])
        assert not remedy.trap
        assert remedy.value == read.value


@given(st.floats(allow_nan=False, allow_infinity=False) | st.integers(-(10**15), 10**15))
def test_numbers_that_pyyaml_writes_are_read_back(number: float) -> None:
    written = yaml.safe_dump(number).split("\n")[0]
    read = read_word(written)
    assert not read.trap
    assert isinstance(read.value, int | float)
    assert math.isclose(read.value, number, rel_tol=0.0, abs_tol=0.0)
