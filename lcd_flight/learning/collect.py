"""Make a data set: shard after shard of plans flown in the simulator, going on where an earlier run stopped."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path

from lcd_flight.learning.collect_config import CollectConfig
from lcd_flight.learning.dataset import Dataset
from lcd_flight.learning.dataset_card import write_card
from lcd_flight.learning.fingerprint import Description, described, differences, origin
from lcd_flight.learning.folder_lock import alone_in
from lcd_flight.learning.given import GivenPlans
from lcd_flight.learning.manifest import Manifest
from lcd_flight.learning.mix import Mix, shard_rows
from lcd_flight.learning.progress import Meter, ProgressCallback, ignore
from lcd_flight.learning.rollouts import Rollouts
from lcd_flight.learning.shard import ShardJob, ShardMaker
from lcd_flight.learning.spread import Spread, in_threads
from lcd_flight.model import InputError, Simulator

__all__ = ["CollectConfig", "Mix", "collect", "fill", "shard_rows"]


def collect(
    config: CollectConfig,
    count: int,
    folder: Path,
    simulator: Simulator,
    progress: ProgressCallback = ignore,
    *,
    given: GivenPlans | None = None,
    spread: Spread | None = None,
) -> Dataset:
    """Bring the data set in `folder` to at least `count` rollouts; what is there already stays as it is.

    given: the plans of the mix's source `plans`.
    spread: who makes the shards; None: this process, a shard on each core.

    Raises:
        InputError: a shard there is damaged or of another configuration, or the folder cannot be written to.
    """
    make = ShardMaker(config, simulator, given)
    dataset = Dataset(folder, described(config))
    jobs = [ShardJob(n, rows) for n, rows in enumerate(shard_rows(count, config.mix.rows))]
    fill(dataset, jobs, make, spread or in_threads(), Meter(progress, count, "rollouts"))
    return dataset


def fill(
    dataset: Dataset,
    jobs: Sequence[ShardJob],
    make: Callable[[ShardJob], Rollouts],
    spread: Spread,
    meter: Meter,
    note: str = "",
) -> None:
    """Make the shards that are missing or too short.

    meter: counts rows, also those that are there already.
    note: what it says; else which shard.

    Raises:
        InputError: as `collect`.
    """
    with alone_in(dataset.folder):
        manifest = Manifest(dataset)
        meter.begin(sum(min(manifest.rows(job.number), job.rows) for job in jobs))
        missing = [job for job in jobs if manifest.rows(job.number) < job.rows]
        try:
            with closing(spread(_Signed(make), missing)) as shards:
                for job, made in shards:
                    fresh = job.rows - manifest.rows(job.number)
                    dataset.write(job.number, made.rollouts, made.checked())
                    manifest.add(job.number)
                    meter.advance(fresh, note or f"shard {job.number + 1} of {len(jobs)}")
        finally:
            with suppress(InputError):  # where a disk is full, what was wrong first is to be told
                manifest.write()
        write_card(dataset, manifest)


@dataclass(frozen=True, slots=True, eq=False)
class _Made:
    """A shard, and what flew it."""

    rollouts: Rollouts
    flown_by: Description

    def checked(self) -> Description:
        """What flew it, where that is of this process's versions: only then is it the same to the bit."""
        if self.flown_by["versions"] != origin()["versions"]:
            what = "; ".join(differences(origin()["versions"], self.flown_by["versions"]))
            raise InputError(f"a machine of the cluster has other versions ({what}); install the same on each")
        return self.flown_by


@dataclass(frozen=True, slots=True)
class _Signed:
    """Makes shards, wherever that may be, and says what flew them."""

    make: Callable[[ShardJob], Rollouts]

    def __call__(self, job: ShardJob) -> _Made:
        return _Made(self.make(job), origin())
