"""Work in parts: results in order, few at a time, and an end that lets go of what has not begun."""

import threading
import time

import pytest

from lcd_flight.learning.spread import NoLongerWantedError, cores, in_threads, in_turn, still_wanted


def test_results_come_in_order_whoever_is_first():
    def slower_at_first(part):
        time.sleep(0.02 if part == 0 else 0.0)
        return 10 * part

    expected = [(part, 10 * part) for part in range(7)]
    assert list(in_turn(slower_at_first, range(7))) == expected
    for threads in (0, 1, 3):
        assert list(in_threads(threads)(slower_at_first, range(7))) == expected
    assert list(in_threads(2)(slower_at_first, [])) == []


def test_it_works_side_by_side():
    meeting = threading.Barrier(3, timeout=10.0)
    assert [result for _, result in in_threads(3)(lambda _: meeting.wait() is not None, range(3))] == [True] * 3


def test_few_results_wait_for_the_caller():
    begun = []
    results = in_threads(2)(begun.append, range(100))
    next(results)
    time.sleep(0.05)
    assert len(begun) <= 5
    results.close()


def test_what_has_not_begun_is_let_go_of():
    begun = []

    def work(part):
        begun.append(part)
        if part == 1:
            raise KeyError(part)

    with pytest.raises(KeyError):
        list(in_threads(1)(work, range(100)))
    assert len(begun) <= 4


def test_long_work_ends_soon_once_nobody_waits_for_it():
    ends = []

    def long_work(part):
        for _ in range(10_000):
            try:
                still_wanted()
            except NoLongerWantedError:
                ends.append(part)
                raise
            time.sleep(0.001)

    results = in_threads(2)(lambda part: part if part == 0 else long_work(part), range(9))
    assert next(results) == (0, 0)
    results.close()
    assert set(ends) <= {1, 2, 3}
    assert ends
    still_wanted()


def test_there_is_a_core():
    assert cores() >= 1
