"""Standard errors, intervals and paired tests against known answers: published ones, and simulated truth."""

from itertools import product
from math import comb

import numpy as np
import pytest

from lcd_flight.learning.statistics import (
    crash_rate,
    effective_flights,
    paired_difference,
    sign_flip_p_value,
    wilson_interval,
)


@pytest.mark.parametrize(
    ("crashes", "flights", "low", "high"),
    [(81, 263, 25.53, 36.62), (15, 148, 6.24, 16.05), (0, 20, 0.0, 16.11), (1, 29, 0.61, 17.18)],
)
def test_wilson_as_published(crashes, flights, low, high):
    """The examples of Newcombe (Statistics in Medicine 1998), table I, method 3."""
    assert np.allclose(100.0 * np.array(wilson_interval(crashes / flights, flights)), (low, high), atol=0.006)


def test_wilson_at_the_ends_holds_what_was_seen():
    assert wilson_interval(0.0, 7.0)[0] == 0.0
    assert wilson_interval(1.0, 7.0)[1] == 1.0


def test_flights_that_crash_together_count_as_one():
    """Three flights of each task alike: the standard error and the interval are those of the tasks alone."""
    by_task = np.arange(100) < 20
    alike = np.repeat(by_task[:, None], 3, axis=1)
    assert effective_flights(alike) == pytest.approx(100.0)
    assert crash_rate(alike) == crash_rate(by_task[:, None])


def test_flights_that_crash_apart_count_all():
    flights = np.random.default_rng(1).random((4000, 3)) < 0.3
    assert effective_flights(flights) == pytest.approx(12000.0, rel=0.05)


def test_no_crash_at_all_is_no_certainty():
    rate = crash_rate(np.zeros((1000, 3), bool))
    assert (rate.per_cent, rate.standard_error, rate.low) == (0.0, 0.0, 0.0)
    assert rate.high == pytest.approx(100.0 * 3.8415 / 1003.8415, rel=1e-3)


def test_one_task_has_no_standard_error():
    assert crash_rate(np.array([[True, False]])).standard_error is None


@pytest.mark.parametrize("mean", [0.02, 0.1, 0.4])
def test_intervals_hold_the_truth_as_often_as_they_say(mean):
    """Beta-binomial tasks, three flights each: the standard error is that of repetition, 95 % are 95 %."""
    random = np.random.default_rng(2)
    rates = []
    for _ in range(600):
        risk = random.beta(mean * 2.0, (1.0 - mean) * 2.0, size=(300, 1))
        rates.append(crash_rate(random.random((300, 3)) < risk))
    held = np.mean([r.low <= 100.0 * mean <= r.high for r in rates])
    scatter = np.std([r.per_cent for r in rates])
    assert 0.92 <= held <= 0.98
    assert np.mean([r.standard_error for r in rates]) == pytest.approx(scatter, rel=0.1)


@pytest.mark.parametrize("differences", [[1, 1, -1, 3, 0, 2], [-3, -3, 1, 2, 2, -1, -3], [0, 0], [2]])
def test_the_sign_flip_test_is_the_sum_over_all_signs(differences):
    values = np.array(differences)
    sums = [abs(int((np.array(signs) * values).sum())) for signs in product((-1, 1), repeat=len(values))]
    assert sign_flip_p_value(values) == pytest.approx(np.mean(np.array(sums) >= abs(values.sum())))


def test_with_one_flight_it_is_mcnemars_exact_test():
    """9 tasks on which only A crashed, 1 on which only B did: 2 (C(10,0) + C(10,1)) / 2^10."""
    differences = np.array([1] * 9 + [-1] + [0] * 50)
    assert sign_flip_p_value(differences) == pytest.approx(2.0 * (comb(10, 0) + comb(10, 1)) / 2.0**10)


def test_the_paired_difference_by_hand():
    a = np.array([[1, 1], [0, 0], [0, 0], [0, 1]], bool)
    b = np.array([[1, 1], [1, 1], [1, 0], [0, 0]], bool)
    pair = paired_difference(a, b)
    assert pair.difference == pytest.approx(-25.0)
    assert pair.standard_error == pytest.approx(np.std([0, -100, -50, 50], ddof=1) / 2.0)
    assert (pair.tasks_better, pair.tasks_worse) == (2, 1)
    assert pair.low < pair.difference < pair.high


def test_pairing_sees_what_two_rates_alone_do_not():
    """B crashes wherever A does and on 2 % more: far within the error of either rate, beyond doubt when paired."""
    a = np.repeat((np.arange(1000) % 5 == 0)[:, None], 3, axis=1)
    b = a | (np.arange(1000) % 50 == 1)[:, None]
    pair = paired_difference(a, b)
    assert pair.difference == pytest.approx(-2.0)
    assert abs(pair.difference) < 2.0 * crash_rate(a).standard_error
    assert pair.p_value < 1e-5


def test_paired_tests_reject_equal_methods_as_often_as_they_say():
    random = np.random.default_rng(3)
    risks = random.random((2000, 120, 1)) * 0.4
    rejected = [paired_difference(*(random.random((2, 120, 3)) < risk)).p_value < 0.05 for risk in risks[:500]]
    assert np.mean(rejected) <= 0.075


def test_other_tasks_cannot_be_paired():
    with pytest.raises(ValueError, match="cannot be paired"):
        paired_difference(np.zeros((3, 2), bool), np.zeros((4, 2), bool))
