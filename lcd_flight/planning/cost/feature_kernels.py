"""The features' kernels, forward and reverse: plain loops over one segment at a time, compiled by `features`.

Reverse mode by hand: `_name_reverse` undoes `_name`, and what stands at offset _G is the derivative of a scalar with
respect to the signal at offset 0. A test holds all of it to torch's automatic differentiation.
"""

from __future__ import annotations

import math

import numpy as np

from lcd_flight.model import COEFFICIENTS, GRAVITY_M_PER_S2, FloatArray
from lcd_flight.planning.cost.thrust_motion import (
    compress,
    compress_slope,
    soft_excess,
    soft_excess_slope,
    thrust_motion,
    thrust_motion_reverse,
)

MIDPOINTS = 12
CHANNELS = 9
"""Features at each midpoint."""
FEATURES = MIDPOINTS * CHANNELS + 6

_EXCESS = (1.5, 1.9)
_TILT_RATE_SCALE, _TILT_ACCELERATION_SCALE, _YAW_RATE_SCALE, _YAW_ACCELERATION_SCALE = 4.0, 40.0, 10.0, 50.0

# The kernels work in one flat scratch array of signals at the 12 midpoints. Its offsets are known to the compiler,
# which can then vectorise over the midpoints. First the four axes with their derivatives of order 0 to 5, then what
# follows from them; the same once more for the derivatives with respect to them (_G), and the features (_F).
_M = MIDPOINTS
_V, _A, _J, _S = _M, 2 * _M, 3 * _M, 4 * _M
_X, _Y, _Z, _YAW = 0, 6 * _M, 12 * _M, 18 * _M
_COS, _SIN, _W, _TILT = 24 * _M, 25 * _M, 26 * _M, 27 * _M
_RATE_X, _RATE_Y, _ACCELERATION_X, _ACCELERATION_Y = 28 * _M, 29 * _M, 30 * _M, 31 * _M
_G = 32 * _M
_F = 2 * _G
_SUMMARY = _F + CHANNELS * _M
_SCRATCH = _F + FEATURES


def forward(durations: FloatArray, coefficients: FloatArray, features: FloatArray) -> None:
    """Fill `features` (N, S, 114)."""
    x = np.zeros(_SCRATCH)
    for n in range(durations.shape[0]):
        for s in range(durations.shape[1]):
            _signals(durations[n, s], coefficients[n, :, s, :], x)
            _midpoint_features(x)
            _summary_features(x, durations[n, s])
            features[n, s, :] = x[_F:]


def reverse(
    durations: FloatArray,
    coefficients: FloatArray,
    g_features: FloatArray,
    g_durations: FloatArray,
    g_coefficients: FloatArray,
) -> None:
    """Fill `g_durations` (N, S) and `g_coefficients` (N, 4, S, 8)."""
    x, terms = np.zeros(_SCRATCH), np.empty(COEFFICIENTS * _M)
    for n in range(durations.shape[0]):
        for s in range(durations.shape[1]):
            T = durations[n, s]
            _signals(T, coefficients[n, :, s, :], x)
            x[_F:] = g_features[n, s, :]
            _midpoint_reverse(x)
            _summary_reverse(x)
            _thrust_reverse(x)
            g_T = x[_SUMMARY + 5] / T
            g_T += _axis_reverse(T, x, _X, terms, g_coefficients[n, 0, s, :])
            g_T += _axis_reverse(T, x, _Y, terms, g_coefficients[n, 1, s, :])
            g_T += _axis_reverse(T, x, _Z, terms, g_coefficients[n, 2, s, :])
            g_T += _axis_reverse(T, x, _YAW, terms, g_coefficients[n, 3, s, :])
            g_durations[n, s] = g_T


def _signals(T: float, coefficients: FloatArray, x: FloatArray) -> None:
    """Everything that the features are made of, at the midpoints."""
    _axis(T, coefficients[0], x, _X)
    _axis(T, coefficients[1], x, _Y)
    _axis(T, coefficients[2], x, _Z)
    _axis(T, coefficients[3], x, _YAW)
    for k in range(_M):
        x[_COS + k] = math.cos(x[_YAW + k])
        x[_SIN + k] = math.sin(x[_YAW + k])
    _thrust(x)


