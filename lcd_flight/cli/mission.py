"""`lcd check`: a mission before it is planned."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal
from lcd_flight.errors import InputError, Outcome

if TYPE_CHECKING:
    from lcd_flight.mission import Mission

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


def tell_mission(terminal: Terminal, mission: Mission) -> None:
    """The line of the check."""
    from lcd_flight.mission.hints import hints

    facts = mission_facts(mission)
    terminal.line(
        "CHECK",
        f"mission ok: {mission.name}, {facts['waypoints']} waypoints, {facts['length_m']:.1f} m, "
        f"waypoints {facts['fence_clearance_m']:.2f} m or more inside the fence, path not planned yet",
    )
    for hint in hints(mission):
        terminal.warn(hint)


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
