"""Normal random numbers by counter: the same key and counter give the same numbers, wherever and whenever.

splitmix64 (Steele, Lea, Flood 2014): output c of the stream of a key is `mix(key + (c + 1) * GAMMA)`; a key is the
mixed seed, so that streams of neighbouring seeds have nothing in common. Box and Muller make two normal numbers of one
output: its upper half gives the length, 30 bits an angle within a quarter turn, and two bits the signs, which is the
whole turn for half of the work.
"""

from __future__ import annotations

import math

import numpy as np

from sim_bridge.kernels.elementary import logarithm

_GAMMA = np.uint64(0x9E3779B97F4A7C15)
_FACTOR_1 = np.uint64(0xBF58476D1CE4E5B9)
_FACTOR_2 = np.uint64(0x94D049BB133111EB)
_SHIFT_1, _SHIFT_2, _SHIFT_3 = np.uint64(30), np.uint64(27), np.uint64(31)
_HALF = np.uint64(32)
_ONE = np.uint64(1)
_ANGLE = np.uint64(0x3FFFFFFF)
_SIGN = np.uint64(1 << 63)
_TO_SIGN_A, _TO_SIGN_B = np.uint64(32), np.uint64(33)
_TWO_52 = np.uint64(0x4330000000000000)
"""The bits of 2^52: with an integer in its low bits it is 2^52 plus that integer, without a conversion."""
_TO_ANGLE = 0.5 * math.pi * 2.0**-30
_BITS = 32.0 * math.log(2.0)


def mix(z: np.uint64) -> np.uint64:
    """A bijection of 64 bits that scatters neighbours (splitmix64's finaliser)."""
    z = (z ^ (z >> _SHIFT_1)) * _FACTOR_1
    z = (z ^ (z >> _SHIFT_2)) * _FACTOR_2
    return z ^ (z >> _SHIFT_3)


def key_of(seed: np.uint64) -> np.uint64:
    """The key of a seed's stream."""
    return mix(mix(seed + _GAMMA) + _FACTOR_2)


def normal_pair(key: np.uint64, counter: np.uint64) -> tuple[float, float]:
    """Two independent standard normal numbers, |x| < 6.8."""
    word = mix(key + (counter + _ONE) * _GAMMA)
    length = math.sqrt(_BITS - logarithm(_real(word >> _HALF) + 0.5))
    angle = (_real(word & _ANGLE) + 0.5) * _TO_ANGLE - 0.25 * math.pi
    cosine, sine = _cos_sin(angle)
    a, b = length * (cosine - sine), length * (cosine + sine)
    return _signed(a, word << _TO_SIGN_A), _signed(b, word << _TO_SIGN_B)


def _real(integer: np.uint64) -> float:
    """An integer below 2^52."""
    return np.uint64(integer | _TWO_52).view(np.float64) - 4503599627370496.0


def _signed(value: float, bits: np.uint64) -> float:
    """`value`, its sign changed where the first bit is set."""
    return np.uint64(np.float64(value).view(np.uint64) ^ (bits & _SIGN)).view(np.float64)


def _cos_sin(angle_rad: float) -> tuple[float, float]:
    """Cosine and sine within +-pi / 4: Taylor's polynomials, errors below 1e-8."""
    z = angle_rad * angle_rad
    sine = -1.0 / 5040 + z / 362880
    sine = angle_rad + angle_rad * z * (-1.0 / 6 + z * (1.0 / 120 + z * sine))
    cosine = -1.0 / 720 + z / 40320
    return 1.0 + z * (-0.5 + z * (1.0 / 24 + z * cosine)), sine
