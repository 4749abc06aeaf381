"""Tasks and plans for tests of the simulator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lcd_flight.learning.sampling import first_tasks
from lcd_flight.model import FloatArray, SeedArray, TaskSampler, Trajectories
from lcd_flight.planning.minimum_snap import minimum_snap_batch
from lcd_flight.worlds import load_vehicle

YAW_SPAN = 0.85 * np.pi
LOPSIDED = replace(
    load_vehicle("hummingbird"),
    name="lopsided",
    rotor_positions_m=((0.15, 0.1, 0.0), (0.11, -0.14, 0.0), (-0.1, -0.12, 0.0), (-0.13, 0.16, 0.0)),
    k_flap=1e-6,
    parasitic_drag=(0.1, 0.2, 0.3),
)
"""A vehicle about which nothing is symmetric, so that no term can hide."""


def minimum_snap_plans(count: int, speed: float, *, seed: int = 0, waypoints: int = 4) -> Trajectories:
    """Minimum snap through sampled tasks, times by the speed in m/s."""
    sampler = TaskSampler(waypoints, (10.0, 10.0, 10.0), (1.0, 3.0), YAW_SPAN)
    tasks = first_tasks(sampler, seed, count)
    poses: FloatArray = np.concatenate([tasks.waypoints_m, tasks.yaws_rad[..., None]], axis=2)
    return minimum_snap_batch(poses, tasks.durations_s(speed))


def seeds(count: int, first: int = 0) -> SeedArray:
    """One for each row."""
    return np.arange(first, first + count, dtype=np.uint64)
