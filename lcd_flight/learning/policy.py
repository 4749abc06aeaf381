"""On-policy data: what the planner proposes with the model so far, and jitter around it (`given.py`), flown."""

from __future__ import annotations

import hashlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lcd_flight.learning.collect import fill
from lcd_flight.learning.collect_config import CollectConfig
from lcd_flight.learning.dataset import Dataset
from lcd_flight.learning.fingerprint import described
from lcd_flight.learning.flying import fly
from lcd_flight.learning.given import JITTER, jittered
from lcd_flight.learning.mix import shard_rows
from lcd_flight.learning.progress import Meter, ProgressCallback, ignore
from lcd_flight.learning.rollouts import Plans, Rollouts, Source
from lcd_flight.learning.shard import ShardJob
from lcd_flight.learning.sources import training_tasks
from lcd_flight.learning.spread import cores, in_turn
from lcd_flight.model import FloatArray, IntArray, Simulator
from lcd_flight.model.streams import Stream
from lcd_flight.planning.cost.model_file import load_model
from lcd_flight.planning.planner import PlannerOptions, TrackingCost, plan_batch

DRAWS = 16
"""Rows of each task: its plan, and jitters around it."""
TASKS_IN_A_SHARD = 1024
FIXED_SHARE = 0.5
"""Of the tasks; they are planned and jittered with the paper's time allocation, the others re-timed."""
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
    cost = load_model(model)
    dataset = Dataset(folder, described(config))
    counts = shard_rows(tasks, TASKS_IN_A_SHARD)

    def make(job: ShardJob) -> Rollouts:
        task = config.tasks(job.number * TASKS_IN_A_SHARD, job.rows // config.draws)
        return fly(config.base, _on_all_cores(config, cost, task), _rows(config, task), simulator)

    jobs = [ShardJob(number, count * config.draws) for number, count in enumerate(counts)]
    fill(dataset, jobs, make, in_turn, Meter(progress, tasks * config.draws, "rollouts"), f"round {config.round}")
    return dataset


def _on_all_cores(config: PolicyConfig, cost: TrackingCost, task: IntArray) -> Plans:
    """`policy_plans` in blocks side by side; a task's plan does not depend on its block."""
    blocks = [task[first : first + _TASKS_IN_A_BLOCK] for first in range(0, len(task), _TASKS_IN_A_BLOCK)]
    with ThreadPoolExecutor(cores()) as pool:
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
    short = config.base.short_yaw(task)
    order, z, theta = [], [], []
    for timing, members in (("fixed", np.flatnonzero(fixed)), ("retimed", np.flatnonzero(~fixed))):
        tasks = training_tasks(world.sampler, seed, task[members], short[members])
        options = PlannerOptions(timing="fixed" if timing == "fixed" else "retimed", snap_weight=config.snap_weight)
        result = plan_batch(tasks, tasks.durations_s(world.speed), _Unguarded(cost), options)
        order.append(members)
        z.append(result.z.reshape(len(members), 12 * (world.sampler.waypoints - 2)))
        theta.append(result.theta)
    back, repeat = np.argsort(np.concatenate(order)), np.repeat(np.arange(len(task)), config.draws)
    planned = Plans(
        task,
        short,
        np.full(len(task), Source.GIVEN),
        np.concatenate(z)[back].astype(np.float32),
        np.concatenate(theta)[back].astype(np.float32),
    )
    rows = _rows(config, task)
    return jittered(planned.take(repeat), rows, rows % config.draws == 0, seed, config.jitter)


def _rows(config: PolicyConfig, task: IntArray) -> IntArray:
    """(N x draws,) global numbers of the rows of tasks (N,)."""
    return (task[:, None] * config.draws + np.arange(config.draws)).reshape(-1)
