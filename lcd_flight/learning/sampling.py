"""The paper's waypoint-following tasks, drawn by counter-based streams (`streams.py`).

Task i of seed s is the same whatever the count and the grouping. Seeds 0 to 999 are for development: evaluation that
is reported as evidence uses others.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np

from lcd_flight.model import FloatArray, IntArray, Tasks, TaskSampler
from lcd_flight.model.streams import Stream

Purpose: TypeAlias = Literal["training", "evaluation"]
"""Tasks of one seed that serve one purpose never serve the other."""

_MOST_ATTEMPTS = 10_000
"""For one waypoint; the paper's sampler accepts about every third candidate."""


def sample_tasks(sampler: TaskSampler, seed: int, indices: IntArray, purpose: Purpose = "evaluation") -> Tasks:
    """The tasks with the given global indices (N,); those for training are others than those for evaluation.

    The first waypoint is uniform in the room: the domain without its margin. Each next one is a step away, uniform in
    the shell between the sampler's distances, drawn again until it lies in the room too. The paper says no more than
    "four waypoints in sequence", "at least 1 m and no more than 3 m apart from the previous one"; why it is this
    reading: decision 0040.

    Raises:
        ValueError: the sampler's box has no room for its distances.
    """
    indices = np.asarray(indices, dtype=np.int64)
    waypoints = np.empty((len(indices), sampler.waypoints, 3))
    low, high = _room(sampler)
    waypoints[:, 0] = low + (high - low) * Stream(seed, f"{purpose}/first").uniforms(indices, 3)
    for k in range(1, sampler.waypoints):
        stream = Stream(seed, f"{purpose}/waypoint/{k}")
        waypoints[:, k] = _next_waypoint(sampler, stream, indices, waypoints[:, k - 1])
    turns = 2.0 * Stream(seed, f"{purpose}/yaw").uniforms(indices, sampler.waypoints) - 1.0
    return Tasks(waypoints, sampler.yaw_span_rad * turns)


def first_tasks(sampler: TaskSampler, seed: int, count: int) -> Tasks:
    """Tasks 0 to `count` - 1 of a seed, as evaluated and as named in documents."""
    return sample_tasks(sampler, seed, np.arange(count))


def _room(sampler: TaskSampler) -> tuple[FloatArray, FloatArray]:
    """Least and greatest corner of where waypoints may lie, m."""
    size = np.asarray(sampler.box_m)
    low = np.array([-0.5 * size[0], -0.5 * size[1], 0.0])
    return low + sampler.margin_m, low + size - sampler.margin_m


def _next_waypoint(sampler: TaskSampler, stream: Stream, indices: IntArray, previous: FloatArray) -> FloatArray:
    """(N, 3) steps from the previous waypoint until each is good.

    Attempt a uses draws 3a to 3a + 2 of the task's own stream, so that a task's luck does not depend on the others.
    """
    nearest, farthest = sampler.distance_m
    low, high = _room(sampler)
    result = np.empty_like(previous)
    pending = np.arange(len(indices))
    for attempt in range(_MOST_ATTEMPTS):
        if not len(pending):
            return result
        step = farthest * (2.0 * stream.uniforms(indices[pending], 3, first=3 * attempt) - 1.0)
        length = np.linalg.norm(step, axis=1)
        candidate = previous[pending] + step
        inside = ((low <= candidate) & (candidate <= high)).all(axis=1)
        good = (nearest <= length) & (length <= farthest) & inside
        result[pending[good]] = candidate[good]
        pending = pending[~good]
    raise ValueError(f"no waypoint found {nearest:g} to {farthest:g} m from the last one in a box of {sampler.box_m} m")
