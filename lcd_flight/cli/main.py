"""Entry points of `lcd` and `lcd-fly`, and the one place where errors become a line, a JSON object and an exit code."""

from __future__ import annotations

import sys
import tempfile
import traceback
from collections.abc import Sequence
from pathlib import Path

import typer
from typer.exceptions import TyperException

from lcd_flight.cli import (
    bench,
    collect,
    doctor,
    evaluation,
    export,
    fly,
    learning,
    mission,
    monitor,
    plan,
    recover,
    replay,
    reproduction,
    review,
    sim,
)
from lcd_flight.cli.terminal import Terminal
from lcd_flight.errors import LcdError, Outcome

INTERRUPTED = "interrupted; run the same command again to go on"

app = typer.Typer(
    name="lcd",
    help="Plan quadrotor trajectories that this vehicle can really fly, fly them, and see why they went as they did.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.command("fly")(fly.fly)
app.command("check")(mission.check)
app.command("plan")(plan.plan)
app.command("collect")(collect.collect)
app.command("train")(learning.train)
app.command("evaluate")(evaluation.evaluate)
app.command("reproduce")(reproduction.reproduce)
app.command("review")(review.review)
app.command("replay")(replay.replay)
app.command("recover")(recover.recover)
app.command("export")(export.export)
app.command("monitor")(monitor.monitor)
app.command("doctor")(doctor.doctor)
app.command("bench")(bench.bench)
app.add_typer(sim.app, name="sim")

flyer = typer.Typer(
    name="lcd-fly", add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None, help=fly.fly.__doc__
)
flyer.command()(fly.fly)


def lcd(arguments: Sequence[str] | None = None) -> None:
    """Entry point of `lcd`. Exits the process with the outcome's code."""
    sys.exit(run(app, sys.argv[1:] if arguments is None else arguments))


def lcd_fly(arguments: Sequence[str] | None = None) -> None:
    """Entry point of `lcd-fly`, the same as `lcd fly`. Exits the process with the outcome's code."""
    sys.exit(run(flyer, sys.argv[1:] if arguments is None else arguments))


def run(application: typer.Typer, arguments: Sequence[str]) -> int:
    """Run a command line and return its exit code; never raises and never shows a traceback."""
    terminal = Terminal.from_arguments(arguments)
    try:
        code = int(application(args=list(arguments), standalone_mode=False) or 0)
        # typer swallows Ctrl-C and returns its code
        return terminal.fail(Outcome.INTERRUPTED, INTERRUPTED) if code == Outcome.INTERRUPTED.exit_code else code
    except TyperException as error:
        return terminal.fail(Outcome.INVALID_INPUT, f"{error.format_message()} (--help lists the options)")
    except LcdError as error:
        return terminal.fail(error.outcome, str(error))
    except KeyboardInterrupt:
        return terminal.fail(Outcome.INTERRUPTED, INTERRUPTED)
    except BrokenPipeError:
        sys.stderr.close()  # the reader has gone: nothing is left to be said
        return Outcome.INTERRUPTED.exit_code
    except Exception as error:  # noqa: BLE001 - the last boundary before the user
        return terminal.fail(Outcome.INTERNAL_ERROR, _unexpected(error))


def _unexpected(error: Exception) -> str:
    """Keep the traceback in a file and say where, with what a report needs."""
    with tempfile.NamedTemporaryFile("w", prefix="lcd-flight-error-", suffix=".txt", delete=False) as file:
        file.write(" ".join(sys.argv) + "\n" + "".join(traceback.format_exception(error)))
    return f"a fault of lcd-flight: {type(error).__name__}: {error}; details for a report in {Path(file.name)}"
