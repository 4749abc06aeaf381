"""`lcd replay LOG`: the logged inputs through the same tick again, or through another law."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal
from lcd_flight.cli.watched import watched
from lcd_flight.errors import InputError, Outcome

if TYPE_CHECKING:
    from lcd_flight.flight.replay import Comparison, Difference
    from lcd_flight.flight.setup import FlightSetup
    from lcd_flight.record import FlightHeader

CONTROLLER_HELP = "Another control law: its name, or FILE.py:FUNCTION. Shows what it would have commanded."


def replay(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A flight's .mcap file, whole or cut.")],
    controller: Annotated[str | None, typer.Option(help=CONTROLLER_HELP)] = None,
    gains: Annotated[Path | None, typer.Option(help="A YAML file of gains in place of the vehicle's.")] = None,
    csv: Annotated[Path | None, typer.Option(help="Write both setpoints of every tick.")] = None,
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Feed a flight's logged inputs through the tick again and compare what it decides.

    The same law on the same machine gives the same setpoints to the bit; on another machine, within 1e-9 of full thrust
    and 1e-7 rad. Anything else exits with 1. With --controller or --gains a difference is the answer: what would have
    been commanded at the poses of this flight, tick by tick.
    """
    from lcd_flight.flight.replay import compare
    from lcd_flight.record.reader import read_flight

    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    with watched(terminal, "READ", log, "bytes") as advance:
        header, flight = read_flight(log, advance)
    if not flight or flight[0][0].sequence != 0:
        raise InputError(f"{log}: its first tick is missing: a replay begins with it")
    with watched(terminal, "REPLAY", flight, "ticks") as advance:
        found = compare(flight, _setup(header, controller, gains), advance)
    if found.missing_after is not None:
        terminal.warn(f"ticks are missing after tick {found.missing_after}: the comparison ends there")
    if csv is not None:
        _write_csv(csv, found)
    _tell(terminal, found)
    return _verdict(terminal, header, found, other=bool(controller or gains), log=log)


def _setup(header: FlightHeader, controller: str | None, gains: Path | None) -> FlightSetup:
    """The flight's own setup, with another law or other gains where they were given."""
    from lcd_flight import plugins
    from lcd_flight.flight.setup import FlightSetup
    from lcd_flight.worlds.gains import load_gains

    vehicle = header.vehicle
    if gains is not None:
        vehicle = replace(vehicle, flight_gains=load_gains(gains, vehicle.flight_gains))
    return FlightSetup.of(header.plan, vehicle, header.limits, plugins.controller(controller or "flight"))


def _tell(terminal: Terminal, found: Comparison) -> None:
    """How many ticks are the same, and where they part."""
    count = len(found.pairs)
    if found.equal:
        terminal.line("REPLAY", f"{count} ticks, every one the same to the bit")
        return
    first, worst = found.different[0], _worst(found)
    terminal.line("REPLAY", f"{count} ticks, {len(found.different)} otherwise")
    terminal.detail(f"first   {_where(first, found)}")
    terminal.detail(f"most    {_where(worst, found)}: {_apart(worst)}")


def _worst(found: Comparison) -> Difference:
    return max(found.different, key=lambda difference: (difference.thrust_N, difference.angle_rad))


def _where(difference: Difference, found: Comparison) -> str:
    began_ns = found.pairs[0].logged.now_ns
    logged, again = difference.logged, difference.replayed
    phases = logged.phase.value if logged.phase is again.phase else f"{logged.phase.value}, now {again.phase.value}"
    return f"tick {logged.sequence}, {(logged.now_ns - began_ns) * 1e-9:.2f} s, {phases}"


def _apart(difference: Difference) -> str:
    if math.isinf(difference.thrust_N):
        return "only one of the two sends a setpoint"
    return f"{difference.thrust_N:.3g} N and {math.degrees(difference.angle_rad):.3g} deg apart"


def _verdict(terminal: Terminal, header: FlightHeader, found: Comparison, *, other: bool, log: Path) -> int:
    """The JSON object and the exit code."""
    agrees = found.agrees(header.vehicle.max_thrust_N)
    facts: dict[str, Any] = {
        "log": str(log),
        "ticks": len(found.pairs),
        "different": len(found.different),
        "equal": found.equal,
        "within_tolerance": agrees,
        "max_thrust_difference_N": found.thrust_N,
        "max_angle_difference_rad": found.angle_rad,
        "missing_after": found.missing_after,
    }
    if other or agrees:
        return terminal.finish(Outcome.OK, facts)
    written, commit = header.versions.get("lcd-flight", "?"), header.versions.get("commit", "")
    return terminal.fail(
        Outcome.DIFFERENT,
        f"{log}: the tick decides otherwise than it did in flight (written by lcd-flight {written} {commit[:12]})",
        facts,
    )


def _write_csv(path: Path, found: Comparison) -> None:
    """Time since the first tick, phase, and thrust and attitude of both setpoints; empty where nothing was sent."""
    import csv

    columns = ["thrust_N", "qx", "qy", "qz", "qw"]
    head = ["time_s", "phase", *(f"{which}_{name}" for which in ("logged", "replayed") for name in columns)]
    began_ns = found.pairs[0].logged.now_ns
    try:
        with path.open("w", newline="", encoding="utf-8") as stream:
            writer = csv.writer(stream)
            writer.writerow(head)
            for pair in found.pairs:
                row = [setpoint for tick in (pair.logged, pair.replayed) for setpoint in _numbers(tick.setpoint)]
                writer.writerow([(pair.logged.now_ns - began_ns) / 1e9, pair.logged.phase.value, *row])
    except OSError as error:
        raise InputError(f"--csv {path}: cannot be written: {error.strerror}") from error


def _numbers(setpoint: Any) -> tuple[float | str, ...]:
    return ("",) * 5 if setpoint is None else (setpoint.thrust_N, *setpoint.q_WB)
