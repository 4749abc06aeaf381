"""The tasks and the plans of a data set, as pure functions of (seed, global index).

Where labels come from matters more than how many there are: minimum-snap optima alone teach a network nothing about
what a planner will propose, and random perturbations alone teach it little about good plans (decision 0040).
"""

from __future__ import annotations

import numpy as np

from lcd_flight.learning.rollouts import Plans, Source
from lcd_flight.learning.sampling import sample_tasks
from lcd_flight.model import BoolArray, FloatArray, IntArray, Tasks, TaskSampler
from lcd_flight.model.streams import Stream
from lcd_flight.planning.knots import Whitening
from lcd_flight.planning.times import shortest_yaw

RELATIVE_SNAP_ROOT = (0.03, 3.0)
"""Range of |z|, log-uniform, positions and yaw apart: from next to minimum snap to ten times its snap."""
TIME_SPREAD = (0.05, 0.5)
"""Range of the standard deviation of theta, log-uniform."""
RETIMED_SHARE = 0.6
"""Of the random plans; the others keep the paper's time allocation."""
SHORT_YAW_SHARE = 0.5
"""Of the tasks, where nothing else is asked for; the others turn as sampled, by the long way too."""
_DRAWS = 1 << 20
"""Draws that a task may have, so that no two tasks share one."""


def turns_short(seed: int, indices: IntArray, share: float = SHORT_YAW_SHARE) -> BoolArray:
    """(N,) which tasks turn by the short way: a share of them, from 0 to 1."""
    return np.asarray(Stream(seed, "training/yaw way").uniforms(indices, 1)[:, 0] < share)


def training_tasks(sampler: TaskSampler, seed: int, indices: IntArray, short_yaw: BoolArray) -> Tasks:
    """Tasks for data, from streams that evaluation never draws from; with yaw by the short way where `short_yaw`."""
    tasks = sample_tasks(sampler, seed, indices, purpose="training")
    return Tasks(tasks.waypoints_m, np.where(short_yaw[:, None], shortest_yaw(tasks.yaws_rad), tasks.yaws_rad))


def whitening(tasks: Tasks, speed: float) -> Whitening:
    """The planner's variables of the tasks, at the paper's time allocation."""
    return Whitening.of(tasks.poses, tasks.durations_s(speed))


def optima(task: IntArray, short_yaw: BoolArray, segments: int) -> Plans:
    """Minimum snap for each task (N,)."""
    z = np.zeros((len(task), 12 * (segments - 1)), np.float32)
    source = np.full(len(task), Source.OPTIMUM)
    return Plans(task, short_yaw, source, z, np.zeros((len(task), segments), np.float32))


def random_plans(seed: int, task: IntArray, short_yaw: BoolArray, draw: IntArray, segments: int) -> Plans:
    """Minimum snap perturbed over a wide range of relative snap, and of times in most rows.

    task, draw: (N,) the plan is draw number `draw` of the task's own.
    """
    rows = task * _DRAWS + draw
    uniform = Stream(seed, "training/size").uniforms(rows, 4)
    z = Stream(seed, "training/direction").normals(rows, 12 * (segments - 1)).reshape(len(rows), -1, 4)
    for column, axes in enumerate((slice(0, 3), slice(3, 4))):
        length = np.linalg.norm(z[..., axes], axis=(1, 2))
        z[..., axes] *= (_log_uniform(RELATIVE_SNAP_ROOT, uniform[:, column]) / length)[:, None, None]
    spread = np.where(uniform[:, 2] < RETIMED_SHARE, _log_uniform(TIME_SPREAD, uniform[:, 3]), 0.0)
    theta = spread[:, None] * Stream(seed, "training/times").normals(rows, segments)
    source = np.full(len(rows), Source.RANDOM)
    return Plans(task, short_yaw, source, z.reshape(len(rows), -1).astype(np.float32), theta.astype(np.float32))


def retimed_plans(seed: int, task: IntArray, short_yaw: BoolArray, draw: IntArray, segments: int) -> Plans:
    """Minimum snap for other times at the same total; arguments as of `random_plans`."""
    rows = task * _DRAWS + draw
    spread = _log_uniform(TIME_SPREAD, Stream(seed, "training/retimed size").uniforms(rows, 1))
    theta = spread * Stream(seed, "training/retimed").normals(rows, segments)
    z = np.zeros((len(rows), 12 * (segments - 1)), np.float32)
    return Plans(task, short_yaw, np.full(len(rows), Source.TIMES), z, theta.astype(np.float32))


def _log_uniform(limits: tuple[float, float], uniform: FloatArray) -> FloatArray:
    low, high = np.log(limits)
    return np.asarray(np.exp(low + (high - low) * uniform))
