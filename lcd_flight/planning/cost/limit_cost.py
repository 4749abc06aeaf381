"""What breaking limits costs: added to a tracking cost, it bends the plan until it keeps them.

    cost = 200 * sum over segments of the mean over 16 midpoints of  sum h^2

with one h = max(0, excess) for each limit: |v|^2 / v_max^2 - 1, |F|^2 / F_max^2 - 1 (F = a + g e3),
|w|^2 / w_max^2 - 1 (w: body rates across the thrust, |j x F| / |F|^2), 3 (|F| cos(tilt_max) - F_z) / g, and metres out
of the box. Each limit counts from 3 % below, since a plan's peaks lie between the midpoints. A soft wall:
`limits.check_limits` says exactly whether it held.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from lcd_flight.jit import Compiler
from lcd_flight.model import GRAVITY_M_PER_S2, FloatArray, Geofence, Trajectories, Vector3, Vehicle
from lcd_flight.planning.limits import PlanLimits

WEIGHT = 200.0
"""A limit broken by a tenth for a quarter of a segment costs 2: as much as an error that is seven times as large."""
MARGIN = 0.97
SAMPLES = 16
_TILT = 3.0 / GRAVITY_M_PER_S2
"""One degree too much weighs about what 2 % of thrust too much do."""
_ORDERS = 5
"""Position to snap: limits look at the first four, a change of duration moves each along the next."""


@dataclass(frozen=True, slots=True)
class LimitCost:
    """The limits of one vehicle, as a cost with gradients; infinite where there is none."""

    max_speed: float = math.inf
    """m/s"""
    max_specific_force: float = math.inf
    """m/s^2, thrust over mass."""
    max_body_rate: float = math.inf
    """rad/s, roll and pitch together."""
    max_tilt_rad: float = math.inf
    low_m: Vector3 = (-math.inf, -math.inf, -math.inf)
    """Corner of the box that holds the path."""
    high_m: Vector3 = (math.inf, math.inf, math.inf)

    @staticmethod
    def of(limits: PlanLimits, vehicle: Vehicle, fence: Geofence) -> LimitCost:
        """What a mission allows this vehicle."""
        ratio = limits.max_thrust_ratio
        return LimitCost(
            _or_none(limits.max_velocity),
            math.inf if ratio is None else ratio * vehicle.max_thrust_N / vehicle.mass_kg,
            _or_none(limits.max_body_rate),
            _or_none(limits.max_tilt_rad),
            fence.low_m,
            fence.high_m,
        )

    def named(self) -> dict[str, float]:
        """What is limited, by name."""
        values = asdict(self)
        for corner in ("low", "high"):
            values |= {
                f"{corner}_{axis}_m": value for axis, value in zip("xyz", values.pop(f"{corner}_m"), strict=True)
            }
        return {name: value for name, value in values.items() if math.isfinite(value)}

    def __call__(self, plans: Trajectories) -> FloatArray:
        """(N,) zero where the limits are kept."""
        return self.value_and_gradient(plans.durations_s, plans.coefficients)[0]

    def value_and_gradient(
        self, durations_s: FloatArray, coefficients: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The cost (N,) of N plans and its gradients.

        Args:
            durations_s: (N, S) s, all > 0.
            coefficients: (N, 4, S, 8), laid out as in `Trajectories`.

        Returns:
            The costs (N,), their gradients by the durations (N, S) with the coefficients held, and by the
            coefficients (N, 4, S, 8); that by yaw is zero.
        """
        values, grad_durations = np.zeros(len(durations_s)), np.zeros(durations_s.shape)
        grad_coefficients = np.zeros(coefficients.shape)
        scalars = np.array([
            (MARGIN * self.max_speed) ** -2,
            (MARGIN * self.max_specific_force) ** -2,
            (MARGIN * self.max_body_rate) ** -2,
            math.cos(MARGIN * self.max_tilt_rad) if self.max_tilt_rad < math.pi else -1.0,  # -1: any tilt
        ])  # fmt: skip
        box = np.array([self.low_m, self.high_m])
        plan = np.ascontiguousarray(durations_s), np.ascontiguousarray(coefficients)
        _kernel()(*plan, scalars, box, values, grad_durations, grad_coefficients)
        return values, grad_durations, grad_coefficients


def _or_none(limit: float | None) -> float:
    return math.inf if limit is None else limit


@cache
def _kernel() -> Callable[..., Any]:
    return Compiler(Path(__file__), error_model="numpy", nogil=True).kernel(_costs)


