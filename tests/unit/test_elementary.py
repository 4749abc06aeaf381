"""Polynomials in place of the C library, and the random numbers made with them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lcd_flight.jit import Compiler
from lcd_flight.model import FloatArray, SeedArray
from sim_bridge.compiled import SOURCES
from sim_bridge.kernels.elementary import arctan2, cos_sin, logarithm
from sim_bridge.kernels.noise import key_of, normal_pair


def test_cosine_and_sine() -> None:
    angles = np.concatenate([np.linspace(-20.0, 20.0, 4001), [0.0, 1e4, -1e5], np.arange(-8, 9) * 0.25 * math.pi])
    for angle in map(float, angles):
        assert cos_sin(angle) == pytest.approx((math.cos(angle), math.sin(angle)), abs=1e-12 + 1e-16 * abs(angle))


def test_arc_tangent_of_all_quadrants() -> None:
    for angle in np.linspace(-math.pi, math.pi, 2001):
        for size in (1e-8, 1.0, 1e8):
            y, x = size * math.sin(angle), size * math.cos(angle)
            assert arctan2(y, x) == pytest.approx(math.atan2(y, x), abs=1e-12)
    assert arctan2(0.0, 0.0) == 0.0
    assert arctan2(0.0, -1.0) == pytest.approx(math.pi)
    assert arctan2(1.0, 0.0) == pytest.approx(0.5 * math.pi)
    assert math.isnan(arctan2(math.nan, 1.0))


def test_logarithm() -> None:
    for x in np.concatenate([np.logspace(-12, 12, 2001), [0.5, 1.0, 2.0, math.sqrt(2.0), 2.0**-33]]):
        assert logarithm(float(x)) == pytest.approx(math.log(x), abs=1e-9)


def draw(out: FloatArray, seeds: SeedArray, ticks: int) -> None:
    for row in range(len(seeds)):
        key = key_of(seeds[row])
        for tick in range(ticks):
            out[row, tick, 0], out[row, tick, 1] = normal_pair(key, np.uint64(tick))


def drawn(seeds: list[int], ticks: int) -> FloatArray:
    out = np.empty((len(seeds), ticks, 2))
    Compiler(*SOURCES, error_model="numpy").kernel(draw)(out, np.array(seeds, dtype=np.uint64), ticks)
    return out


def test_noise_is_standard_normal() -> None:
    numbers = drawn(list(range(500)), 1000)
    flat = np.sort(numbers.ravel())
    count = len(flat)
    cumulative = np.array([0.5 * (1.0 + math.erf(x / math.sqrt(2.0))) for x in flat[:: count // 1000]])
    assert np.abs(cumulative - np.arange(len(cumulative)) * (count // 1000) / count).max() < 2.0 / math.sqrt(count)
    assert abs(flat.mean()) < 4.0 / math.sqrt(count)
    assert abs(flat.var() - 1.0) < 6.0 / math.sqrt(count)
    assert abs((flat**3).mean()) < 4.0 * math.sqrt(15.0 / count)
    assert abs((flat**4).mean() - 3.0) < 4.0 * math.sqrt(96.0 / count)
    assert 4.0 < np.abs(flat).max() < 6.8


@pytest.mark.parametrize("bound", [2.0, 3.0, 4.0, 4.5])
def test_the_tails_of_noise_are_as_heavy_as_they_should_be(bound: float) -> None:
    """Two million numbers, both sides counted apart: within four standard errors of a Poisson count."""
    flat = drawn(list(range(1000, 2000)), 1000).ravel()
    expected = len(flat) * 0.5 * math.erfc(bound / math.sqrt(2.0))
    for beyond in ((flat > bound).sum(), (flat < -bound).sum()):
        assert abs(beyond - expected) < 4.0 * math.sqrt(expected)


def test_the_angle_of_a_pair_is_uniform() -> None:
    """Made of a quarter turn and two signs: sixteen sectors, all alike, whatever the length."""
    pairs = drawn(list(range(500)), 1000).reshape(-1, 2)
    sector = np.floor(np.arctan2(pairs[:, 1], pairs[:, 0]) / (math.pi / 8.0)).astype(int) + 8
    far = (pairs**2).sum(axis=1) > 2.0 * math.log(2.0)
    for chosen in (sector[far], sector[~far]):
        expected = len(chosen) / 16.0
        assert ((np.bincount(chosen, minlength=16) - expected) ** 2 / expected).sum() < 45.0


def test_noise_is_not_correlated_among_motors_along_a_stream_or_between_neighbouring_seeds() -> None:
    """The four motors of a tick are outputs 2 t and 2 t + 1; sizes are held to it as well as values."""
    numbers = drawn(list(range(500)), 1000).reshape(500, 500, 4)
    for x in (numbers, (numbers**2 - 1.0) / math.sqrt(2.0)):
        bound = 4.5 / math.sqrt(x[..., 0].size)
        motors = np.einsum("stm,stn->mn", x, x) / x[..., 0].size
        assert np.abs(motors - np.diag(np.diag(motors))).max() < bound
        for earlier, later in ((x[:, :-1], x[:, 1:]), (x[:-1], x[1:]), (x[:-1, :-1], x[1:, 1:])):
            assert np.abs(np.einsum("stm,stn->mn", earlier, later)).max() / earlier[..., 0].size < bound


def by_the_book(seed: int, counter: int) -> tuple[float, float]:
    """The same in Python's integers and the C library's functions."""
    whole, gamma = 2**64 - 1, 0x9E3779B97F4A7C15

    def mix(z: int) -> int:
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & whole
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & whole
        return z ^ (z >> 31)

    key = mix((mix((seed + gamma) & whole) + 0x94D049BB133111EB) & whole)
    word = mix((key + (counter + 1) * gamma) & whole)
    radius = math.sqrt(-2.0 * math.log(((word >> 32) + 0.5) * 2.0**-32))
    angle = 0.5 * math.pi * ((word & (2**30 - 1)) + 0.5) * 2.0**-30
    signs = (-1.0 if word >> 31 & 1 else 1.0), (-1.0 if word >> 30 & 1 else 1.0)
    return signs[0] * radius * math.cos(angle), signs[1] * radius * math.sin(angle)


def test_the_generator_is_splitmix64_with_box_and_muller() -> None:
    """A change of it would silently change every data set and every reported crash rate."""
    seeds = [0, 1, 12345, 2**63, 2**64 - 1]
    numbers = drawn(seeds, 50)
    for row, seed in enumerate(seeds):
        for tick in range(50):
            assert numbers[row, tick] == pytest.approx(by_the_book(seed, tick), abs=1e-7)
