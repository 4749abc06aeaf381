"""The covariance of (value, rate, acceleration) driven by random jerk, as six floats.

One such chain serves all three axes of a vector, whose noises are alike and independent: the covariance is then the
same for each axis, so it is carried once (Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and
Navigation, 2001, section 6.3: the discrete Wiener-process acceleration model, here with jerk constant over a step).
"""

from __future__ import annotations

from typing import TypeAlias

from lcd_flight.model import Vector3

Covariance: TypeAlias = tuple[float, float, float, float, float, float]
"""Upper triangle: value-value, value-rate, value-acceleration, rate-rate, rate-acceleration, acceleration^2."""

VALUE = 0
"""Index of the component that a measurement is of."""
RATE = 1


def initial(value_sigma: float, rate_sigma: float, acceleration_sigma: float) -> Covariance:
    """Independent components."""
    return (value_sigma**2, 0.0, 0.0, rate_sigma**2, 0.0, acceleration_sigma**2)


def grown(covariance: Covariance, dt_s: float, jerk_sigma: float) -> Covariance:
    """After `dt_s` during which the jerk was constant and unknown, with the given standard deviation."""
    xx, xv, xa, vv, va, aa = covariance
    half = 0.5 * dt_s * dt_s
    jerk = jerk_sigma * jerk_sigma
    gx, gv, ga = dt_s * half / 3.0, half, dt_s
    va_, xa_ = va + dt_s * aa, xa + dt_s * va + half * aa
    vv_ = vv + dt_s * (va + va_)
    xv_ = xv + dt_s * (vv + xa) + (half + dt_s * dt_s) * va + half * dt_s * aa
    xx_ = xx + 2.0 * (dt_s * xv + half * xa + dt_s * half * va) + dt_s * dt_s * vv + half * half * aa
    return (
        xx_ + jerk * gx * gx,
        xv_ + jerk * gx * gv,
        xa_ + jerk * gx * ga,
        vv_ + jerk * gv * gv,
        va_ + jerk * gv * ga,
        aa + jerk * ga * ga,
    )


def measured(covariance: Covariance, component: int, sigma: float) -> tuple[Vector3, Covariance]:
    """The gains for one measurement of VALUE or RATE with noise `sigma`, and the covariance after it."""
    xx, xv, xa, vv, va, aa = covariance
    row = (xx, xv, xa) if component == VALUE else (xv, vv, va)
    variance = row[component] + sigma * sigma
    kx, kv, ka = row[0] / variance, row[1] / variance, row[2] / variance
    return (kx, kv, ka), (
        xx - kx * row[0],
        xv - kx * row[1],
        xa - kx * row[2],
        vv - kv * row[1],
        va - kv * row[2],
        aa - ka * row[2],
    )
