"""`lcd-fly MISSION`: check, plan, rehearse, connect, fly, land, review; the main job."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lcd_flight.cli.mission import MissionArgument
from lcd_flight.cli.options import LIVE_ENDPOINT, Json, NoColor, Quiet
from lcd_flight.cli.plan import NoCache, PlanFile
from lcd_flight.cli.plan_display import plan_facts, tell_plan
from lcd_flight.cli.terminal import Terminal
from lcd_flight.errors import InputError, Outcome

if TYPE_CHECKING:
    from lcd_flight.api import FlownMission, PreparedFlight
    from lcd_flight.flight.session import FlightOptions
    from lcd_flight.mission import Mission
    from lcd_flight.rehearsal.verdict import Rehearsal


def fly(
    mission: MissionArgument,
    sim: Annotated[bool, typer.Option("--sim", help="Fly on sim:// whatever the mission's link.")] = False,
    link: Annotated[str | None, typer.Option(help="Link URI in place of the mission's.")] = None,
    fast: Annotated[bool, typer.Option("--fast", help="In virtual time, on the simulator only.")] = False,
    no_arm: Annotated[bool, typer.Option("--no-arm", help="Everything but the motors.")] = False,
    by_hand: Annotated[
        bool, typer.Option("--by-hand", help="With --no-arm: check pose and axes with the vehicle in the hand.")
    ] = False,
    plan_file: PlanFile = None,
    no_cache: NoCache = False,
    plan_only: Annotated[bool, typer.Option("--plan-only", help="Stop after the rehearsal.")] = False,
    rehearse: Annotated[int | None, typer.Option(help="Runs of the rehearsal.", min=1, max=10_000)] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Arm without asking.")] = False,
    log: Annotated[Path | None, typer.Option(help="Folder for log and report.", metavar="DIR")] = None,
    live: Annotated[str, typer.Option(help="Where `lcd monitor` may watch, or `off`.")] = LIVE_ENDPOINT,
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Plan, rehearse, fly and review a mission.

    In flight: l lands, space stops the motors, r goes on after a brake; Ctrl-C lands, a second one descends level, a
    third one stops the motors. Exit codes: 0 landed, 2 wrong input, 3 refused before arming, 4 ended early but landed,
    5 crashed or cut.
    """
    from lcd_flight.mission import load_mission

    if sim and link is not None:
        raise InputError("--sim and --link exclude each other; leave one out")
    if by_hand and not no_arm:
        raise InputError("--by-hand is done with the motors off: add --no-arm")
    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    terminal.announce_compilation()
    loaded = load_mission(mission)
    options = _options(terminal, loaded, "sim://" if sim else link, fast=fast, arm=not no_arm, yes=yes)
    options = dataclasses.replace(options, by_hand=by_hand)
    flight = tell_plan(terminal, loaded, plan_file=plan_file, cache=not no_cache)
    rehearsal = _rehearse(terminal, flight, rehearse)
    facts = {"predicted_max_error_m": rehearsal.max_error_m, "log": None, "report": None}
    if not rehearsal.passed:
        return terminal.fail(Outcome.REFUSED, rehearsal.refusal, facts)
    if plan_only:
        return terminal.finish(Outcome.OK, {**plan_facts(flight), **facts})
    flown = _fly(terminal, flight, rehearsal, options, log, None if live == "off" else live)
    return _finish(terminal, flown)


def _rehearse(terminal: Terminal, flight: PreparedFlight, runs: int | None) -> Rehearsal:
    from lcd_flight import api

    rehearsal = api.rehearse(flight, runs)
    terminal.line("REHEARSE", rehearsal.text)
    return rehearsal


def _options(
    terminal: Terminal, mission: Mission, uri: str | None, *, fast: bool, arm: bool, yes: bool
) -> FlightOptions:
    """How the session is to fly; who agrees to arming."""
    import sys

    from lcd_flight.flight.operator import Operator
    from lcd_flight.flight.session import FlightOptions

    async def agree(operator: Operator) -> bool:
        if yes or not mission.safety.confirm:
            return True
        terminal.ask("arm motors? [y/N] ")
        return await operator.agreed()

    anybody = yes or not mission.safety.confirm or sys.stdin.isatty()
    asked = not _simulated(mission, uri) and anybody
    return FlightOptions(uri=uri, fast=fast, arm=arm, confirm=agree if asked else None)