def _axis(T: float, coefficients: FloatArray, x: FloatArray, axis: int) -> None:
    """One axis and its first five derivatives at the midpoints: repeated Horner division."""
    c0, c1, c2, c3, c4, c5, c6, c7 = coefficients  # in registers, so that the loop is vectorised
    for k in range(_M):
        t = (k + 0.5) * (T / _M)
        d0 = d1 = d2 = d3 = d4 = d5 = 0.0
        for c in (c7, c6, c5, c4, c3, c2, c1, c0):
            d5 = d5 * t + d4
            d4 = d4 * t + d3
            d3 = d3 * t + d2
            d2 = d2 * t + d1
            d1 = d1 * t + d0
            d0 = d0 * t + c
        x[axis + k] = d0
        x[axis + _M + k] = d1
        x[axis + 2 * _M + k] = 2.0 * d2
        x[axis + 3 * _M + k] = 6.0 * d3
        x[axis + 4 * _M + k] = 24.0 * d4
        x[axis + 5 * _M + k] = 120.0 * d5


def _axis_reverse(T: float, x: FloatArray, axis: int, terms: FloatArray, g_coefficients: FloatArray) -> float:
    """Fill `g_coefficients` (8,); returns the derivative with respect to T.

    With g_d the derivative with respect to the d-th derivative at t, power i gets w_0 of the recursion
    w_d <- t w_d + (d + 1) w_(d+1), begun at w_d = g_d: the product rule on t * t^i. A longer T moves each midpoint
    by its share of T, along the next derivative.
    """
    g_T = 0.0
    for k in range(_M):
        share = (k + 0.5) / _M
        t = share * T
        w0, w1, w2 = x[_G + axis + k], x[_G + axis + _M + k], x[_G + axis + 2 * _M + k]
        w3, w4 = x[_G + axis + 3 * _M + k], x[_G + axis + 4 * _M + k]
        moved = w0 * x[axis + _M + k] + w1 * x[axis + 2 * _M + k] + w2 * x[axis + 3 * _M + k]
        moved += w3 * x[axis + 4 * _M + k] + w4 * x[axis + 5 * _M + k]
        g_T += share * moved
        for i in range(COEFFICIENTS):
            terms[i * _M + k] = w0
            w0 = t * w0 + w1
            w1 = t * w1 + 2.0 * w2
            w2 = t * w2 + 3.0 * w3
            w3 = t * w3 + 4.0 * w4
            w4 = t * w4
    for i in range(COEFFICIENTS):
        total = 0.0
        for k in range(_M):
            total += terms[i * _M + k]
        g_coefficients[i] = total
    return g_T


def _thrust(x: FloatArray) -> None:
    """From acceleration, jerk, snap and yaw to thrust and tilt motion."""
    for k in range(_M):
        c, s = x[_COS + k], x[_SIN + k]
        f, b, rate_x, rate_y, acceleration_x, acceleration_y = thrust_motion(
            c * x[_A + _X + k] + s * x[_A + _Y + k],
            c * x[_A + _Y + k] - s * x[_A + _X + k],
            x[_A + _Z + k] + GRAVITY_M_PER_S2,
            c * x[_J + _X + k] + s * x[_J + _Y + k],
            c * x[_J + _Y + k] - s * x[_J + _X + k],
            x[_J + _Z + k],
            c * x[_S + _X + k] + s * x[_S + _Y + k],
            c * x[_S + _Y + k] - s * x[_S + _X + k],
            x[_S + _Z + k],
        )
        x[_W + k], x[_TILT + k] = f / GRAVITY_M_PER_S2, b
        x[_RATE_X + k], x[_RATE_Y + k] = rate_x, rate_y
        x[_ACCELERATION_X + k], x[_ACCELERATION_Y + k] = acceleration_x, acceleration_y


