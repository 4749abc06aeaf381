"""`lcd sim mavlink`: a PX4 or ArduPilot vehicle for programs that speak MAVLink (mavsdk, pymavlink, our own link)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal
from lcd_flight.errors import Outcome

if TYPE_CHECKING:
    from lcd_flight.cli.sim_server import Bench

VEHICLE = "x500"


def mavlink(
    mission: Annotated[
        str | None, typer.Argument(metavar="[MISSION]", help="Take vehicle, place and motion capture from it.")
    ] = None,
    flavour: Annotated[str | None, typer.Option(help="px4 or ardupilot; that of the mission, otherwise px4.")] = None,
    port: Annotated[
        int | None,
        typer.Option(help="UDP port that clients listen on, 14540; with --tcp 5760.", min=0, max=65535),
    ] = None,
    host: Annotated[str, typer.Option(help="Where they are.")] = "127.0.0.1",
    tcp: Annotated[bool, typer.Option(help="Listen on TCP instead, as ArduPilot's simulation on 5760.")] = False,
    vehicle: Annotated[str | None, typer.Option(help="Airframe: one that ships or a file.")] = None,
    mocap: Annotated[str | None, typer.Option(help="Where its pose is published; `none` for nowhere.")] = None,
    rigid_body: Annotated[str | None, typer.Option(help="Under which name.")] = None,
    twist: Annotated[bool, typer.Option(help="Publish velocities beside the pose.")] = False,
    own_mocap: Annotated[bool, typer.Option(help="Its estimator is fed by itself, without ODOMETRY.")] = False,
    boot: Annotated[float | None, typer.Option(help="s until it can be armed; 2, ArduPilot 20.", min=0.0)] = None,
    defaults: Annotated[str, typer.Option(help="Parameters: ready for external poses, or factory.")] = "ready",
    key_file: Annotated[str | None, typer.Option(help="Signing key; or LCD_MAVLINK_KEY.")] = None,
    extra: Annotated[
        list[str] | None,
        typer.Option("--with", metavar="NAME=VALUE", help="A fault or another option of the vehicle, see the docs."),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of noise and faults.")] = 0,
    seconds: Annotated[float | None, typer.Option(help="End by itself after so long.", min=0.0)] = None,
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Serve a simulated PX4 or ArduPilot vehicle and publish its pose as motion capture would; Ctrl-C ends it."""
    from lcd_flight.cli.sim_server import bench_of, serve

    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    bench: Bench = bench_of(mission, vehicle or (None if mission else VEHICLE), mocap, rigid_body, seed)
    options = {
        "flavour": flavour or _flavour_of(mission),
        "twist": twist,
        "own_mocap": own_mocap,
        "boot_s": boot,
        "defaults": defaults,
        "key_file": key_file,
    }
    address = f"{'tcp:' if tcp else ''}{host}:{_port(port, tcp)}"
    told = serve("mavlink", address, {**_as_text(options), **_extras(extra or [])}, bench, terminal, seconds)
    return terminal.finish(Outcome.OK, told)


def _port(port: int | None, tcp: bool) -> int:
    """As the simulations of PX4 and ArduPilot have it, unless said otherwise."""
    return port if port is not None else (5760 if tcp else 14540)


def _flavour_of(mission: str | None) -> str:
    """What `autopilot=` in the mission's URI says."""
    from urllib.parse import parse_qs, urlsplit

    from lcd_flight.mission import load_mission

    uri = load_mission(mission).vehicle.uri if mission else ""
    return parse_qs(urlsplit(uri).query).get("autopilot", ["px4"])[0]


def _extras(given: list[str]) -> dict[str, str]:
    """`NAME=VALUE` by name; what has no value is refused as an unknown option further on."""
    return {name: value for name, _, value in (pair.partition("=") for pair in given)}


def _as_text(options: dict[str, Any]) -> dict[str, str]:
    """Options as they stand in a URI; what was not given is left out."""
    return {
        name: str(value).lower() if isinstance(value, bool) else str(value)
        for name, value in options.items()
        if value is not None
    }