def _simulated(mission: Mission, uri: str | None) -> bool:
    """Whether the link leads to the simulator.

    Raises:
        InputError: there is no such link; where the mission names it, with the line.
    """
    from lcd_flight.flight.session import is_simulated

    try:
        return is_simulated(uri or mission.vehicle.uri)
    except InputError as error:
        where = f"--link {uri}" if uri else mission.place("vehicle", "uri")
        raise InputError(f"{where}: {error}") from error


def _fly(
    terminal: Terminal,
    flight: PreparedFlight,
    rehearsal: Rehearsal,
    options: FlightOptions,
    log: Path | None,
    live: str | None,
) -> FlownMission:
    from lcd_flight import api
    from lcd_flight.cli.flight_display import FlightDisplay

    with FlightDisplay(terminal) as display:
        return api.fly(flight, rehearsal, options, log_folder=log, live=live, progress=display)


def _finish(terminal: Terminal, flown: FlownMission) -> int:
    """The summary, the JSON object and the exit code."""
    result = flown.result
    for note in result.notes:
        terminal.warn(note)
    if flown.log_statistics.dropped or flown.log_statistics.error:
        terminal.warn(
            f"the log is not whole: {flown.log_statistics.dropped} ticks missing, {flown.log_statistics.error or ''}"
        )
    _summarise(terminal, flown)
    facts = _facts(flown)
    if result.outcome in (Outcome.LANDED, Outcome.OK):
        return terminal.finish(result.outcome, facts)
    return terminal.fail(result.outcome, result.reason or f"ended in {result.phase}", facts)


def _summarise(terminal: Terminal, flown: FlownMission) -> None:
    figures, timing = flown.figures, flown.result.figures
    text = str(flown.result.outcome)
    if figures.position_rmse_m is not None:
        text += f"   RMSE {figures.position_rmse_m:.2f} m"
    if figures.overall_max_error_m is not None:
        text += f"  max {figures.overall_max_error_m:.2f} m"
    if figures.waypoint_errors_m:
        reached = [error for error in figures.waypoint_errors_m if error is not None]
        text += f"  waypoints {len(reached)}/{len(figures.waypoint_errors_m)}"
        text += f" (worst {max(reached):.2f} m)" if reached else ""
    if figures.saturation_share is not None:
        text += f"  saturation {figures.saturation_share:.1%}"
    terminal.line("SUMMARY", text)
    terminal.detail(
        f"loop {timing.ticks} ticks, {timing.missed} missed, lateness p50 {timing.lateness_ms(0.5):.2f} ms, "
        f"p99 {timing.lateness_ms(0.99):.2f} ms, max {timing.lateness_ms(1.0):.2f} ms"
    )
    if figures.predicted_max_error_m is not None and figures.overall_max_error_m is not None:
        terminal.detail(
            f"rehearsed / flown max error: {figures.predicted_max_error_m:.2f} / {figures.overall_max_error_m:.2f} m"
        )
    terminal.detail(f"log    {flown.log} ({flown.log.stat().st_size / 1e6:.1f} MB, opens in Foxglove)")
    if flown.report is not None:
        terminal.detail(f"report {flown.report}")


def _facts(flown: FlownMission) -> dict[str, Any]:
    """What `--json` says of a flight: the RMSE is that of the trajectories, the largest error that of the flight."""
    figures, timing = flown.figures, flown.result.figures
    return {
        "reason": flown.result.reason,
        "position_rmse_m": figures.position_rmse_m,
        "max_position_error_m": figures.overall_max_error_m,
        "waypoint_errors_m": figures.waypoint_errors_m,
        "ticks": timing.ticks,
        "missed_ticks": timing.missed,
        "lateness_p50_ms": timing.lateness_ms(0.5),
        "lateness_p99_ms": timing.lateness_ms(0.99),
        "lateness_max_ms": timing.lateness_ms(1.0),
        "saturation_share": figures.saturation_share,
        "predicted_max_error_m": figures.predicted_max_error_m,
        "log": str(flown.log),
        "report": None if flown.report is None else str(flown.report),
    }
