"""`lcd review LOG...`: figures of merit and the report page of a flight, or several flights side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal
from lcd_flight.errors import InputError, Outcome

if TYPE_CHECKING:
    from collections.abc import Sequence

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
    flights = [_read(terminal, path) for path in logs]
    _write_others(terminal, flights, {"picture": picture, "csv": csv, "parquet": parquet, "rerun": rerun})
    return _review(terminal, flights[0], out) if len(flights) == 1 else _compare(terminal, flights, out)


def _read(terminal: Terminal, path: Path) -> FlightLog:
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
    terminal.status(f"reading {path}, {path.stat().st_size / 1e6:.1f} MB")
    log = read_log(path)
    if not log.complete:
        terminal.warn(f"{path} was cut: the end of the flight may be missing")
    return log


def _review(terminal: Terminal, flight: FlightLog, out: Path | None) -> int:
    from lcd_flight.review import write_page

    terminal.status("measuring and drawing")
    figures = _figures(flight)
    page = write_page(flight, out or flight.path.with_suffix(".html"))
    terminal.line("REVIEW", str(page))
    for key, value in figures.items():
        if key not in _TABLES:
            terminal.detail(f"{key:<28} {_text(value)}")
    return terminal.finish(Outcome.OK, {**figures, "log": str(flight.path), "report": str(page)})


def _compare(terminal: Terminal, flights: Sequence[FlightLog], out: Path | None) -> int:
    from lcd_flight.review import write_comparison

    default = flights[0].path.with_name(f"{flights[0].path.stem}_and_{len(flights) - 1}_more.html")
    terminal.status("measuring and drawing")
    page = write_comparison(flights, out or default)
    figures = [_figures(flight) for flight in flights]
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
        terminal.status(f"writing {path}")
        writers[name](flights[0], path)
        terminal.line(name.upper(), str(path))


def _figures(flight: FlightLog) -> dict[str, Any]:
    """As JSON; how the flight ended is `flight_outcome`, because `outcome` is how the review did."""
    from lcd_flight.review import figures_of

    figures = figures_of(flight).to_json()
    return {"flight_outcome": figures.pop("outcome"), **figures}


def _text(value: object) -> str:
    """A figure for people."""
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list | tuple):
        return ", ".join(_text(item) for item in value)
    return str(value)
