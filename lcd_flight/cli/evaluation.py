"""`lcd evaluate`: crash rates of planning methods on the same tasks and the same noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal, following
from lcd_flight.errors import InputError, Outcome

if TYPE_CHECKING:
    from lcd_flight.learning.evaluation import Evaluation, EvaluationOptions, MethodFigures
    from lcd_flight.learning.evaluation_files import Parts
    from lcd_flight.learning.statistics import PairedDifference
    from lcd_flight.model import Tasks, World

ALL = "all"
Pairs: TypeAlias = list[tuple[str, str]]
"""Methods to compare: the first minus the second."""


def evaluate(
    world: Annotated[str, typer.Option(help="Names of worlds, separated by commas, e.g. crazyflie-saturated.")],
    count: Annotated[int, typer.Option(help="How many tasks to sample.", min=1)] = 300,
    seed: Annotated[str, typer.Option(help="Of tasks and noise: a number, or fresh.")] = "0",
    methods: Annotated[str, typer.Option(help="Names, separated by commas, or all.")] = "minimum-snap,learned",
    tasks: Annotated[Path | None, typer.Option(help="Tasks from a .npz file in place of the sampler.")] = None,
    waypoints: Annotated[
        int | None, typer.Option(help="Waypoints of a sampled task; the world's own otherwise.", min=2)
    ] = None,
    timing: Annotated[str, typer.Option(help="retimed (at equal total time) or fixed.")] = "retimed",
    drag: Annotated[str, typer.Option(help="Drag configurations, e.g. 3 or 1,3,5, or all.")] = "3",
    noise_seeds: Annotated[int, typer.Option(help="Flights of each plan.", min=1)] = 3,
    model: Annotated[str | None, typer.Option(help="Learned cost by name or file; the world's own otherwise.")] = None,
    yaw: Annotated[str, typer.Option(help="as-sampled, or short: every turn by the short way.")] = "as-sampled",
    thrust_scale: Annotated[float, typer.Option(help="Thrust of the vehicle that flies over the one planned for.")] = 1,
    compare: Annotated[list[str] | None, typer.Option(help="Two methods A,B to compare task by task.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for JSON, every flight as Parquet, and figures.")] = None,
    work: Annotated[Path, typer.Option(help="Folder for what is finished, should this be interrupted.")] = Path(
        "data/evaluations"
    ),
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Measure how many planned tasks crash: the largest position error above 1.5 m.

    Run again after an interruption, it goes on where it stopped.
    """
    from lcd_flight.learning.evaluation import EvaluationOptions
    from lcd_flight.learning.evaluation_report import report, write_report
    from lcd_flight.learning.freshness import about_seed, seed_of
    from lcd_flight.learning.task_files import load_tasks

    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    terminal.announce_compilation()
    pairs = [_pair(text) for text in compare or []]
    options = EvaluationOptions(
        seed=seed_of(seed),
        timing="fixed" if _choice("--timing", timing, "retimed", "fixed") == "fixed" else "retimed",
        noise_seeds=noise_seeds,
        model=model,
        yaw="short" if _choice("--yaw", yaw, "as-sampled", "short") == "short" else "as-sampled",
        thrust_share=thrust_scale,
    )
    chosen = [(where, replace(options, drags=_drags(drag, where))) for where in _worlds(world, waypoints)]
    given = load_tasks(tasks) if tasks else count
    terminal.line("SEED", about_seed(options.seed))
    flown = [_flown(terminal, where, methods, given, settings, pairs, work) for where, settings in chosen]
    evaluations = [evaluation for evaluation, _ in flown]
    if out:
        write_report(out, evaluations, pairs)
        terminal.line("OUT", f"{out}: evaluation.json, flights.parquet and figures")
    for _, parts in flown:
        parts.discard()
    return terminal.finish(Outcome.OK, report(evaluations, pairs))


