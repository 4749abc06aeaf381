"""`lcd review LOG`: figures of merit and the report page of a flight."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal
from lcd_flight.errors import Outcome


def review(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A flight's .mcap file, whole or cut.")],
    out: Annotated[Path | None, typer.Option(help="The page to write; beside the log otherwise.")] = None,
    picture: Annotated[Path | None, typer.Option(help="Also write a still of the path, as SVG.")] = None,
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Write the review page of a flight and show its figures of merit."""
    from lcd_flight.record import read_log
    from lcd_flight.review.figures import figures_of
    from lcd_flight.review.page import write_page
    from lcd_flight.review.path_figure import write_path_figure

    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    flight = read_log(log)
    figures = figures_of(flight).to_json()
    page = write_page(flight, out or log.with_suffix(".html"))
    if picture is not None:
        write_path_figure(flight, picture)
    terminal.line("REVIEW", str(page))
    for key, value in figures.items():
        if key == "phases":
            continue  # a table of its own on the page
        terminal.detail(f"{key:<28} {_text(value)}")
    return terminal.finish(Outcome.OK, {**figures, "log": str(log), "report": str(page)})


def _text(value: object) -> str:
    """A figure for people."""
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list | tuple):
        return ", ".join(_text(item) for item in value)
    return str(value)
