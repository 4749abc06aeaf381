"""`lcd plan --tasks`: many tasks from a file, planned by one method, as polynomials in a file."""

from __future__ import annotations

from pathlib import Path

from lcd_flight.cli.terminal import Terminal, following
from lcd_flight.errors import InputError, Outcome

_MOST_LIKELY_YAW_RAD = 30.0
"""Nearly five turns; headings in degrees soon come to more."""


def plan_tasks(
    terminal: Terminal,
    tasks: Path | None,
    world: str | None,
    out: Path | None,
    method: str,
    *,
    timing: str,
    model: str | None,
    drag: int,
    seed: int,
) -> int:
    """Plan, write, and say what fell back; run again after an interruption, it goes on where it stopped."""
    from lcd_flight import plugins
    from lcd_flight.learning.plan_tasks import TaskPlanning
    from lcd_flight.learning.plan_tasks import plan_tasks as plan_all
    from lcd_flight.learning.task_files import load_tasks
    from lcd_flight.worlds import load_world

    if tasks is None or world is None or out is None:
        raise InputError("many tasks at once need all of --tasks FILE.npz, --world W and --out PLANS.npz")
    if timing not in ("retimed", "fixed"):
        raise InputError(f"--timing {timing}: choose retimed or fixed")
    planning = TaskPlanning(
        world=load_world(world),
        method=method,
        timing="fixed" if timing == "fixed" else "retimed",
        drag=drag,
        model=model,
        seed=seed,
    )
    given = load_tasks(tasks)
    if (turn := float(abs(given.yaws_rad).max())) > _MOST_LIKELY_YAW_RAD:
        terminal.warn(f"{tasks}: yaws go up to {turn:g}; they are read as radians, were degrees meant?")
    with following(terminal, "PLAN") as progress:
        plans = plan_all(given, planning, out, plugins.simulator(), progress)
    fell_back = int(plans.fell_back.sum())
    segments = plans.trajectories.segments
    terminal.line("PLAN", f"{len(given):,} task(s) of {segments} segments by {method} for {world}: {out}")
    if fell_back:
        terminal.warn(f"{fell_back} of {len(given)} tasks: the solve found nothing better than minimum snap")
    facts = {"tasks": len(given), "segments": segments, "method": method, "fell_back": fell_back, "out": str(out)}
    return terminal.finish(Outcome.OK, facts)
