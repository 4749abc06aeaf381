"""`lcd plan`: a mission's plan shown, drawn and kept; or many tasks from a file at once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.plan_display import plan_facts, tell_plan
from lcd_flight.cli.terminal import Terminal
from lcd_flight.errors import InputError, Outcome

if TYPE_CHECKING:
    from lcd_flight.api import PreparedFlight

PlanFile = Annotated[
    Path | None, typer.Option("--plan", help="A plan file (`lcd plan MISSION --out FILE`) in place of planning.")
]
NoCache = Annotated[bool, typer.Option("--no-cache", help="Plan anew, and keep nothing for the next time.")]


def plan(
    mission: Annotated[str | None, typer.Argument(metavar="MISSION", help="A mission file, or `demo`.")] = None,
    out: Annotated[
        Path | None, typer.Option(help="Write the plan: a plan file (JSON); with --tasks the polynomials (.npz).")
    ] = None,
    html: Annotated[Path | None, typer.Option(help="Write a page: the plan beside minimum snap.")] = None,
    csv: Annotated[Path | None, typer.Option(help="Write the polynomials as CSV of uav_trajectories.")] = None,
    from_csv: Annotated[
        list[Path] | None, typer.Option(help="Take such polynomials as the plan; once for each trajectory.")
    ] = None,
    plan_file: PlanFile = None,
    no_cache: NoCache = False,
    tasks: Annotated[
        Path | None, typer.Option(help="In place of a MISSION: waypoints (N, K, 3) and yaws (N, K) in a .npz.")
    ] = None,
    world: Annotated[str | None, typer.Option(help="With --tasks: the world that is planned for.")] = None,
    method: Annotated[str, typer.Option(help="With --tasks: the planning method.")] = "learned",
    timing: Annotated[str, typer.Option(help="With --tasks: retimed (at equal total time) or fixed.")] = "retimed",
    model: Annotated[
        str | None, typer.Option(help="With --tasks: learned cost by name or file; the world's otherwise.")
    ] = None,
    drag: Annotated[int, typer.Option(help="With --tasks: drag configuration, 1 to 5.")] = 3,
    seed: Annotated[int, typer.Option(help="With --tasks: of a method's own random choices.", min=0)] = 0,
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Plan a mission and show snap, predicted error and peak thrust beside minimum snap; flies nothing.

    With --tasks FILE.npz --world W --out PLANS.npz: plan many tasks by one method, for flying them elsewhere.
    """
    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    terminal.announce_compilation()
    of_mission = {"--html": html, "--csv": csv, "--from-csv": from_csv, "--plan": plan_file, "MISSION": mission}
    if tasks is not None or world is not None:
        from lcd_flight.cli.plan_tasks import plan_tasks

        _refuse("--tasks", of_mission)
        return plan_tasks(terminal, tasks, world, out, method, timing=timing, model=model, drag=drag, seed=seed)
    if mission is None:
        raise InputError("give a MISSION; or --tasks FILE.npz --world W --out PLANS.npz")
    if plan_file is not None:
        _refuse("--plan", {"--from-csv": from_csv})
    with _drawing_what_is_refused(terminal, mission, html):
        flight = tell_plan(terminal, mission, plan_file=plan_file, csv_files=from_csv or (), cache=not no_cache)
    written = _write(terminal, flight, out=out, html=html, csv=csv)
    return terminal.finish(Outcome.OK, {**plan_facts(flight), **written})


def _refuse(option: str, others: dict[str, Any]) -> None:
    """Say which of two options must go."""
    for other, value in others.items():
        if value:
            raise InputError(f"{option} and {other} exclude each other; leave one out")


@contextmanager
def _drawing_what_is_refused(terminal: Terminal, mission: str, html: Path | None) -> Iterator[None]:
    """A path that breaks the mission's limits is best looked at: its page is written all the same."""
    from lcd_flight.mission import load_mission
    from lcd_flight.mission.airframe import vehicle_of
    from lcd_flight.mission.planned import PathRefusedError
    from lcd_flight.review.plan_page import write_plan_page

    try:
        yield
    except PathRefusedError as error:
        if html is not None:
            loaded = load_mission(mission)
            write_plan_page(loaded, vehicle_of(loaded), error.planned, html, refusal=str(error))
            terminal.line("PLAN", f"refused; what it looks like: {html}")
        raise


def _write(
    terminal: Terminal, flight: PreparedFlight, *, out: Path | None, html: Path | None, csv: Path | None
) -> dict[str, Any]:
    """The files asked for; their places for JSON."""
    from lcd_flight import api

    if out is not None:
        api.save_plan(flight, out)
        where = flight.mission.source.path or "MISSION"
        terminal.detail(f"plan     {out} (fly it: lcd-fly {where} --plan {out})")
    if html is not None:
        from lcd_flight.review.plan_page import write_plan_page

        write_plan_page(flight.mission, flight.vehicle, flight.planned, html)
        terminal.detail(f"picture  {html}")
    csv_files = []
    if csv is not None:
        from lcd_flight.mission.plan_csv import write_csv

        csv_files = write_csv(csv, flight.planned)
        terminal.detail(f"csv      {', '.join(map(str, csv_files))}")
    return {"out": out and str(out), "html": html and str(html), "csv": [str(path) for path in csv_files]}
