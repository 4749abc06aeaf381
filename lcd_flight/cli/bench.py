"""`lcd bench NAME`: measure against peers, both sides in the same run."""

from __future__ import annotations

import importlib.machinery
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal
from lcd_flight.errors import InputError, Outcome

FOLDER = Path(__file__).parents[2] / "benchmarks"


def bench(
    name: Annotated[str, typer.Argument(help="Which benchmark; without a name, the list of them.")] = "",
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Measure against the peers, which `make bench` installs. A ratio above 1 means that ours is better."""
    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    if not name:
        terminal.line("BENCH", "choose one: " + ", ".join(_names()))
        return terminal.finish(Outcome.OK, {"benchmarks": _names()})
    rows = _measure(_load(name), lambda text: terminal.line("BENCH", text))
    if not quiet:
        _show(terminal, name, rows)
    return terminal.finish(Outcome.OK, {"rows": rows})


def _names() -> list[str]:
    """The benchmarks that there are."""
    names = sorted(path.stem.removeprefix("bench_") for path in FOLDER.glob("bench_*.py"))
    if not names:
        raise InputError(f"no benchmarks at {FOLDER}; they come with the source tree, not with the package: clone it")
    return names


def _load(name: str) -> ModuleType:
    """The benchmark's module."""
    if name not in _names():
        raise InputError(f"no benchmark {name!r}; there are {', '.join(_names())}")
    loader = importlib.machinery.SourceFileLoader(f"bench_{name}", str(FOLDER / f"bench_{name}.py"))
    module = ModuleType(loader.name)
    loader.exec_module(module)
    return module


def _measure(module: ModuleType, report: Callable[[str], None]) -> list[dict[str, Any]]:
    try:
        rows: list[dict[str, Any]] = module.rows(report)
    except ModuleNotFoundError as error:
        raise InputError(f"the peer {error.name} is not installed; `make bench` installs the peers") from error
    return rows


def _show(terminal: Terminal, name: str, rows: list[dict[str, Any]]) -> None:
    """The rows as a table."""
    from rich.table import Table

    table = Table(title=f"lcd bench {name}", caption="ratio above 1: ours is better")
    table.add_column("what")
    for column in ("unit", "ours", "peer", "peer name", "ratio"):
        table.add_column(column, justify="right")
    for row in rows:
        numbers = [_number(row[key]) for key in ("ours", "peer", "ratio")]
        table.add_row(row["what"], row["unit"], numbers[0], numbers[1], row["peer_name"] or "", numbers[2])
    terminal.console.print(table)


def _number(value: float | None) -> str:
    """Four figures, or nothing where there is no peer."""
    return "" if value is None else f"{value:,.0f}" if abs(value) >= 10_000 else f"{value:.4g}"
