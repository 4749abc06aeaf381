"""Normal random numbers by counter: the same key and counter give the same numbers, wherever and whenever.

splitmix64 (Steele, Lea, Flood 2014): output c of the stream of a key is `mix(key + (c + 1) * GAMMA)`; a key is the
mixed seed, so that streams of neighbouring seeds have nothing in common. Box and Muller make two normal numbers of one
output.
"""

from __future__ import annotations

import math

import numpy as np

from sim_bridge.kernels.elementary import cos_sin, logarithm

_GAMMA = np.uint64(0x9E3779B97F4A7C15)
_FACTOR_1 = np.uint64(0xBF58476D1CE4E5B9)
_FACTOR_2 = np.uint64(0x94D049BB133111EB)
_SHIFT_1, _SHIFT_2, _SHIFT_3 = np.uint64(30), np.uint64(27), np.uint64(31)
_HALF = np.uint64(32)
_LOW = np.uint64(0xFFFFFFFF)
_ONE = np.uint64(1)
_TO_UNIT = 2.0**-32


def mix(z: np.uint64) -> np.uint64:
    """A bijection of 64 bits that scatters neighbours (splitmix64's finaliser)."""
    z = (z ^ (z >> _SHIFT_1)) * _FACTOR_1
    z = (z ^ (z >> _SHIFT_2)) * _FACTOR_2
    return z ^ (z >> _SHIFT_3)


def key_of(seed: np.uint64) -> np.uint64:
    """The key of a seed's stream."""
    return mix(mix(seed + _GAMMA) + _FACTOR_2)


def normal_pair(key: np.uint64, counter: np.uint64) -> tuple[float, float]:
    """Two independent standard normal numbers; 32 bits each for length and angle, so |x| < 6.8."""
    word = mix(key + (counter + _ONE) * _GAMMA)
    uniform = (np.float64(word >> _HALF) + 0.5) * _TO_UNIT
    radius = math.sqrt(-2.0 * logarithm(uniform))
    cosine, sine = cos_sin(np.float64(word & _LOW) * (2.0 * math.pi * _TO_UNIT))
    return radius * cosine, radius * sine
