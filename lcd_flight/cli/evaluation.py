"""`lcd evaluate`: crash rates of planning methods on the same tasks and the same noise."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal, following
from lcd_flight.errors import InputError, Outcome

if TYPE_CHECKING:
    from lcd_flight.learning.evaluate import Evaluation, MethodFigures


def evaluate(
    world: Annotated[str, typer.Option(help="A world's name, e.g. crazyflie-saturated.")],
    count: Annotated[int, typer.Option(help="How many tasks to sample.", min=1)] = 300,
    seed: Annotated[int, typer.Option(help="Of tasks and noise.", min=0)] = 0,
    methods: Annotated[str, typer.Option(help="Names, separated by commas.")] = "minimum-snap,learned",
    tasks: Annotated[Path | None, typer.Option(help="Tasks from a .npz file in place of the sampler.")] = None,
    waypoints: Annotated[
        int | None, typer.Option(help="Waypoints of a sampled task; the world's own otherwise.", min=2)
    ] = None,
    timing: Annotated[str, typer.Option(help="retimed (at equal total time) or fixed.")] = "retimed",
    drag: Annotated[int, typer.Option(help="Drag configuration, 1 to 5.")] = 3,
    noise_seeds: Annotated[int, typer.Option(help="Flights of each plan.", min=1)] = 3,
    model: Annotated[str | None, typer.Option(help="Learned cost by name or file; the world's own otherwise.")] = None,
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Measure how many planned tasks crash: the largest position error above 1.5 m."""
    from dataclasses import replace

    from lcd_flight import plugins
    from lcd_flight.learning.evaluate import EvaluationOptions
    from lcd_flight.learning.evaluate import evaluate as evaluate_methods
    from lcd_flight.learning.task_files import load_tasks
    from lcd_flight.worlds import load_world

    if timing not in ("retimed", "fixed"):
        raise InputError(f"--timing {timing}: choose retimed or fixed")
    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    terminal.announce_compilation()
    where = load_world(world)
    if waypoints is not None:
        where = replace(where, sampler=replace(where.sampler, waypoints=waypoints))
    options = EvaluationOptions(
        seed=seed,
        timing="fixed" if timing == "fixed" else "retimed",
        drag=drag,
        noise_seeds=noise_seeds,
        model=model,
    )
    names = [name.strip() for name in methods.split(",") if name.strip()]
    work = load_tasks(tasks) if tasks else count
    with following(terminal, "EVALUATE") as progress:
        evaluation = evaluate_methods(where, names, work, plugins.simulator(), options, progress)
    _show(terminal, evaluation)
    return terminal.finish(Outcome.OK, evaluation.as_json())


COLUMNS: dict[str, Callable[[MethodFigures], str]] = {
    "crash %": lambda row: f"{row.crash_rate:.1f}",
    "+-": lambda row: "" if row.crash_rate_error is None else f"{row.crash_rate_error:.1f}",
    "max m": lambda row: f"{row.median_max_error_m:.2f}",
    "waypoint m": lambda row: f"{row.median_waypoint_error_m:.2f}",
    "snap x": lambda row: f"{row.median_relative_snap:.2f}",
    "plan ms": lambda row: f"{row.plan_time_ms:.2f}",
}
"""Of the table for people: title and text. Errors are medians over the flights of their largest."""


def _show(terminal: Terminal, evaluation: Evaluation) -> None:
    """The table for people."""
    from rich.table import Table

    if terminal.quiet:
        return
    rows = next(iter(evaluation.methods.values()))
    table = Table(title=f"{evaluation.world}: {rows.tasks} tasks x {rows.noise_seeds} noise seeds")
    table.add_column("method", no_wrap=True)
    for title in COLUMNS:
        table.add_column(title, justify="right", no_wrap=True)
    for name, row in evaluation.methods.items():
        table.add_row(name, *(text(row) for text in COLUMNS.values()))
    terminal.console.print(table)
