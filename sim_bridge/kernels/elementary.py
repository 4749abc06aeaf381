"""Sine, cosine, arc tangent and logarithm as polynomials.

A call into the C library keeps a loop over vehicles from being vectorised; these are plain arithmetic. Errors are below
1e-12 (cosine, sine, arc tangent) and 1e-9 (logarithm, which only noise needs); a test holds them to it.
"""

from __future__ import annotations

import math

import numpy as np

_TWO_OVER_PI = 2.0 / math.pi
_HALF_PI_HIGH = 1.5707963267341256
"""Its last bits are zero, so that small multiples of it are exact; the rest of pi / 2 is `_HALF_PI_LOW`."""
_HALF_PI_LOW = 6.077100506506192e-11
_TAN_PI_8 = math.tan(math.pi / 8.0)
_LN_2 = math.log(2.0)
_EXPONENT_BITS = np.int64(52)
_MANTISSA = np.int64(0x000FFFFFFFFFFFFF)
_SQRT_HALF = np.int64(0x3FE6A09E667F3BCD)
"""The bits of the square root of 1/2, where the mantissas' range begins."""


def cos_sin(angle_rad: float) -> tuple[float, float]:
    """Cosine and sine of an angle within +-1e5 rad."""
    quarter = np.floor(angle_rad * _TWO_OVER_PI + 0.5)
    x = (angle_rad - quarter * _HALF_PI_HIGH) - quarter * _HALF_PI_LOW
    z = x * x
    sine = -1.0 / 39916800 + z / 6227020800
    sine = x + x * z * (-1.0 / 6 + z * (1.0 / 120 + z * (-1.0 / 5040 + z * (1.0 / 362880 + z * sine))))
    cosine = -1.0 / 3628800 + z / 479001600
    cosine = 1.0 + z * (-0.5 + z * (1.0 / 24 + z * (-1.0 / 720 + z * (1.0 / 40320 + z * cosine))))
    half = np.floor(0.5 * quarter)
    odd = quarter - 2.0 * half
    sign = 1.0 - 2.0 * (half - 2.0 * np.floor(0.5 * half))
    return sign * (cosine - odd * (cosine + sine)), sign * (sine + odd * (cosine - sine))


def arctan2(y: float, x: float) -> float:
    """The angle of the point (x, y) in rad, in [-pi, pi]; 0 for the origin."""
    ax, ay = abs(x), abs(y)
    steep = ay > ax
    low, high = (ax if steep else ay), (ay if steep else ax)
    large = low > _TAN_PI_8 * high
    over, under = (low - high if large else low), (low + high if large else high)
    t = over / (under if under > 0.0 else 1.0)
    angle = t * _arctan_over(t * t) + (0.25 * math.pi if large else 0.0)
    angle = 0.5 * math.pi - angle if steep else angle
    angle = math.pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle


def _arctan_over(z: float) -> float:
    """arctan(t) / t for z = t^2, |t| <= tan(pi / 8): the minimax polynomial of degree 8, error 3e-14."""
    head = 0.07563703551915192 + z * (-0.05874505621307831 + z * 0.030662440370424447)
    middle = -0.14285690423839287 + z * (0.11110385046148014 + z * (-0.09078392072943424 + z * head))
    return 0.9999999999999732 + z * (-0.33333333330803444 + z * (0.19999999604891977 + z * middle))


def logarithm(x: float) -> float:
    """The natural logarithm of a positive, normal number."""
    above = np.int64(np.float64(x).view(np.int64) - _SQRT_HALF)
    exponent = above >> _EXPONENT_BITS
    mantissa = np.int64((above & _MANTISSA) + _SQRT_HALF).view(np.float64)
    f = (mantissa - 1.0) / (mantissa + 1.0)
    z = f * f
    return np.float64(exponent) * _LN_2 + 2.0 * f * (1.0 + z * (1.0 / 3 + z * (1.0 / 5 + z * (1.0 / 7 + z / 9))))
