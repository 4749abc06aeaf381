"""`lcd doctor --link URI`: what is at the other end, and whether it could fly; changes nothing."""

from __future__ import annotations

from typing import Annotated

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal
from lcd_flight.errors import Outcome


def doctor(
    link: Annotated[str, typer.Option(help="Link URI, e.g. radio://0/80/2M/E7E7E7E7E7.", metavar="URI")],
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Connect, list what is there (firmware, platform, parameters, battery, rates), and change nothing.

    Exit codes: 0 nothing speaks against flying, 2 wrong input, 3 something does, or nobody answers.
    """
    import asyncio

    from lcd_flight.flight.clock import RealClock
    from lcd_flight.plugins.links import inspect_link

    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    terminal.line("CONNECT", link)
    found = asyncio.run(inspect_link(link, RealClock()))
    terminal.line("FOUND", found.description)
    for name, text in found.facts:
        terminal.detail(f"{name:<10}{text}")
    for text in found.differences:
        terminal.line("PARAMETER", text)
    facts = {
        "description": found.description,
        **dict(found.facts),
        "differences": found.differences,
        "problems": found.problems,
    }
    if found.problems:
        return terminal.fail(Outcome.REFUSED, "\n".join(found.problems), facts)
    terminal.line("DOCTOR", "nothing speaks against flying")
    return terminal.finish(Outcome.OK, facts)