def _costs(
    durations: FloatArray,
    coefficients: FloatArray,
    scalars: FloatArray,
    box: FloatArray,
    values: FloatArray,
    grad_durations: FloatArray,
    grad_coefficients: FloatArray,
) -> None:
    """Fill the costs and their gradients, which come as zeros."""
    x, g = np.empty((_ORDERS, 3)), np.empty((_ORDERS, 3))
    share = WEIGHT / SAMPLES
    for n in range(durations.shape[0]):
        for i in range(durations.shape[1]):
            T = durations[n, i]
            for m in range(SAMPLES):
                u = (m + 0.5) / SAMPLES
                _derivatives(coefficients[n, :3, i], u * T, x)
                g[:] = 0.0
                cost = _speed(x, g, scalars[0]) + _force(x, g, scalars[1]) + _rate(x, g, scalars[2])
                cost += _tilt(x, g, scalars[3]) + _outside(x, g, box)
                if cost > 0.0 or math.isnan(cost):
                    values[n] += share * cost
                    g *= share
                    grad_durations[n, i] += u * _along(x, g)
                    _spread(g, u * T, grad_coefficients[n, :3, i])


def _derivatives(coefficients: FloatArray, t: float, x: FloatArray) -> None:
    """Position, velocity, specific force (acceleration + g e3), jerk and snap at t, (5, 3)."""
    for axis in range(3):
        for order in range(_ORDERS):
            value = 0.0
            for k in range(7, order - 1, -1):
                value = value * t + _falling(k, order) * coefficients[axis, k]
            x[order, axis] = value
    x[2, 2] += GRAVITY_M_PER_S2


def _falling(k: int, order: int) -> float:
    """k (k - 1) ... : what the `order`-th derivative makes of t^k."""
    product = 1.0
    for i in range(order):
        product *= k - i
    return product


def _along(x: FloatArray, g: FloatArray) -> float:
    """The slope along time: each derivative moves along the next."""
    total = -g[1, 2] * GRAVITY_M_PER_S2
    for order in range(_ORDERS - 1):
        for axis in range(3):
            total += g[order, axis] * x[order + 1, axis]
    return float(total)


def _spread(g: FloatArray, t: float, grad_coefficients: FloatArray) -> None:
    """The adjoint of `_derivatives`."""
    for axis in range(3):
        for order in range(_ORDERS - 1):
            power = g[order, axis]
            for k in range(order, 8):
                grad_coefficients[axis, k] += power * _falling(k, order)
                power *= t


def _speed(x: FloatArray, g: FloatArray, scale: float) -> float:
    """h^2 of the speed; its gradient is added to g."""
    h = scale * (x[1, 0] ** 2 + x[1, 1] ** 2 + x[1, 2] ** 2) - 1.0
    if h <= 0.0:
        return 0.0
    for axis in range(3):
        g[1, axis] += 4.0 * h * scale * x[1, axis]
    return float(h * h)


def _force(x: FloatArray, g: FloatArray, scale: float) -> float:
    """h^2 of the thrust."""
    h = scale * (x[2, 0] ** 2 + x[2, 1] ** 2 + x[2, 2] ** 2) - 1.0
    if h <= 0.0:
        return 0.0
    for axis in range(3):
        g[2, axis] += 4.0 * h * scale * x[2, axis]
    return float(h * h)


def _rate(x: FloatArray, g: FloatArray, scale: float) -> float:
    """h^2 of the body rates: |w|^2 = |c|^2 / |F|^4 with c = j x F."""
    Fx, Fy, Fz, jx, jy, jz = x[2, 0], x[2, 1], x[2, 2], x[3, 0], x[3, 1], x[3, 2]
    cx, cy, cz = jy * Fz - jz * Fy, jz * Fx - jx * Fz, jx * Fy - jy * Fx
    force = Fx * Fx + Fy * Fy + Fz * Fz
    rate = (cx * cx + cy * cy + cz * cz) / (force * force)
    h = scale * rate - 1.0
    if h <= 0.0:
        return 0.0
    push = 4.0 * h * scale / (force * force)
    g[3, 0] += push * (Fy * cz - Fz * cy)
    g[3, 1] += push * (Fz * cx - Fx * cz)
    g[3, 2] += push * (Fx * cy - Fy * cx)
    pull = 2.0 * rate * force
    g[2, 0] += push * (cy * jz - cz * jy - pull * Fx)
    g[2, 1] += push * (cz * jx - cx * jz - pull * Fy)
    g[2, 2] += push * (cx * jy - cy * jx - pull * Fz)
    return float(h * h)


def _tilt(x: FloatArray, g: FloatArray, cosine: float) -> float:
    """h^2 of the angle between thrust and vertical."""
    force = math.sqrt(x[2, 0] ** 2 + x[2, 1] ** 2 + x[2, 2] ** 2)
    h = _TILT * (cosine * force - x[2, 2])
    if h <= 0.0:
        return 0.0
    push = 2.0 * h * _TILT
    for axis in range(3):
        g[2, axis] += push * cosine * x[2, axis] / force
    g[2, 2] -= push
    return float(h * h)


def _outside(x: FloatArray, g: FloatArray, box: FloatArray) -> float:
    """h^2 of the metres outside the box, axis by axis."""
    total = 0.0
    for axis in range(3):
        h = max(x[0, axis] - box[1, axis], 0.0) - max(box[0, axis] - x[0, axis], 0.0)
        g[0, axis] += 2.0 * h
        total += h * h
    return float(total)
