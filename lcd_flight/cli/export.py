"""`lcd export LOG`: a flight for other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal
from lcd_flight.cli.watched import watched
from lcd_flight.errors import InputError, Outcome


def export(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A flight's .mcap file, whole or cut.")],
    ros2: Annotated[bool, typer.Option("--ros2", help="A ROS 2 bag: a folder with an MCAP file.")] = False,
    out: Annotated[Path | None, typer.Option(help="Where to; otherwise beside LOG.")] = None,
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Write a flight in the form of other tools.

    Series as CSV or Parquet come from `lcd review`; Foxglove and Rerun open LOG itself.
    """
    from lcd_flight.record.reader import read_flight
    from lcd_flight.record.ros_bag import write_bag

    if not ros2:
        raise InputError("nothing to export: choose --ros2")
    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    with watched(terminal, "READ", log, "bytes") as advance:
        header, flight = read_flight(log, advance)
    if not flight:
        raise InputError(f"{log}: describes a flight but holds no tick: there is nothing to export")
    folder = out or log.with_name(f"{log.stem}_ros2")
    with watched(terminal, "EXPORT", flight, "ticks") as advance:
        write_bag(folder, header, flight, advance)
    terminal.line("EXPORT", f"{folder}: {len(flight)} ticks as a ROS 2 bag")
    return terminal.finish(Outcome.OK, {"log": str(log), "bag": str(folder), "ticks": len(flight)})
