"""`lcd sim crazyflie`: one for any program that speaks to Crazyflies over UDP (cflib, crazyswarm2, our own link)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal
from lcd_flight.errors import Outcome

if TYPE_CHECKING:
    from lcd_flight.cli.sim_server import Bench


def crazyflie(
    mission: Annotated[
        str | None, typer.Argument(metavar="[MISSION]", help="Take vehicle, place and motion capture from it.")
    ] = None,
    port: Annotated[int, typer.Option(help="UDP port; 0 takes a free one.", min=0, max=65535)] = 19850,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    vehicle: Annotated[str | None, typer.Option(help="Airframe: one that ships or a file.")] = None,
    platform: Annotated[str, typer.Option(help="2.0, 2.1 or 2.1-brushless, which does not arm by itself.")] = "2.1",
    firmware: Annotated[str, typer.Option(help="2026.08, or 2024.10: older protocol and thrust map.")] = "2026.08",
    mocap: Annotated[str | None, typer.Option(help="Where its pose is published; `none` for nowhere.")] = None,
    rigid_body: Annotated[str | None, typer.Option(help="Under which name.")] = None,
    twist: Annotated[bool, typer.Option(help="Publish velocities beside the pose.")] = False,
    seed: Annotated[int, typer.Option(help="Of noise and faults.")] = 0,
    battery: Annotated[float | None, typer.Option(help="V at rest; full otherwise.", min=0.0, max=5.0)] = None,
    drop: Annotated[float, typer.Option(help="Share of datagrams lost, each way.", min=0.0, max=1.0)] = 0.0,
    drop_at: Annotated[int | None, typer.Option(help="Lose just the client's N-th datagram.", min=1)] = None,
    delay_ms: Annotated[float, typer.Option(help="Delay each way.", min=0.0)] = 0.0,
    freeze: Annotated[float | None, typer.Option(help="s after the first thrust: silence both ways.", min=0.0)] = None,
    freeze_ms: Annotated[float, typer.Option(help="How long the silence lasts.", min=0.0)] = 3000.0,
    die: Annotated[float | None, typer.Option(help="s after the first thrust: all power is lost.", min=0.0)] = None,
    upright: Annotated[float | None, typer.Option(help="s after a crash: put it on its feet.", min=0.0)] = None,
    seconds: Annotated[float | None, typer.Option(help="End by itself after so long.", min=0.0)] = None,
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Serve a simulated Crazyflie on UDP and publish its pose as motion capture would; Ctrl-C ends it."""
    from lcd_flight.cli.sim_server import bench_of, serve

    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    bench: Bench = bench_of(mission, vehicle, mocap, rigid_body, seed)
    options = {
        "platform": platform,
        "firmware": firmware,
        "twist": twist,
        "battery_V": battery,
        "drop": drop,
        "drop_at": drop_at,
        "delay_ms": delay_ms,
        "freeze_s": freeze,
        "freeze_ms": freeze_ms,
        "die_s": die,
        "upright_s": upright,
    }
    told = serve("crazyflie", f"{host}:{port}", _as_text(options), bench, terminal, seconds)
    return terminal.finish(Outcome.OK, told)


def _as_text(options: dict[str, Any]) -> dict[str, str]:
    """Options as they stand in a URI; what was not given is left out."""
    return {name: str(value).lower() for name, value in options.items() if value is not None}
