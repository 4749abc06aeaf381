"""`lcd recover LOG`: an indexed file of one that was cut or damaged."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal
from lcd_flight.cli.watched import watched
from lcd_flight.errors import Outcome


def recover(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A flight's .mcap file that was cut or damaged.")],
    out: Annotated[Path | None, typer.Option(help="The new file; otherwise NAME.recovered.mcap beside LOG.")] = None,
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Make an indexed file of a cut or damaged log and say what was lost; LOG itself is never changed.

    Replay and review read a cut file as it is; other programs want the index.
    """
    from lcd_flight.record import recover as recovering

    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    found = recovering.condition(log)
    facts = {
        "log": str(log),
        "recovered": None,
        "ticks": found.ticks,
        "duration_s": found.duration_s,
        "missing_ticks": found.missing_ticks,
        "lost_chunks": found.lost_chunks,
        "cut": found.cut,
    }
    if found.whole:
        terminal.line("RECOVER", f"{log} is whole: nothing to be done")
        return terminal.finish(Outcome.OK, facts)
    target = out or log.with_suffix(".recovered.mcap")
    with watched(terminal, "RECOVER", log, "bytes") as advance:
        recovering.recover(log, target, found.lost, advance)
    terminal.line("RECOVER", f"{target}: {found.ticks} ticks, {found.duration_s:.2f} s")
    terminal.detail(f"lost: {found.lost}")
    return terminal.finish(Outcome.OK, {**facts, "recovered": str(target)})
