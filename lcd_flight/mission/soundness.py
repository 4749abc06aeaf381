"""Whether a trajectory that comes from a file can be what it claims to be: finite, continuous, through its waypoints.

No checksum stands behind a plan: every digit of its durations and coefficients is tied to the others by continuity and
by the waypoints, so that damage shows where it matters, and plans of other programs are as good as ours.
"""

from __future__ import annotations

import numpy as np

from lcd_flight.model import FloatArray, Trajectory
from lcd_flight.planning.times import SAME_POINT

TOLERANCE = 1e-6
"""Jump of a derivative at a knot, relative to 1 + its largest value there; ours are below 1e-9."""

_AXES = ("x", "y", "z", "yaw")
_DERIVATIVES = ("position", "velocity", "acceleration", "jerk")


def flaw(trajectory: Trajectory, waypoints: FloatArray) -> str | None:
    """Why `trajectory` cannot be flown through `waypoints` (K, 4), x, y, z in m and yaw in rad; None if it can."""
    if trajectory.segments != len(waypoints) - 1:
        return f"has {trajectory.segments} segments; {len(waypoints)} waypoints need {len(waypoints) - 1}"
    return _not_a_number(trajectory) or _missed(trajectory, waypoints) or discontinuity(trajectory)


def discontinuity(trajectory: Trajectory, tolerance: float = TOLERANCE) -> str | None:
    """Where it jumps, or is not at rest at an end; None if it is smooth.

    tolerance: of position to jerk, relative to 1 + the largest value at a knot.
    """
    starts, ends = knot_derivatives(trajectory)
    before, after = np.zeros((2, trajectory.segments + 1, *starts.shape[1:]))
    before[1:], after[:-1] = ends, starts
    before[0, 0], after[-1, 0] = starts[0, 0], ends[-1, 0]  # an end has a position, and no motion
    jumps = np.abs(after - before)
    scale = 1.0 + np.maximum(np.abs(before), np.abs(after)).max(axis=0, keepdims=True)
    excess = np.nan_to_num(jumps / scale, nan=np.inf)
    if excess.max() <= tolerance:
        return None
    knot, order, axis = (int(i) for i in np.unravel_index(int(excess.argmax()), excess.shape))
    what = f"{_AXES[axis]}'s {_DERIVATIVES[order]}"
    if knot in (0, trajectory.segments):
        return f"is not at rest at its {'start' if knot == 0 else 'end'}: {what} is {jumps[knot, order, axis]:.3g}"
    return f"is not continuous: {what} jumps by {jumps[knot, order, axis]:.3g} at waypoint {knot + 1}"


def knot_derivatives(trajectory: Trajectory) -> tuple[FloatArray, FloatArray]:
    """Position, velocity, acceleration and jerk at the start and at the end of each segment, each (S, 4, axes)."""
    powers = np.arange(trajectory.coefficients.shape[2])
    times = trajectory.durations_s[:, None]
    ends = np.empty((trajectory.segments, 4, len(_AXES)))
    starts = np.empty_like(ends)
    derived = trajectory.coefficients
    with np.errstate(over="ignore", invalid="ignore"):  # judged by the caller, as values that are not finite
        for order in range(4):
            starts[:, order] = derived[:, :, 0].T
            ends[:, order] = np.einsum("sk,ask->sa", times ** powers[: derived.shape[2]], derived)
            derived = derived[:, :, 1:] * powers[1 : derived.shape[2]]
    return starts, ends


def _not_a_number(trajectory: Trajectory) -> str | None:
    if not (np.isfinite(trajectory.durations_s) & (trajectory.durations_s > 0.0)).all():
        return "has a duration that is not a number above 0"
    return None if np.isfinite(trajectory.coefficients).all() else "has a coefficient that is not finite"


def _missed(trajectory: Trajectory, waypoints: FloatArray) -> str | None:
    """Which waypoint is missed most, judged at the ends of its segments."""
    starts, ends = knot_derivatives(trajectory)
    misses = np.zeros(waypoints.shape)
    misses[:-1] = np.abs(starts[:, 0] - waypoints[:-1])
    misses[1:] = np.fmax(misses[1:], np.abs(ends[:, 0] - waypoints[1:]))
    misses = np.nan_to_num(misses, nan=np.inf)
    if misses.max() <= SAME_POINT:
        return None
    knot, axis = (int(i) for i in np.unravel_index(int(misses.argmax()), misses.shape))
    unit = "rad" if _AXES[axis] == "yaw" else "m"
    return f"misses waypoint {knot + 1} by {misses[knot, axis]:.3g} {unit} in {_AXES[axis]}"
