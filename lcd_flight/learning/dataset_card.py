"""The data set's card, `README.md` beside the shards: what they are, where they come from, how to read them."""

from __future__ import annotations

from lcd_flight.files import write_durably
from lcd_flight.learning.dataset import Dataset
from lcd_flight.learning.manifest import NAME, Manifest
from lcd_flight.learning.schema import COLUMNS, SCHEMA_VERSION

CARD = "README.md"
_BAR = "\\|"

_TEXT = """# Simulated quadrotor flights: {world}

{rows:,} rollouts in {shards} shards, made by `lcd collect`: polynomial trajectories through waypoints, each flown once
in closed loop in simulation, and the tracking errors that came of it. Schema version {schema}, configuration {hash}.

| | |
|---|---|
| world | {world}, version {version}, {loop} loop, vehicle {vehicle} |
| tasks | {waypoints} waypoints, mean speed {speed:g} m/s, seed {seed}; {short_yaw:.0%} turn by the short way |
| drag configurations | {drags} |
| sources | {sources} |
| crashed | {crashed:.2%}, of which {invalid:.2%} of all rows left the model's validity |
| flown by | {flown_by} |

`{manifest}` has each shard's rows, size and SHA-256 and the whole configuration. Both files can be made again from the
shards: run the same `lcd collect` again.

## Columns

S segments, so S + 1 waypoints. Errors are sampled once in a control step of 10 ms.

| column | type | unit | meaning |
|---|---|---|---|
{columns}

## Reading it

    import pyarrow.dataset
    rows = pyarrow.dataset.dataset(".", format="parquet", exclude_invalid_files=True).to_table()

`lcd_flight.learning.dataset.open_dataset(folder)` reads shard by shard and verifies checksums;
`lcd_flight.learning.rebuild.trajectories(world, seed, plans)` gives the polynomials that were flown.
"""


def write_card(dataset: Dataset, manifest: Manifest) -> None:
    """Write the card, whole or not at all.

    Raises:
        InputError: it cannot be written.
    """
    write_durably(dataset.folder / CARD, card_text(dataset, manifest).encode())


def card_text(dataset: Dataset, manifest: Manifest) -> str:
    """The card; a function of the shards alone."""
    configuration = dataset.configuration
    collected = configuration.get("base", configuration)  # a training's rounds have theirs around it
    world, totals = collected["world"], manifest.totals()
    rows = totals["rows"]
    shares = (f"{name} {count:,} ({count / rows:.1%})" for name, count in totals["sources"].items())
    return _TEXT.format(
        world=world["name"],
        version=world["version"],
        loop=world["loop"],
        vehicle=world["base_vehicle"]["name"],
        speed=world["speed"],
        waypoints=world["sampler"]["waypoints"],
        seed=collected["seed"],
        short_yaw=collected["short_yaw_share"],
        drags=", ".join(map(str, collected["drags"])),
        rows=rows,
        shards=len(manifest.entries),
        schema=SCHEMA_VERSION,
        hash=dataset.hash,
        sources=", ".join(shares),
        crashed=totals["crashed"] / rows,
        invalid=totals["invalid"] / rows,
        flown_by="; ".join(sorted({_told(entry.flown_by) for entry in manifest.entries})),
        manifest=NAME,
        columns=column_table(),
    )


def column_table() -> str:
    """The rows of the table of columns, as the card and the documentation show them."""
    return "\n".join(
        f"| {c.name} | {c.type}{f'[{c.shape}]' if c.shape else ''} | {c.unit} | {c.meaning.replace('|', _BAR)} |"
        for c in COLUMNS
    )


def _told(flown_by: dict[str, object]) -> str:
    versions = flown_by["versions"]
    assert isinstance(versions, dict)  # noqa: S101 - as `fingerprint.origin` made it
    return ", ".join([*(f"{name} {number}" for name, number in versions.items()), f"processor {flown_by['processor']}"])
