"""On-policy data: what the planner proposes with the model so far, jitter around it, and searches where it fails.

A planner finds the places where a network is wrong in its favour: labels from just there mend that. And on the
hardest tasks the network does not know what a good plan looks like at all, since few of those it has seen are good:
searches in the simulator from its own plans show it (decision 0047).

Tasks come in blocks, each planned on its own; the hardest of a block, by the model's own prediction, are searched.
"""

from __future__ import annotations

import hashlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
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
from lcd_flight.learning.searching import searched
from lcd_flight.learning.shard import ShardJob
from lcd_flight.learning.sources import training_tasks
from lcd_flight.learning.spread import cores, in_turn
from lcd_flight.model import FloatArray, IntArray, Simulator
from lcd_flight.model.streams import Stream
from lcd_flight.planning.cost.model_file import load_model
from lcd_flight.planning.cost.tracking_cost import CostModel
from lcd_flight.planning.planner import PlannerOptions, Timing, plan_batch
from lcd_flight.planning.search import SearchSettings

_FIRST_TASK = 1 << 40
_ROUND = 1 << 32


@dataclass(frozen=True, slots=True)
class PolicyMix:
    """What a round makes of its tasks."""

    draws: int = 6
    """Rows of each task: its plan, and jitters around it."""
    jitter: tuple[float, float] = JITTER
    fixed_share: float = 0.5
    """Of the tasks; they are planned with the paper's time allocation, the others re-timed."""
    block: int = 128
    hardest: int = 16
    """Of a block, those with the largest predicted error: they are searched from their plans."""
    search: SearchSettings = field(default_factory=SearchSettings)
    kept: int = 4
    """Samples of each generation that become rows: the mean, which the search believes in, and some others."""
    blocks_in_a_shard: int = 8

    @property
    def rows(self) -> int:
        """Of a block."""
        return self.block * self.draws + self.hardest * self.search.generations * self.kept


@dataclass(frozen=True, slots=True)
class PolicyConfig:
    """What the data of one round are a function of, besides their length."""

    base: CollectConfig
    round: int
    """Counted from 1."""
    model_sha256: str
    """Of the model file that plans."""
    snap_weight: float
    mix: PolicyMix = field(default_factory=PolicyMix)

    def tasks(self, first: int, count: int) -> IntArray:
        """Global indices of tasks `first` to `first + count - 1` of this round; no other source uses them."""
        return _FIRST_TASK + self.round * _ROUND + first + np.arange(count)


def sha256_of(path: Path) -> str:
    """Of a file's bytes."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def collect_policy(
    config: PolicyConfig,
    model: Path,
    blocks: int,
    folder: Path,
    simulator: Simulator,
    progress: ProgressCallback = ignore,
) -> Dataset:
    """Bring a round's data set in `folder` to so many blocks of tasks; what is there already stays as it is.

    Raises:
        InputError: a shard there is damaged or of another configuration, or the folder cannot be written to.
    """
    cost, mix = load_model(model), config.mix
    dataset = Dataset(folder, described(config))
    counts = shard_rows(blocks, mix.blocks_in_a_shard)

    def make(job: ShardJob) -> Rollouts:
        first, count = job.number * mix.blocks_in_a_shard * mix.block, job.rows // mix.rows * mix.block
        return policy_rollouts(config, cost, config.tasks(first, count), simulator)

    jobs = [ShardJob(number, count * mix.rows) for number, count in enumerate(counts)]
    fill(dataset, jobs, make, in_turn, Meter(progress, blocks * mix.rows, "rollouts"), f"round {config.round}")
    return dataset


def policy_rollouts(config: PolicyConfig, cost: CostModel, task: IntArray, simulator: Simulator) -> Rollouts:
    """All rows of whole blocks of tasks: plans and jitters, task by task, then those of the searches."""
    blocks = list(task.reshape(-1, config.mix.block))
    with ThreadPoolExecutor(cores()) as pool:
        planned = list(pool.map(lambda block: _planned(config, cost, block), blocks))
    plans = Plans.concatenate([plan for plan, _ in planned])
    hardest = [np.argsort(-error, kind="stable")[: config.mix.hardest] for _, error in planned]
    chosen = np.concatenate([config.mix.block * n + rows for n, rows in enumerate(hardest)])
    around = fly(config.base, _around(config, plans), _rows(config, task), simulator)
    if not len(chosen):
        return around
    return Rollouts.concatenate([around, *_searches(config, plans.take(np.sort(chosen)), simulator)])


def _planned(config: PolicyConfig, cost: CostModel, task: IntArray) -> tuple[Plans, FloatArray]:
    """The model's plan for each task (N,), and the largest error that it expects."""
    base, world = config.base, config.base.world
    short, fixed = base.short_yaw(task), _fixed(config, task)
    z = np.empty((len(task), 12 * (base.segments - 1)), np.float32)
    theta, error = np.empty((len(task), base.segments), np.float32), np.empty(len(task))
    timings: tuple[Timing, Timing] = ("fixed", "retimed")
    for timing, rows in zip(timings, (np.flatnonzero(fixed), np.flatnonzero(~fixed)), strict=True):
        tasks = training_tasks(world.sampler, base.seed, task[rows], short[rows])
        options = PlannerOptions(timing=timing, snap_weight=config.snap_weight)
        result = plan_batch(tasks, tasks.durations_s(world.speed), _Unguarded(cost), options)
        z[rows], theta[rows] = result.z.reshape(len(rows), -1), result.theta
        error[rows] = cost.predict_max_error_m(result.plans.durations_s, result.plans.coefficients)
    return Plans(task, short, np.full(len(task), Source.GIVEN), z, theta), error


def _around(config: PolicyConfig, plans: Plans) -> Plans:
    """Each plan, then jitters around it."""
    rows = _rows(config, plans.task)
    repeated = plans.take(np.repeat(np.arange(len(plans)), config.mix.draws))
    return jittered(repeated, rows, rows % config.mix.draws == 0, config.base.seed, config.mix.jitter)


def _searches(config: PolicyConfig, plans: Plans, simulator: Simulator) -> list[Rollouts]:
    """Samples of a search from each plan; durations are kept where the plan keeps them."""
    fixed, mix = _fixed(config, plans.task), config.mix
    groups = [plans.take(np.flatnonzero(fixed)), plans.take(np.flatnonzero(~fixed))]
    return [
        searched(config.base, group, mix.search, simulator, kept=mix.kept, retimed=retimed)
        for group, retimed in zip(groups, (False, True), strict=True)
        if len(group)
    ]


def _fixed(config: PolicyConfig, task: IntArray) -> IntArray:
    """(N,) whether each task is planned with the paper's time allocation."""
    return np.asarray(Stream(config.base.seed, "policy/timing").uniforms(task, 1)[:, 0] < config.mix.fixed_share)


def _rows(config: PolicyConfig, task: IntArray) -> IntArray:
    """(N x draws,) global numbers of the rows of tasks (N,)."""
    draws = config.mix.draws
    return (task[:, None] * draws + np.arange(draws)).reshape(-1)


@dataclass(frozen=True, slots=True)
class _Unguarded:
    """A cost without its warnings: data are wanted from where the solve goes, above all outside the training range."""

    cost: CostModel

    def value_and_gradient(
        self, durations_s: FloatArray, coefficients: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """As the cost gives them."""
        return self.cost.value_and_gradient(durations_s, coefficients)
