"""Durations and headings: time allocation, the short way round, re-timing at equal total time.

Tasks that planning is given are checked here, once, so that the kernels need not.
"""

from __future__ import annotations

import numpy as np

from lcd_flight.model import FloatArray, InputError

SAME_POINT = 1e-6
"""Waypoints nearer than this (m) with headings nearer than this (rad) are the same."""
RETIME_REACH = 0.7
"""A segment's log-duration is moved by less than this, before the total is restored."""


def allocate(waypoints: FloatArray, speed: float) -> FloatArray:
    """(..., K - 1) durations in s at a mean `speed` in m/s over each segment (paper's time allocation).

    waypoints: (..., K, 3 or 4), x, y, z in m first.

    Raises:
        InputError: speed is not positive, or consecutive waypoints share a position.
    """
    if not (np.isfinite(speed) and speed > 0.0):
        raise InputError(f"speed is {speed:g} m/s: give a positive one")
    distances = np.linalg.norm(np.diff(np.asarray(waypoints, dtype=float)[..., :3], axis=-2), axis=-1)
    short = np.argwhere(~(distances > SAME_POINT))
    if len(short):
        raise InputError(
            f"{_place(short[0])} and the next share a position, so a speed gives no duration: "
            "remove one of them or give the time between them"
        )
    return np.asarray(distances / speed)


def shortest_yaw(yaws_rad: FloatArray) -> FloatArray:
    """The same headings (..., K), each within half a turn of the one before; the first stays as it is."""
    return np.unwrap(np.asarray(yaws_rad, dtype=float), axis=-1)


def retime(durations_s: FloatArray, theta: FloatArray) -> FloatArray:
    """Durations (..., S) stretched by exp(0.7 tanh(theta / 0.7)) and rescaled to the same total."""
    stretched = durations_s * np.exp(RETIME_REACH * np.tanh(np.asarray(theta, dtype=float) / RETIME_REACH))
    total = durations_s.sum(axis=-1, keepdims=True)
    return np.asarray(stretched * (total / stretched.sum(axis=-1, keepdims=True)))


def retime_pullback(retimed_s: FloatArray, theta: FloatArray, grad_durations: FloatArray) -> FloatArray:
    """Gradient by theta (..., S) from the gradient by `retimed_s`, what `retime` gave for `theta`."""
    shares = retimed_s / retimed_s.sum(axis=-1, keepdims=True)
    mean = (grad_durations * shares).sum(axis=-1, keepdims=True)
    slope = 1.0 - np.tanh(np.asarray(theta, dtype=float) / RETIME_REACH) ** 2
    return np.asarray(slope * retimed_s * (grad_durations - mean))


def checked_waypoints(waypoints: FloatArray) -> FloatArray:
    """Waypoints (N, K, 4) as a contiguous array of floats of its own or the caller's, once they make sense.

    Raises:
        InputError: a wrong shape, fewer than two, NaN, or equal consecutive ones.
    """
    waypoints = np.require(waypoints, dtype=np.float64, requirements=["C", "W"])
    if waypoints.ndim != 3 or waypoints.shape[2] != 4:
        raise InputError(f"waypoints must be rows of x, y, z, yaw, not an array of shape {waypoints.shape[1:]}")
    if waypoints.shape[1] < 2:
        raise InputError(f"{waypoints.shape[1]} waypoint(s) make no trajectory: give at least two")
    bad = np.argwhere(~np.isfinite(waypoints).all(axis=2))
    if len(bad):
        raise InputError(f"{_place(bad[0])} is not finite: {waypoints[tuple(bad[0])].tolist()}")
    equal = np.argwhere((np.abs(np.diff(waypoints, axis=1)) < SAME_POINT).all(axis=2))
    if len(equal):
        raise InputError(f"{_place(equal[0])} and the next are equal: remove one of them")
    return waypoints


def checked_durations(durations_s: FloatArray, waypoints: FloatArray) -> FloatArray:
    """Durations (N, K - 1) for waypoints (N, K, 4), contiguous, once they make sense.

    Raises:
        InputError: a wrong shape, or a duration that is not positive and finite.
    """
    durations_s = np.require(durations_s, dtype=np.float64, requirements=["C", "W"])
    wanted = (waypoints.shape[0], waypoints.shape[1] - 1)
    if durations_s.shape != wanted:
        raise InputError(f"{wanted[1] + 1} waypoints need {wanted[1]} durations, not {durations_s.shape[1:]}")
    bad = np.argwhere(~(np.isfinite(durations_s) & (durations_s > 0.0)))
    if len(bad):
        raise InputError(f"the duration after {_place(bad[0])} is {durations_s[tuple(bad[0])]:g} s: it must be above 0")
    return durations_s


def _place(index: FloatArray) -> str:
    """Where in a batch: `waypoint 2`, counted from 1, and the task where there are several."""
    *tasks, waypoint = (int(i) for i in index)
    where = "" if not any(tasks) else f"task {tasks[0]}, "
    return f"{where}waypoint {waypoint + 1}"