def _flown(
    terminal: Terminal,
    where: World,
    methods: str,
    given: Tasks | int,
    options: EvaluationOptions,
    pairs: Pairs,
    work: Path,
) -> tuple[Evaluation, Parts]:
    """Evaluate in one world, show the table, and keep the parts until all is done."""
    from lcd_flight import plugins
    from lcd_flight.learning.evaluate import evaluate as evaluate_methods
    from lcd_flight.learning.evaluate import problem_of, refusals, tasks_of
    from lcd_flight.learning.evaluation_files import Parts

    simulator = plugins.simulator()
    tasks = tasks_of(where, given, options)
    names = _methods(methods, pairs)
    if methods == ALL:
        refused = refusals(names, problem_of(where, tasks, simulator, options, options.drags[0]))
        names = [name for name in names if name not in refused]
        for name, reason in refused.items():
            terminal.warn(f"{name} is left out: {reason}")
    parts = Parts.of(work, where, tasks, options, simulator)
    with following(terminal, "EVALUATE") as progress:
        evaluation = evaluate_methods(where, names, tasks, simulator, options, progress, parts)
    _show(terminal, evaluation, pairs)
    return evaluation, parts


def _rate(row: MethodFigures) -> str:
    return f"{row.crash_rate:.1f}" + ("" if row.crash_rate_error is None else f" ({row.crash_rate_error:.1f})")


COLUMNS: dict[str, Callable[[MethodFigures], str]] = {
    "crash %": _rate,
    "95 %": lambda row: f"{row.crash_rate_low:.1f}-{row.crash_rate_high:.1f}",
    "max m": lambda row: f"{row.median_max_error_m:.2f}",
    "p95 m": lambda row: f"{row.p95_max_error_m:.2f}",
    "at wp m": lambda row: f"{row.median_waypoint_error_m:.2f}",
    "snap": lambda row: f"{row.median_relative_snap:.1f}",
    "plan ms": lambda row: f"{row.plan_time_ms:.2f}",
}
"""Of the table for people: title and text. Errors: median and 95th percentile over the flights of their largest."""


def _show(terminal: Terminal, evaluation: Evaluation, pairs: Pairs) -> None:
    """The table for people, and the comparisons asked for."""
    from rich.table import Table

    if terminal.quiet:
        return
    rows = next(iter(evaluation.methods.values()))
    drags = ", ".join(map(str, evaluation.options.drags))
    title = f"{evaluation.world}, drag {drags}: {rows.tasks} tasks x {rows.noise_seeds} noise seeds"
    table = Table(title=title, box=None, pad_edge=False)
    table.add_column("method", no_wrap=True)
    for title in COLUMNS:
        table.add_column(title, justify="right", no_wrap=True)
    for name, row in evaluation.methods.items():
        table.add_row(name, *(text(row) for text in COLUMNS.values()))
    terminal.console.print(table)
    for a, b in pairs:
        terminal.line("COMPARE", f"{a} minus {b}: {_difference(evaluation.compare(a, b))}")


def _difference(pair: PairedDifference) -> str:
    error = "" if pair.standard_error is None else f" ({pair.standard_error:.2f})"
    return (
        f"{pair.difference:+.2f}{error} % crashes, better on {pair.tasks_better} tasks and worse on "
        f"{pair.tasks_worse}, p = {pair.p_value:.2g} (sign flips)"
    )


def _methods(text: str, pairs: Pairs) -> list[str]:
    """Those named, and those that are compared."""
    from lcd_flight.learning.methods import METHODS

    named = list(METHODS) if text == ALL else _names(text)
    return list(dict.fromkeys([*named, *(name for pair in pairs for name in pair)]))


def _names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names:
        raise InputError(f"{text!r} holds no name; give names, separated by commas")
    return names


def _pair(text: str) -> tuple[str, str]:
    names = _names(text)
    if len(names) != 2 or names[0] == names[1]:
        raise InputError(f"--compare {text}: give two methods, separated by a comma")
    return names[0], names[1]


def _worlds(text: str, waypoints: int | None) -> list[World]:
    """Worlds by name, with another number of waypoints where asked for."""
    from lcd_flight.worlds import load_world

    worlds = [load_world(name) for name in dict.fromkeys(_names(text))]
    if waypoints is None:
        return worlds
    return [replace(w, sampler=replace(w.sampler, waypoints=waypoints)) for w in worlds]


def _drags(text: str, world: World) -> tuple[int, ...]:
    if text == ALL:
        return tuple(range(1, len(world.drag_configurations) + 1))
    try:
        return tuple(int(number) for number in _names(text))
    except ValueError:
        raise InputError(f"--drag {text}: give numbers from 1 on, separated by commas, or all") from None


def _choice(option: str, text: str, *choices: str) -> str:
    if text not in choices:
        raise InputError(f"{option} {text}: choose {' or '.join(choices)}")
    return text
