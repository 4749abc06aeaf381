"""`lcd monitor`: a flight as it goes on, seen from a process of its own."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Annotated, Any, Protocol

import typer

from lcd_flight.cli.options import LIVE_ENDPOINT, Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal
from lcd_flight.errors import InputError, Outcome

if TYPE_CHECKING:
    from lcd_flight.monitor.foxglove_server import FoxgloveServer
    from lcd_flight.monitor.picture import Picture
    from lcd_flight.monitor.source import LiveSource

WAIT_S = 0.1
OVER_S = 1.5
"""After a flight that has ended is silent for so long, nothing more comes."""
LINE_EACH_S = 1.0
"""A line of status, where nobody sees the view."""


class Screen(Protocol):
    """Where the picture is shown."""

    def __call__(self, picture: Picture, now_s: float) -> None:
        """Show it as it is at `now_s`."""
        ...


def monitor(
    endpoint: Annotated[str, typer.Argument(help="Where the flight publishes.")] = LIVE_ENDPOINT,
    foxglove: Annotated[bool, typer.Option("--foxglove", help="Serve the stream to Foxglove, too.")] = False,
    port: Annotated[int, typer.Option(help="Of the server for Foxglove.", min=0, max=65535)] = 8765,
    until_end: Annotated[bool, typer.Option("--until-end", help="Quit when the flight is over.")] = False,
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Watch a flight: phase, position and error, battery, link, motion capture, timing, findings, messages.

    A flight in real time publishes ten reports a second (`lcd-fly --live`). Watching never slows it. Ctrl-C quits.
    """
    from lcd_flight.monitor.picture import Picture
    from lcd_flight.monitor.source import LiveSource

    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    picture = Picture()
    with ExitStack() as stack:
        server = stack.enter_context(_server(terminal, port)) if foxglove else None
        source = stack.enter_context(LiveSource(endpoint))
        screen = stack.enter_context(_screen(terminal, endpoint))
        try:
            _watch(source, picture, screen, server, until_end=until_end)
        except KeyboardInterrupt:
            pass  # the way to quit
        except ValueError as error:
            raise InputError(f"{endpoint}: {error}") from error
    return terminal.finish(Outcome.OK, _facts(picture))


def _server(terminal: Terminal, port: int) -> FoxgloveServer:
    from lcd_flight.monitor.foxglove_server import HOST, FoxgloveServer

    server = FoxgloveServer(port)
    terminal.line("MONITOR", f"Foxglove: open a connection to ws://{HOST}:{server.port}")
    return server


def _watch(
    source: LiveSource, picture: Picture, screen: Screen, server: FoxgloveServer | None, *, until_end: bool
) -> None:
    """Take what comes and show it, until Ctrl-C, or until the flight is over."""
    while True:
        frame = source.receive(WAIT_S)
        now_s = time.monotonic()
        if frame is not None:
            picture.take(frame, now_s)
            if server is not None:
                server.take(frame)
        screen(picture, now_s)
        over = picture.report is not None and picture.report.tick.phase.over
        if until_end and over and now_s - picture.received_s > OVER_S:
            return


@contextmanager
def _screen(terminal: Terminal, endpoint: str) -> Iterator[Screen]:
    """The view where a person watches, lines for a pipe."""
    from lcd_flight.monitor.view import render

    if not terminal.interactive:
        terminal.line("MONITOR", f"waiting for a flight at {endpoint}")
        yield _Lines(terminal)
        return
    from rich.live import Live

    with Live(console=terminal.console, auto_refresh=False) as live:
        yield lambda picture, now_s: live.update(render(picture, now_s), refresh=True)


class _Lines:
    """Changes as they come, and a line of status each second."""

    def __init__(self, terminal: Terminal) -> None:
        self._terminal = terminal
        self._phase: str | None = None
        self._told = 0
        self._status_s = 0.0

    def __call__(self, picture: Picture, now_s: float) -> None:
        """Tell what is new."""
        from lcd_flight.monitor.view import status

        if picture.report is None or picture.received_s != now_s:
            return
        unseen = min(picture.told - self._told, len(picture.lines))
        for line in list(picture.lines)[len(picture.lines) - unseen :]:
            self._terminal.detail(f"{line.time_s:.1f} s  {line.text}")
        self._told = picture.told
        phase = picture.report.tick.phase.value
        if phase != self._phase or now_s - self._status_s >= LINE_EACH_S:
            self._phase, self._status_s = phase, now_s
            self._terminal.line("MONITOR", status(picture, picture.report))


def _facts(picture: Picture) -> dict[str, Any]:
    """What was seen last."""
    report, header = picture.report, picture.header
    if report is None:
        return {"reports": 0, "name": None, "phase": None}
    telemetry = report.inputs.link.telemetry
    return {
        "reports": picture.reports,
        "name": None if header is None else header.name,
        "phase": report.tick.phase.value,
        "time_s": picture.time_s,
        "max_position_error_m": report.max_error_m,
        "battery_V": None if telemetry is None else telemetry.battery_V,
        "missed_ticks": picture.timing.missed,
    }
