"""`lcd review LOG...`: figures of merit and the report page of a flight, or several flights side by side."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal
from lcd_flight.errors import InputError, Outcome

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lcd_flight.record import FlightLog

_TABLES = ("phases", "segments")
"""Figures that are tables of their own on the page."""


def review(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Flights' .mcap files, whole or cut.")],
    out: Annotated[Path | None, typer.Option(help="The page to write; beside the first log otherwise.")] = None,
    picture: Annotated[Path | None, typer.Option(help="Also write a still of the path, as SVG.")] = None,
    csv: Annotated[Path | None, typer.Option(help="Also write all series, a row a tick, as CSV.")] = None,
    parquet: Annotated[Path | None, typer.Option(help="The same as Parquet (extra `tables`).")] = None,
    rerun: Annotated[Path | None, typer.Option(help="Also write a recording for Rerun, .rrd (extra `rerun`).")] = None,
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Write the review page of a flight and show its figures of merit; of several flights, compare them."""
    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    flights = [_read(path) for path in logs]
    _write_others(terminal, flights, {"picture": picture, "csv": csv, "parquet": parquet, "rerun": rerun})
    return _review(terminal, flights[0], out) if len(flights) == 1 else _compare(terminal, flights, out)


def _read(path: Path) -> FlightLog:
    """The log.

    Raises:
        InputError: there is no such file, or it is no flight log.
    """
    from lcd_flight.record import read_log

    if not path.is_file():
        folder = next((place for place in (path, path.parent) if place.is_dir()), Path("flights"))
        newest = sorted(folder.glob("*.mcap"), key=lambda file: file.stat().st_mtime)
        remedy = f"the newest log in {folder} is {newest[-1]}" if newest else "`lcd-fly` writes them into flights/"
        what = "is a folder" if path.is_dir() else "no such file"
        raise InputError(f"{path}: {what}; give the .mcap file of a flight: {remedy}")
    return read_log(path)


def _review(terminal: Terminal, flight: FlightLog, out: Path | None) -> int:
    from lcd_flight.review import figures_of, write_page

    figures = figures_of(flight).to_json()
    page = _written(out or flight.path.with_suffix(".html"), partial(write_page, flight))
    terminal.line("REVIEW", str(page))
    for key, value in figures.items():
        if key not in _TABLES:
            terminal.detail(f"{key:<28} {_text(value)}")
    return terminal.finish(Outcome.OK, {**figures, "log": str(flight.path), "report": str(page)})


def _compare(terminal: Terminal, flights: Sequence[FlightLog], out: Path | None) -> int:
    from lcd_flight.review import figures_of, write_comparison

    default = flights[0].path.with_name(f"{flights[0].path.stem}_and_{len(flights) - 1}_more.html")
    page = _written(out or default, partial(write_comparison, flights))
    figures = [figures_of(flight).to_json() for flight in flights]
    terminal.line("COMPARE", str(page))
    for number, flight in enumerate(flights, start=1):
        terminal.detail(f"{number}: {flight.path}")
    for key in figures[0]:
        if key not in _TABLES:
            terminal.detail(f"{key:<28} " + "  ".join(f"{_text(row[key]):>14}" for row in figures))
    rows = [{**row, "log": str(flight.path)} for row, flight in zip(figures, flights, strict=True)]
    return terminal.finish(Outcome.OK, {"flights": rows, "report": str(page)})


def _write_others(terminal: Terminal, flights: Sequence[FlightLog], wanted: dict[str, Path | None]) -> None:
    """Write what else was asked for.

    Raises:
        InputError: one file for several flights, or a place that cannot be written to.
        RefusedError: a package that it takes is not installed.
    """
    from lcd_flight.review import write_csv, write_parquet, write_path_figure, write_rerun

    writers = {"picture": write_path_figure, "csv": write_csv, "parquet": write_parquet, "rerun": write_rerun}
    for name, path in wanted.items():
        if path is None:
            continue
        if len(flights) > 1:
            raise InputError(f"--{name} {path}: is one file, {len(flights)} logs were given; review them one by one")
        _written(path, partial(writers[name], flights[0]))
        terminal.line(name.upper(), str(path))


def _written(path: Path, write: Callable[[Path], Any]) -> Path:
    """Write a file.

    Raises:
        InputError: it cannot be written.
    """
    try:
        write(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}; choose another place") from error
    return path


def _text(value: object) -> str:
    """A figure for people."""
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list | tuple):
        return ", ".join(_text(item) for item in value)
    return str(value)
