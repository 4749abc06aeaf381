"""Loss by sequence numbers: gaps, late packets, second copies, restarts."""

from __future__ import annotations

import random

import pytest

from drivers.mavlink.sequence import LossCounter

MS = 1_000_000


def taken(numbers: list[int], period_ns: int = 5 * MS) -> LossCounter:
    counter = LossCounter()
    for index, number in enumerate(numbers):
        counter.take(number % 256, index * period_ns)
    return counter


def figures(counter: LossCounter) -> tuple[int, int, int, int, int]:
    return counter.received, counter.lost, counter.late, counter.duplicates, counter.restarts


@pytest.mark.parametrize(
    ("numbers", "expected"),
    [
        pytest.param(list(range(700)), (700, 0, 0, 0, 0), id="all of them, three times around"),
        pytest.param([10, 11, 14, 15], (4, 2, 0, 0, 0), id="a gap"),
        pytest.param([254, 255, 1], (3, 1, 0, 0, 0), id="a gap over the wrap"),
        pytest.param([5, 7, 6, 8], (4, 0, 1, 0, 0), id="late is not lost"),
        pytest.param([5, 6, 6, 7], (3, 0, 0, 1, 0), id="a second copy"),
        pytest.param([5, 7, 8, 6, 6, 9], (5, 0, 1, 1, 0), id="a late one twice"),
        pytest.param([40, 41, 42, 0, 1, 2, 3, 4], (6, 0, 0, 2, 1), id="counts from the beginning again"),
        pytest.param([200, 201, 0, 1, 2], (5, 54, 0, 0, 0), id="a jump ahead is loss"),
        pytest.param([200, 30], (2, 85, 0, 0, 0), id="as is one further than half around"),
    ],
)
def test_counts(numbers: list[int], expected: tuple[int, int, int, int, int]) -> None:
    assert figures(taken(numbers)) == expected


def test_after_a_second_of_silence_it_begins_anew() -> None:
    counter = LossCounter()
    counter.take(10, 0)
    counter.take(100, 1_001 * MS)
    counter.take(101, 1_010 * MS)
    assert counter.lost == 0


@pytest.mark.parametrize("rate_hz", [280, 400, 1000])
@pytest.mark.parametrize("missing", [100, 191, 192, 208, 254, 255])
def test_an_outage_is_loss_and_what_follows_it_is_heard(missing: int, rate_hz: int) -> None:
    """Also where so many are lost that the next number looks like one that has been."""
    counter, period_ns = LossCounter(), 1_000 * MS // rate_hz
    for number in range(300):
        counter.take(number % 256, number * period_ns)
    heard = [counter.take(number % 256, number * period_ns) for number in range(300 + missing, 400 + missing)]
    assert all(heard)
    assert figures(counter) == (400, missing, 0, 0, 0)


@pytest.mark.parametrize(("period_ms", "pause_ms"), [(200, 300), (100, 900), (20, 400), (5, 150)])
def test_a_pause_in_which_too_few_could_be_sent_makes_nothing_old_new(period_ms: int, pause_ms: int) -> None:
    """A slow sender, or one that was held up: a late packet is late and a copy a copy, however long it took."""
    counter = LossCounter()
    for index, number in enumerate([*range(98), 99]):
        counter.take(number, index * period_ms * MS)
    now_ns = (98 * period_ms + pause_ms) * MS
    assert counter.take(98, now_ns)
    assert not counter.take(99, now_ns)
    assert figures(counter) == (100, 0, 1, 1, 0)


def test_packets_that_were_held_up_and_come_all_at_once_are_no_loss() -> None:
    counter = LossCounter()
    for number in range(100):
        counter.take(number, number * 5 * MS)
    for number in range(100, 250):
        assert counter.take(number, 1_245 * MS)
    assert counter.lost == 0


def test_second_copies_are_told() -> None:
    counter = LossCounter()
    assert counter.take(1, 0)
    assert counter.take(2, MS)
    assert not counter.take(2, 2 * MS)
    assert not counter.take(2, 3 * MS)


@pytest.mark.parametrize("share", [0.01, 0.1, 0.3])
def test_the_share_of_the_last_second(share: float) -> None:
    luck = random.Random(1)  # noqa: S311 - chance, not secrecy
    counter = LossCounter()
    lost = 0
    for index in range(2000):
        if luck.random() < share:
            lost += 1
        else:
            counter.take(index % 256, index * 5 * MS)
    assert counter.lost == pytest.approx(lost, abs=1)
    assert counter.share(2000 * 5 * MS) == pytest.approx(share, abs=0.07)
    assert counter.share(2000 * 5 * MS + 1_100 * MS) == 0.0


def test_shuffled_neighbours_are_no_loss() -> None:
    numbers = list(range(600))
    for at in range(0, 599, 3):
        numbers[at], numbers[at + 1] = numbers[at + 1], numbers[at]
    assert taken(numbers).lost <= 1  # the very first may come late


def test_memory_is_bounded() -> None:
    counter = taken([n * 7 for n in range(20_000)], period_ns=MS)
    counter.share(20_000 * MS)
    assert len(counter._last_second) <= 1_001


def test_copies_and_late_packets_in_a_first_burst_are_no_loss() -> None:
    """What waited in a buffer comes all at once: the sender's period cannot be told from that."""
    counter = LossCounter()
    for number in (0, 1, 1, 3, 2, 4, 4, 5):
        counter.take(number, 1_000_000)
    assert (counter.lost, counter.duplicates, counter.late) == (0, 2, 1)
