"""`lcd reproduce`: the paper's table and figures in one command."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import LINE_PERIOD_S, Terminal
from lcd_flight.errors import InputError, Outcome

if TYPE_CHECKING:
    from lcd_flight.learning.stages import StageProgress


def reproduce(
    out: Annotated[
        Path | None, typer.Option(help="Folder of the page and its figures: docs/results; below --work with --quick.")
    ] = None,
    work: Annotated[Path, typer.Option(help="Folder of data, models and flights; what is there is kept.")] = Path(
        "data/reproduce"
    ),
    count: Annotated[int | None, typer.Option(help="Tasks of each world; 1000 otherwise.", min=2)] = None,
    noise_seeds: Annotated[int, typer.Option(help="Flights of each plan.", min=1)] = 3,
    seed: Annotated[str, typer.Option(help="Of tasks and noise: a number, or fresh.")] = "fresh",
    recipe: Annotated[str, typer.Option(help="How models are trained: small, medium or full.")] = "medium",
    models: Annotated[str, typer.Option(help="train them, or evaluate those that are shipped.")] = "train",
    per_drag: Annotated[bool, typer.Option("--per-drag", help="A model for each drag configuration.")] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Every step on next to nothing, to try them out.")] = False,
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Make the paper's table and figures from nothing: data, training, evaluation, and a page of results.

    Run again after an interruption, it goes on where it stopped.
    """
    from lcd_flight import plugins
    from lcd_flight.learning.freshness import about_seed, seed_of
    from lcd_flight.learning.reproduce import reproduce as reproduce_all
    from lcd_flight.learning.reproduction_settings import COUNT, QUICK_COUNT, ReproduceSettings
    from lcd_flight.learning.results_page import write_results

    if models not in ("train", "shipped"):
        raise InputError(f"--models {models}: choose train or shipped")
    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    terminal.announce_compilation()
    settings = ReproduceSettings(
        seed=seed_of(seed),
        count=count or (QUICK_COUNT if quick else COUNT),
        noise_seeds=noise_seeds,
        recipe=recipe,
        per_drag=per_drag,
        models="shipped" if models == "shipped" else "train",
        quick=quick,
    )
    terminal.line("SEED", about_seed(settings.seed))
    simulator = plugins.simulator()
    result = reproduce_all(settings, work, simulator, _teller(terminal))
    page = write_results(result, out or (work / "quick" / "results" if quick else Path("docs/results")), simulator)
    terminal.line("RESULTS", f"{page}, in {result.seconds / 60.0:.0f} min")
    return terminal.finish(Outcome.OK, {"page": str(page), "seed": settings.seed, "seconds": result.seconds})


def _teller(terminal: Terminal) -> Callable[[StageProgress], None]:
    """A line for each stage and, within long ones, every ten seconds; for a person a status that changes."""
    shown_stage, shown_s = 0, 0.0

    def tell(progress: StageProgress) -> None:
        nonlocal shown_stage, shown_s
        text = f"{progress.stage}/{progress.stages} {progress.name}, about {_left(progress.seconds_left)} left in all"
        if progress.within:
            within = progress.within
            text += f": {within.done:,}/{within.total:,} {within.unit} {within.note}"
        new = progress.stage != shown_stage
        if new or (time.monotonic() - shown_s >= LINE_PERIOD_S and not terminal.interactive):
            shown_stage, shown_s = progress.stage, time.monotonic()
            terminal.line("REPRODUCE", text)
        elif terminal.interactive:
            terminal.status(text)

    return tell


def _left(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90.0 else f"{seconds / 60.0:.0f} min"
