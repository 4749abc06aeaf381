"""Options that several commands share."""

from __future__ import annotations

from typing import Annotated

import typer

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object as the last line of standard output.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="Only warnings and errors.")]
NoColor = Annotated[bool, typer.Option("--no-color", help="Plain text.")]

LIVE_ENDPOINT = "tcp://127.0.0.1:5565"
"""Where a flight publishes and `lcd monitor` watches: `lcd_flight.observers.live.ENDPOINT`, which imports more."""
