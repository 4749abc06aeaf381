"""On-policy data: what the planner proposes with the model so far, and jitter around it, flown.

A planner finds the places where a network is wrong in its favour; only labels from just there can mend it.
"""

from __future__ import annotations

import hashlib
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lcd_flight.learning.collect import CollectConfig, fly, shard_rows
from lcd_flight.learning.dataset import Dataset
from lcd_flight.learning.fingerprint import described
from lcd_flight.learning.progress import Meter, ProgressCallback, ignore
from lcd_flight.learning.rollouts import Plans, Source
from lcd_flight.learning.sources import training_tasks
from lcd_flight.model import BoolArray, FloatArray, IntArray, Simulator
from lcd_flight.model.streams import Stream
from lcd_flight.planning.cost.model_file import load_model
from lcd_flight.planning.planner import PlannerOptions, TrackingCost, plan_batch

DRAWS = 16
"""Rows of each task: its plan, and jitters around it."""
TASKS_IN_A_SHARD = 1024
FIXED_SHARE = 0.5
"""Of the tasks; they are planned and jittered with the paper's time allocation, the others re-timed."""
JITTER = (0.02, 0.4)
"""Range of |dz| / sqrt(S - 1) and of the standard deviation of theta's jitter, log-uniform."""
_TASKS_IN_A_BLOCK = 128
_FIRST_TASK = 1 << 40
_ROUND = 1 << 32


@dataclass(frozen=True, slots=True)
class PolicyConfig:
    """What the data of one round are a function of, besides their length."""

    base: CollectConfig
    round: int
    """Counted from 1."""
    model_sha256: str
    """Of the model file that plans."""
    snap_weight: float
    draws: int = DRAWS
    jitter: tuple[float, float] = JITTER
    fixed_share: float = FIXED_SHARE

    def tasks(self, first: int, count: int) -> IntArray:
        """Global indices of tasks `first` to `first + count - 1` of this round; no other source uses them."""
        return _FIRST_TASK + self.round * _ROUND + first + np.arange(count)


def sha256_of(path: Path) -> str:
    """Of a file's bytes."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def collect_policy(
    config: PolicyConfig,
    model: Path,
    tasks: int,
    folder: Path,
    simulator: Simulator,
    progress: ProgressCallback = ignore,
) -> Dataset:
    """Bring a round's data set in `folder` to `tasks` tasks; what is there already stays as it is.

    Raises:
        InputError: a shard there is damaged or of another configuration, or the folder cannot be written to.
    """
    dataset = Dataset(folder, described(config))
    cost = load_model(model)
    wanted = list(enumerate(shard_rows(tasks, TASKS_IN_A_SHARD)))
    missing = [(number, count) for number, count in wanted if dataset.rows(number) < count * config.draws]
    meter = Meter(progress, tasks, "tasks", tasks - sum(count for _, count in missing))
    for number, count in missing:
        task = config.tasks(number * TASKS_IN_A_SHARD, count)
        plans = _on_all_cores(config, cost, task)
        dataset.write(number, fly(config.base, plans, _rows(config, task), simulator))
        meter.advance(count, f"round {config.round}")
    return dataset


def _on_all_cores(config: PolicyConfig, cost: TrackingCost, task: IntArray) -> Plans:
    """`policy_plans` in blocks side by side; a task's plan does not depend on its block."""
    blocks = [task[first : first + _TASKS_IN_A_BLOCK] for first in range(0, len(task), _TASKS_IN_A_BLOCK)]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return Plans.concatenate(list(pool.map(lambda block: policy_plans(config, cost, block), blocks)))


@dataclass(frozen=True, slots=True)
class _Unguarded:
    """A cost without its warnings: data are wanted from where the solve goes, above all outside the training range."""

    cost: TrackingCost

    def value_and_gradient(
        self, durations_s: FloatArray, coefficients: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """As the cost gives them."""
        return self.cost.value_and_gradient(durations_s, coefficients)


def policy_plans(config: PolicyConfig, cost: TrackingCost, task: IntArray) -> Plans:
    """For each task (N,): the plan of the model, then jitters around it, N x draws rows."""
    seed, world = config.base.seed, config.base.world
    fixed = Stream(seed, "policy/timing").uniforms(task, 1)[:, 0] < config.fixed_share
    order, z, theta = [], [], []
    for timing, members in (("fixed", np.flatnonzero(fixed)), ("retimed", np.flatnonzero(~fixed))):
        tasks = training_tasks(world.sampler, seed, task[members])
        options = PlannerOptions(timing="fixed" if timing == "fixed" else "retimed", snap_weight=config.snap_weight)
        result = plan_batch(tasks, tasks.durations_s(world.speed), _Unguarded(cost), options)
        order.append(members)
        z.append(result.z.reshape(len(members), 12 * (world.sampler.waypoints - 2)))
        theta.append(result.theta)
    back = np.argsort(np.concatenate(order))
    return _jittered(config, task, np.concatenate(z)[back], np.concatenate(theta)[back], fixed)


def _jittered(config: PolicyConfig, task: IntArray, z: FloatArray, theta: FloatArray, fixed: BoolArray) -> Plans:
    """Each plan and its jitters; the first row of a task is the plan itself."""
    rows = _rows(config, task)
    repeat = np.repeat(np.arange(len(task)), config.draws)
    first = rows % config.draws == 0
    low, high = np.log(config.jitter)
    size = np.exp(low + (high - low) * Stream(config.base.seed, "policy/size").uniforms(rows, 2))
    size[first] = 0.0
    dz = Stream(config.base.seed, "policy/z").normals(rows, z.shape[1]) * size[:, :1] / np.sqrt(12.0)
    dtheta = Stream(config.base.seed, "policy/times").normals(rows, theta.shape[1]) * size[:, 1:]
    dtheta[fixed[repeat]] = 0.0
    return Plans(
        task[repeat],
        np.full(len(rows), Source.POLICY),
        (z[repeat] + dz).astype(np.float32),
        (theta[repeat] + dtheta).astype(np.float32),
    )


def _rows(config: PolicyConfig, task: IntArray) -> IntArray:
    """(N x draws,) global numbers of the rows of tasks (N,)."""
    return (task[:, None] * config.draws + np.arange(config.draws)).reshape(-1)
