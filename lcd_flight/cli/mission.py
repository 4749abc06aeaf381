"""`lcd check` and `lcd plan`: a mission before it flies."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal
from lcd_flight.errors import InputError, Outcome

if TYPE_CHECKING:
    from lcd_flight.api import PreparedFlight
    from lcd_flight.mission import Mission
    from lcd_flight.mission.plan_mission import TrajectorySummary
    from lcd_flight.planning.limits import Peaks

MissionArgument = Annotated[str, typer.Argument(metavar="MISSION", help="A mission file, or `demo`.")]


def check(mission: MissionArgument, json: Json = False, quiet: Quiet = False, no_color: NoColor = False) -> int:
    """Validate a mission without planning or flying: every problem with file, line, key and remedy."""
    from lcd_flight.mission import load_mission

    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    loaded = load_mission(mission)
    tell_mission(terminal, loaded)
    _tell_link(terminal, loaded)
    return terminal.finish(Outcome.OK, mission_facts(loaded))


def _tell_link(terminal: Terminal, mission: Mission) -> None:
    """Warn of a link that is not there: such a mission can still be flown with --sim, and elsewhere."""
    from lcd_flight.plugins.links import parse_uri

    try:
        parse_uri(mission.vehicle.uri)
    except InputError as error:
        terminal.warn(f"{mission.place('vehicle', 'uri')}: {error}")


def plan(mission: MissionArgument, json: Json = False, quiet: Quiet = False, no_color: NoColor = False) -> int:
    """Plan a mission and show snap, predicted error and peak thrust beside minimum snap; flies nothing."""
    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    terminal.announce_compilation()
    flight = tell_plan(terminal, mission)
    return terminal.finish(Outcome.OK, plan_facts(flight))


def tell_plan(terminal: Terminal, mission: str | Mission) -> PreparedFlight:
    """Load and plan, a line for each of the two."""
    from lcd_flight import api
    from lcd_flight.mission import load_mission

    loaded = load_mission(mission) if isinstance(mission, str) else mission
    tell_mission(terminal, loaded)
    began_s = time.perf_counter()
    flight = api.plan(loaded)
    took_ms = (time.perf_counter() - began_s) * 1e3
    for summary in flight.planned.summaries:
        _tell_trajectory(terminal, summary, took_ms)
    if not flight.planned.summaries:
        terminal.line("PLAN", "no trajectory: take-off, holds and landing only")
    return flight


def tell_mission(terminal: Terminal, mission: Mission) -> None:
    """The line of the check."""
    facts = mission_facts(mission)
    terminal.line(
        "CHECK",
        f"mission ok: {mission.name}, {facts['waypoints']} waypoints, {facts['length_m']:.1f} m, "
        f"waypoints {facts['fence_clearance_m']:.2f} m or more inside the fence, path not planned yet",
    )


def mission_facts(mission: Mission) -> dict[str, Any]:
    """What a check knows of a mission."""
    import numpy as np

    from lcd_flight.mission.assemble import trajectory_tasks

    fence = mission.geofence()
    points = [task.waypoints[:, :3] for task in trajectory_tasks(mission)]
    hover = np.add(mission.vehicle.initial_position_m, (0.0, 0.0, mission.actions()[0].height_m))  # type: ignore[union-attr]
    clearances = [fence.clearance_m(tuple(p)) for path in [hover[None], *points] for p in path.tolist()]
    return {
        "mission": mission.name,
        "waypoints": sum(map(len, points)),
        "length_m": float(sum(np.linalg.norm(np.diff(path, axis=0), axis=1).sum() for path in points)),
        "fence_clearance_m": min(clearances),
    }


def plan_facts(flight: PreparedFlight) -> dict[str, Any]:
    """What a plan knows of itself, for JSON."""
    return {
        "mission": flight.mission.name,
        "duration_s": flight.planned.plan.duration_s,
        "trajectories": [_trajectory_facts(summary) for summary in flight.planned.summaries],
    }


def _trajectory_facts(summary: TrajectorySummary) -> dict[str, Any]:
    return {
        "place": summary.place,
        "method": summary.method,
        "fallback": summary.fallback,
        "waypoints": summary.waypoints,
        "duration_s": summary.duration_s,
        "relative_snap": summary.relative_snap,
        "predicted_max_error_m": summary.predicted_max_error_m,
        "minimum_snap_predicted_max_error_m": summary.minimum_snap_predicted_max_error_m,
        **_peak_facts("", summary.peaks),
        **_peak_facts("minimum_snap_", summary.minimum_snap_peaks),
    }


def _peak_facts(prefix: str, peaks: Peaks) -> dict[str, float]:
    return {
        f"{prefix}peak_thrust_ratio": peaks.thrust_ratio.value,
        f"{prefix}peak_speed_m_per_s": peaks.speed.value,
        f"{prefix}peak_tilt_rad": peaks.tilt.value,
    }


def _tell_trajectory(terminal: Terminal, summary: TrajectorySummary, took_ms: float) -> None:
    """Which planner, and what it made better."""
    before, after = summary.minimum_snap_peaks, summary.peaks
    speed = f"peak speed {before.speed.value:.1f} -> {after.speed.value:.1f} m/s"
    thrust = f"peak thrust {before.thrust_ratio.value:.0%} -> {after.thrust_ratio.value:.0%}"
    if summary.fallback is not None:
        terminal.line("PLAN", f"minimum snap, {took_ms:.0f} ms")
        terminal.warn(f"{summary.place}: minimum snap in place of the learned plan: {summary.fallback}")
    elif summary.method == "minimum-snap":
        terminal.line("PLAN", f"minimum snap, {took_ms:.0f} ms")
        terminal.detail(f"peak thrust {after.thrust_ratio.value:.0%}; peak speed {after.speed.value:.1f} m/s")
    else:
        terminal.line("PLAN", f"minimum snap -> {summary.method}, {took_ms:.0f} ms")
        terminal.detail(
            f"predicted max error {summary.minimum_snap_predicted_max_error_m:.2f} -> "
            f"{summary.predicted_max_error_m:.2f} m; {thrust}; {speed}; snap x{summary.relative_snap:.2f}"
        )