def _thrust_reverse(x: FloatArray) -> None:
    """From the derivatives by thrust and tilt motion to those by acceleration, jerk, snap and yaw."""
    for k in range(_M):
        c, s = x[_COS + k], x[_SIN + k]
        Fx, Fy = c * x[_A + _X + k] + s * x[_A + _Y + k], c * x[_A + _Y + k] - s * x[_A + _X + k]
        Jx, Jy = c * x[_J + _X + k] + s * x[_J + _Y + k], c * x[_J + _Y + k] - s * x[_J + _X + k]
        Sx, Sy = c * x[_S + _X + k] + s * x[_S + _Y + k], c * x[_S + _Y + k] - s * x[_S + _X + k]
        g_Fx, g_Fy, g_Fz, g_Jx, g_Jy, g_Jz, g_Sx, g_Sy, g_Sz = thrust_motion_reverse(
            Fx,
            Fy,
            x[_A + _Z + k] + GRAVITY_M_PER_S2,
            Jx,
            Jy,
            x[_J + _Z + k],
            Sx,
            Sy,
            x[_S + _Z + k],
            x[_G + _W + k] / GRAVITY_M_PER_S2,
            x[_G + _TILT + k],
            x[_G + _RATE_X + k],
            x[_G + _RATE_Y + k],
            x[_G + _ACCELERATION_X + k],
            x[_G + _ACCELERATION_Y + k],
        )
        # A vector turned into the heading frame changes with the yaw by x' = y, y' = -x.
        x[_G + _YAW + k] = g_Fx * Fy - g_Fy * Fx + g_Jx * Jy - g_Jy * Jx + g_Sx * Sy - g_Sy * Sx
        x[_G + _A + _X + k], x[_G + _A + _Y + k] = c * g_Fx - s * g_Fy, s * g_Fx + c * g_Fy
        x[_G + _J + _X + k], x[_G + _J + _Y + k] = c * g_Jx - s * g_Jy, s * g_Jx + c * g_Jy
        x[_G + _S + _X + k], x[_G + _S + _Y + k] = c * g_Sx - s * g_Sy, s * g_Sx + c * g_Sy
        x[_G + _A + _Z + k], x[_G + _J + _Z + k], x[_G + _S + _Z + k] = g_Fz, g_Jz, g_Sz


def _midpoint_features(x: FloatArray) -> None:
    """Columns 0 to 107."""
    for k in range(_M):
        x[_F + _M + k] = x[_TILT + k]
        x[_F + 2 * _M + k] = compress(x[_RATE_X + k], _TILT_RATE_SCALE)
        x[_F + 3 * _M + k] = compress(x[_RATE_Y + k], _TILT_RATE_SCALE)
        x[_F + 4 * _M + k] = compress(x[_ACCELERATION_X + k], _TILT_ACCELERATION_SCALE)
        x[_F + 5 * _M + k] = compress(x[_ACCELERATION_Y + k], _TILT_ACCELERATION_SCALE)
        x[_F + 6 * _M + k] = compress(x[_V + _YAW + k], _YAW_RATE_SCALE)
        x[_F + 7 * _M + k] = compress(x[_A + _YAW + k], _YAW_ACCELERATION_SCALE)
    for k in range(_M):
        x[_F + k] = math.log(x[_W + k])
        x[_F + 8 * _M + k] = math.log(1.0 + x[_V + _X + k] ** 2 + x[_V + _Y + k] ** 2 + x[_V + _Z + k] ** 2)


