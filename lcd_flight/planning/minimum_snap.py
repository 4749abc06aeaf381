"""Minimum snap through waypoints, from rest to rest: for one task and for many at once, linear in the segments.

The paper's problem 3 without its learned term. The derivatives v, a, j at the inner knots are the only unknowns
(`segments`); at their optimum the polynomials are continuous up to order 6. All four axes, yaw too, minimise snap, as
in the paper's released code; time is each segment's own, so 200 segments of very different durations stay well
conditioned.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from lcd_flight.jit import Compiler
from lcd_flight.model import COEFFICIENTS, FloatArray, InputError, Trajectories, Trajectory
from lcd_flight.planning.segments import AXES, GRAM, largest_miss, optimal_knots, polynomials
from lcd_flight.planning.times import checked_durations, checked_waypoints

_FOLDER = Path(__file__).parent
HELD = 1e-9
"""Waypoints are held to this, in m and rad."""
KERNEL_SOURCES = (_FOLDER / "banded.py", _FOLDER / "segments.py")


def minimum_snap(waypoints: FloatArray, durations_s: FloatArray) -> Trajectory:
    """The trajectory of least snap through `waypoints` (K, 4) in `durations_s` (K - 1,), at rest at both ends.

    waypoints: x, y, z in m in the world and yaw in rad, unwrapped as it is to be flown (`times.shortest_yaw`).

    Raises:
        InputError: fewer than two waypoints, equal consecutive ones, a duration that is not positive, NaN.
    """
    return minimum_snap_batch(np.asarray(waypoints)[None], np.asarray(durations_s)[None])[0]


def minimum_snap_batch(waypoints: FloatArray, durations_s: FloatArray) -> Trajectories:
    """`minimum_snap` of N tasks of equally many waypoints: waypoints (N, K, 4), durations_s (N, K - 1).

    A row's result depends on that row alone.

    Raises:
        InputError: as `minimum_snap`, naming the first task and waypoint that is wrong.
    """
    waypoints = checked_waypoints(waypoints)
    durations_s = checked_durations(durations_s, waypoints)
    coefficients = np.empty((len(waypoints), AXES, durations_s.shape[1], COEFFICIENTS))
    misses = np.empty(len(waypoints))
    _kernel()(waypoints, durations_s, coefficients, misses)
    check_held(misses, durations_s)
    return Trajectories(durations_s, coefficients)


def snap(plans: Trajectories) -> FloatArray:
    """(N, 4) the integral of the squared snap of x, y, z (m^2/s^7) and yaw (rad^2/s^7)."""
    scaled = plans.coefficients[..., 4:] * plans.durations_s[:, None, :, None] ** (np.arange(4) + 0.5)
    return np.asarray(((scaled @ GRAM) * scaled).sum(axis=(2, 3)))


def check_held(misses: FloatArray, durations_s: FloatArray) -> None:
    """Refuse plans that miss a waypoint: misses (N,) of plans with durations_s (N, S), m or rad.

    Raises:
        InputError: a miss above 1e-9, which rounding comes to where a plan swings out by 10 km and more.
    """
    bad = np.flatnonzero(~(misses <= HELD))
    if len(bad):
        durations = durations_s[bad[0]]
        raise InputError(
            f"durations from {durations.min():g} s to {durations.max():g} s make a plan that double precision cannot "
            f"hold to its waypoints within {HELD:g}: bring the durations nearer to each other"
        )


@cache
def _kernel() -> Callable[[FloatArray, FloatArray, FloatArray, FloatArray], None]:
    return Compiler(*KERNEL_SOURCES, Path(__file__), error_model="numpy", nogil=True).kernel(_solve)


def _solve(waypoints: FloatArray, durations: FloatArray, coefficients: FloatArray, misses: FloatArray) -> None:
    """One task after another into `coefficients` (N, 4, S, 8) and `misses` (N,)."""
    rows = 3 * waypoints.shape[1]
    band, knots, powers = np.empty((rows, 6)), np.empty((rows, 4)), np.empty(8)
    for n in range(waypoints.shape[0]):
        optimal_knots(waypoints[n], durations[n], powers, band, knots)
        polynomials(waypoints[n], durations[n], knots, powers, coefficients[n])
        misses[n] = largest_miss(waypoints[n], durations[n], coefficients[n])
