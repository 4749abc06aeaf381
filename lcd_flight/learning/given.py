"""Given plans, and jitter around them: a planner's proposals as data.

A planner finds the places where a network is wrong in its favour; only labels from just there, and from around there,
can mend it. The rounds of a training give what the model so far plans; `lcd collect --plans` takes a file.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lcd_flight.learning.npz import read_array, read_arrays
from lcd_flight.learning.rollouts import Plans, Source
from lcd_flight.learning.sources import turns_short
from lcd_flight.model import BoolArray, FloatArray, InputError, IntArray, TaskSampler
from lcd_flight.model.streams import Stream

JITTER = (0.02, 0.4)
"""Range of |dz| / sqrt(S - 1) and of the standard deviation of theta's jitter, log-uniform."""
MOST_TASKS = 1 << 42
"""Numbers of tasks are below this, so that every row's number fits into 64 bits."""


@dataclass(frozen=True, slots=True, eq=False)
class GivenPlans:
    """Plans from a file."""

    plans: Plans
    sha256: str
    """Of their contents, so that a configuration says which they were."""

    def visit(self, number: IntArray) -> Plans:
        """The plan of each visit (N,): all in turn, then from the first again."""
        return self.plans.take(number % len(self.plans))


def jittered(plans: Plans, rows: IntArray, first: BoolArray, seed: int, limits: tuple[float, float] = JITTER) -> Plans:
    """Each plan (N,), shifted a little; where `first` as it is, and with theta as it is where that is zero throughout.

    rows: (N,) global numbers of the rows, which the jitter is keyed by.
    """
    low, high = np.log(limits)
    size = np.exp(low + (high - low) * Stream(seed, "policy/size").uniforms(rows, 2))
    size[first] = 0.0
    size[~plans.theta.any(axis=1), 1] = 0.0
    dz = Stream(seed, "policy/z").normals(rows, plans.z.shape[1]) * size[:, :1] / np.sqrt(12.0)
    dtheta = Stream(seed, "policy/times").normals(rows, plans.theta.shape[1]) * size[:, 1:]
    moved = ((values.astype(np.float64) + d).astype(np.float32) for values, d in ((plans.z, dz), (plans.theta, dtheta)))
    return Plans(plans.task, plans.short_yaw, np.full(len(rows), Source.GIVEN), *moved)


def load_plans(path: Path, sampler: TaskSampler, seed: int, short_yaw_share: float) -> GivenPlans:
    """Plans from an .npz file with `task` (N,), `z` (N, 12 (S - 1)), `theta` (N, S) and, if it likes, `short_yaw` (N,).

    They are plans of the tasks that `lcd collect` draws for the same world and seed, in the planner's variables.

    Raises:
        InputError: one line that names the file, the array, what is wrong and what it should be.
    """
    arrays = read_arrays(path, "`task`, `z` and `theta`")
    task = read_array(path, arrays, "task", "(N,) numbers of tasks", dimensions=1)
    z = read_array(path, arrays, "z", "(N, 12 (S - 1))", dimensions=2)
    theta = read_array(path, arrays, "theta", "(N, S)", dimensions=2)
    _check_shapes(path, task, z, theta, sampler.waypoints - 1)
    if not (np.all(task == np.floor(task)) and task.min() >= 0 and task.max() < MOST_TASKS):
        raise InputError(f"{path}: task must hold whole numbers from 0 to below {MOST_TASKS}")
    number = task.astype(np.int64)
    short = turns_short(seed, number, short_yaw_share)
    if "short_yaw" in arrays:
        short = read_array(path, arrays, "short_yaw", "(N,) truth values", dimensions=1) != 0.0
        if short.shape != number.shape:
            raise InputError(f"{path}: short_yaw has {len(short)} rows and task {len(number)}; give one for each")
    plans = Plans(number, short, np.full(len(number), Source.GIVEN), z.astype(np.float32), theta.astype(np.float32))
    return GivenPlans(plans, _digest(plans))


def _check_shapes(path: Path, task: FloatArray, z: FloatArray, theta: FloatArray, segments: int) -> None:
    if not len(task):
        raise InputError(f"{path}: no plan in it; give at least one")
    for name, values, columns in (("z", z, 12 * (segments - 1)), ("theta", theta, segments)):
        if values.shape != (len(task), columns):
            wanted = f"{len(task)} plans of {segments} segments have {(len(task), columns)}"
            raise InputError(f"{path}: {name} has shape {values.shape}; {wanted}")


def _digest(plans: Plans) -> str:
    sha = hashlib.sha256()
    for values in (plans.task, plans.short_yaw, plans.z, plans.theta):
        sha.update(np.ascontiguousarray(values).tobytes())
    return sha.hexdigest()