def _midpoint_reverse(x: FloatArray) -> None:
    """Set the derivatives with respect to all that the midpoint features read."""
    for k in range(_M):
        x[_G + _W + k] = x[_F + k] / x[_W + k]
        x[_G + _TILT + k] = x[_F + _M + k]
        x[_G + _RATE_X + k] = x[_F + 2 * _M + k] * compress_slope(x[_RATE_X + k], _TILT_RATE_SCALE)
        x[_G + _RATE_Y + k] = x[_F + 3 * _M + k] * compress_slope(x[_RATE_Y + k], _TILT_RATE_SCALE)
        slope = compress_slope(x[_ACCELERATION_X + k], _TILT_ACCELERATION_SCALE)
        x[_G + _ACCELERATION_X + k] = x[_F + 4 * _M + k] * slope
        slope = compress_slope(x[_ACCELERATION_Y + k], _TILT_ACCELERATION_SCALE)
        x[_G + _ACCELERATION_Y + k] = x[_F + 5 * _M + k] * slope
        x[_G + _V + _YAW + k] = x[_F + 6 * _M + k] * compress_slope(x[_V + _YAW + k], _YAW_RATE_SCALE)
        x[_G + _A + _YAW + k] = x[_F + 7 * _M + k] * compress_slope(x[_A + _YAW + k], _YAW_ACCELERATION_SCALE)
        speed_squared = x[_V + _X + k] ** 2 + x[_V + _Y + k] ** 2 + x[_V + _Z + k] ** 2
        along = 2.0 * x[_F + 8 * _M + k] / (1.0 + speed_squared)
        x[_G + _V + _X + k] = along * x[_V + _X + k]
        x[_G + _V + _Y + k] = along * x[_V + _Y + k]
        x[_G + _V + _Z + k] = along * x[_V + _Z + k]


def _summary(x: FloatArray) -> tuple[float, float, float, float, float]:
    """Means over the midpoints: w^8, excess over each bound, squared rate, 4th power of the acceleration."""
    eighth = low = high = rate = acceleration = 0.0
    for k in range(_M):
        eighth += x[_W + k] ** 8
        low += soft_excess(x[_W + k] - _EXCESS[0])
        high += soft_excess(x[_W + k] - _EXCESS[1])
        rate += x[_RATE_X + k] ** 2 + x[_RATE_Y + k] ** 2
        acceleration += (x[_ACCELERATION_X + k] ** 2 + x[_ACCELERATION_Y + k] ** 2) ** 2
    return eighth / _M, low / _M, high / _M, rate / _M, acceleration / _M


def _summary_features(x: FloatArray, T: float) -> None:
    """Columns 108 to 113."""
    eighth, low, high, rate, acceleration = _summary(x)
    x[_SUMMARY] = math.log(eighth) / 8.0
    x[_SUMMARY + 1], x[_SUMMARY + 2] = low, high
    x[_SUMMARY + 3] = 0.5 * math.log(1.0 + rate)
    x[_SUMMARY + 4] = 0.25 * math.log(1.0 + acceleration)
    x[_SUMMARY + 5] = math.log(T)


def _summary_reverse(x: FloatArray) -> None:
    """Add what columns 108 to 112 contribute."""
    eighth, _, _, rate, acceleration = _summary(x)
    g_eighth = x[_SUMMARY] / (_M * eighth)
    g_low, g_high = x[_SUMMARY + 1] / _M, x[_SUMMARY + 2] / _M
    g_rate = x[_SUMMARY + 3] / (_M * (1.0 + rate))
    g_acceleration = x[_SUMMARY + 4] / (_M * (1.0 + acceleration))
    for k in range(_M):
        w = x[_W + k]
        g_excess = g_low * soft_excess_slope(w - _EXCESS[0]) + g_high * soft_excess_slope(w - _EXCESS[1])
        x[_G + _W + k] += g_eighth * w**7 + g_excess
        x[_G + _RATE_X + k] += g_rate * x[_RATE_X + k]
        x[_G + _RATE_Y + k] += g_rate * x[_RATE_Y + k]
        squared = x[_ACCELERATION_X + k] ** 2 + x[_ACCELERATION_Y + k] ** 2
        x[_G + _ACCELERATION_X + k] += g_acceleration * squared * x[_ACCELERATION_X + k]
        x[_G + _ACCELERATION_Y + k] += g_acceleration * squared * x[_ACCELERATION_Y + k]
