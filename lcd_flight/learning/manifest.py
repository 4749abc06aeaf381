"""What a folder holds, in two files beside the shards: `manifest.json` for programs, `README.md` for people.

Both are made from the shards and can be made again from them; nothing is read from them but the checksums, by which
a shard that was changed since it was written is found.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from lcd_flight.files import write_durably
from lcd_flight.learning.dataset import Dataset
from lcd_flight.learning.fingerprint import Description
from lcd_flight.learning.schema import SCHEMA_VERSION
from lcd_flight.learning.shard_file import ShardHeader
from lcd_flight.model import InputError

NAME = "manifest.json"


@dataclass(frozen=True, slots=True)
class Entry:
    """One shard."""

    file: str
    rows: int
    sources: dict[str, int]
    """Rows of each source."""
    crashed: int
    invalid: int
    """Rows that left the model's validity; they count as crashed, too."""
    flown_by: Description
    """Versions and processor."""
    size_bytes: int
    sha256: str


class Manifest:
    """The shards of a data set that were looked through, with their checksums."""

    def __init__(self, dataset: Dataset) -> None:
        """Look through all shards in the folder.

        Raises:
            InputError: one of them is damaged, of another configuration, or was changed since it was written.
        """
        self._dataset = dataset
        self._entries: dict[int, Entry] = {}
        known = _known_checksums(dataset.folder / NAME)
        for number in dataset.numbers():
            entry = self._look_at(number)
            if known.get((entry.file, entry.rows), entry.sha256) != entry.sha256:
                path = dataset.path(number)
                remedy = "delete it and run the same `lcd collect` again, it makes what is missing"
                raise InputError(f"{path}: damaged (not what {NAME} says was written); {remedy}")

    def rows(self, number: int) -> int:
        """Of shard `number`; 0 where there is none."""
        return self._entries[number].rows if number in self._entries else 0

    @property
    def entries(self) -> list[Entry]:
        """In the order of their numbers."""
        return [self._entries[number] for number in sorted(self._entries)]

    def add(self, number: int) -> None:
        """Take in a shard that was just written.

        Raises:
            InputError: it is damaged.
        """
        self._look_at(number)

    def write(self) -> None:
        """Write `manifest.json`, whole or not at all.

        Raises:
            InputError: it cannot be written.
        """
        write_durably(self._dataset.folder / NAME, (json.dumps(self.as_json(), indent=1) + "\n").encode())

    def as_json(self) -> dict[str, Any]:
        """All of it."""
        return {
            "schema_version": SCHEMA_VERSION,
            "hash": self._dataset.hash,
            **self.totals(),
            "shards": [asdict(entry) for entry in self.entries],
            "configuration": self._dataset.configuration,
        }

    def totals(self) -> dict[str, Any]:
        """See `totals`."""
        return totals(self.entries)

    def _look_at(self, number: int) -> Entry:
        header, path = self._dataset.header(number), self._dataset.path(number)
        content = path.read_bytes()
        self._entries[number] = Entry(
            file=path.name,
            rows=header.rows,
            sources=header.sources,
            crashed=header.crashed,
            invalid=header.invalid,
            flown_by=header.flown_by,
            size_bytes=len(content),
            sha256=hashlib.sha256(content).hexdigest(),
        )
        return self._entries[number]


def totals(shards: Sequence[Entry | ShardHeader]) -> dict[str, Any]:
    """Rows, rows of each source, crashes, and runs that left the model's validity."""
    sources: Counter[str] = Counter()
    for shard in shards:
        sources.update(shard.sources)
    sums = {key: sum(getattr(shard, key) for shard in shards) for key in ("rows", "crashed", "invalid")}
    return {**sums, "sources": dict(sorted(sources.items()))}


def _known_checksums(path: Path) -> dict[tuple[str, int], str]:
    """By file and rows; nothing where there is no manifest, or one that cannot be read: it is made again."""
    try:
        shards = json.loads(path.read_bytes())["shards"]
        return {(shard["file"], shard["rows"]): shard["sha256"] for shard in shards}
    except (OSError, ValueError, KeyError, TypeError):
        return {}
