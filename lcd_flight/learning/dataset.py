"""Data sets on disk: a folder of Parquet shards, each written whole or not at all.

Each shard carries the whole configuration, its hash, its number and the versions that wrote it, so that a folder is
understood from its files alone. Pages carry checksums. Whatever is damaged or of another configuration is named and
refused, never mixed in.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from lcd_flight.files import write_durably
from lcd_flight.learning.fingerprint import Description, differences, fingerprint, origin, versions
from lcd_flight.learning.rollouts import Rollouts
from lcd_flight.learning.shard_file import ShardHeader, encode, read_header, read_rows
from lcd_flight.model import InputError


@dataclass(frozen=True, slots=True)
class Dataset:
    """The shards of one configuration in one folder."""

    folder: Path
    configuration: Description

    @property
    def hash(self) -> str:
        """Of the configuration; in every shard and in the card of a model trained on it."""
        return fingerprint(self.configuration)

    def path(self, number: int) -> Path:
        """Where shard `number` belongs."""
        return self.folder / f"shard-{number:05d}.parquet"

    def numbers(self) -> list[int]:
        """The shards that exist, whole.

        Raises:
            InputError: a file is named like a shard but for its number.
        """
        return sorted(_number(path) for path in self.folder.glob("shard-*.parquet"))

    def rows(self, number: int) -> int:
        """How many rows shard `number` has; 0 where there is none.

        Raises:
            InputError: it is damaged or of another configuration.
        """
        return self.header(number).rows if self.path(number).exists() else 0

    def header(self, number: int) -> ShardHeader:
        """What shard `number` says about itself.

        Raises:
            InputError: it is damaged or of another configuration.
        """
        path = self.path(number)
        header = read_header(path)
        if header.configuration != self.configuration:
            what = "; ".join(differences(self.configuration, header.configuration)[:3])
            raise InputError(f"{path}: made by another configuration ({what}); give another folder")
        if header.number != number:
            raise InputError(f"{path}: holds shard {header.number}; give it back its name or delete it")
        return header

    def read(self, number: int) -> Rollouts:
        """The rows of shard `number`, checksums verified.

        Raises:
            InputError: it is damaged or of another configuration.
        """
        self.header(number)
        return read_rows(self.path(number))

    def shards(self) -> Iterator[Rollouts]:
        """All rows, shard by shard."""
        return (self.read(number) for number in self.numbers())

    def write(self, number: int, rollouts: Rollouts, flown_by: Description | None = None) -> None:
        """Put shard `number` in its place in one step: readers see all of it or none.

        flown_by: the `fingerprint.origin` of what flew it; None: this process.

        Raises:
            InputError: the folder cannot be written to, or the disk is full.
        """
        metadata = {
            "shard": number,
            "configuration": self.configuration,
            "hash": self.hash,
            "flown_by": flown_by or origin(),
            "written_by": versions("pyarrow"),
        }
        write_durably(self.path(number), encode(rollouts, metadata))


def open_dataset(folder: Path) -> Dataset:
    """The data set in a folder, its configuration taken from the first shard.

    Raises:
        InputError: there is none, or its first shard is damaged.
    """
    shards = sorted(folder.glob("shard-*.parquet"))
    if not shards:
        raise InputError(
            f"{folder}: no data set there (no shard-*.parquet); make one with `lcd collect --out {folder}`"
        )
    return Dataset(folder, read_header(shards[0]).configuration)


def _number(path: Path) -> int:
    digits = path.stem.removeprefix("shard-")
    if not digits.isdecimal():
        raise InputError(f"{path}: not a shard of `lcd collect`, which has a number; move it out of the folder")
    return int(digits)
