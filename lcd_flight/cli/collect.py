"""`lcd collect`: data sets of simulated flights."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal, following
from lcd_flight.errors import InputError, Outcome

if TYPE_CHECKING:
    from lcd_flight.learning.given import GivenPlans
    from lcd_flight.learning.mix import Mix
    from lcd_flight.learning.spread import Spread
    from lcd_flight.model import World


def collect(
    world: Annotated[str, typer.Option(help="A world's name, e.g. crazyflie-saturated; NAME@SPEED for other m/s.")],
    out: Annotated[Path, typer.Option(help="Folder of the data set; what is there already is kept.")],
    count: Annotated[int, typer.Option(help="How many rollouts.", min=1)] = 1_000_000,
    seed: Annotated[int, typer.Option(help="Of tasks, perturbations and noise.", min=0)] = 0,
    vehicle: Annotated[str | None, typer.Option(help="A vehicle's name or file in place of the world's.")] = None,
    loop: Annotated[str | None, typer.Option(help="paper or flight; the world's own otherwise.")] = None,
    waypoints: Annotated[
        int | None, typer.Option(help="Waypoints of a task; the world's own otherwise.", min=3)
    ] = None,
    sources: Annotated[
        str | None, typer.Option(help="Shares of search, random, optimum, times and plans, e.g. search=0.9,random=0.1.")
    ] = None,
    plans: Annotated[Path | None, typer.Option(help="Given plans (.npz) for the source plans.")] = None,
    short_yaw: Annotated[
        float, typer.Option(help="Share of tasks that turn by the short way.", min=0.0, max=1.0)
    ] = 0.5,
    shard_rows: Annotated[int, typer.Option(help="Most rows of a shard.", min=1)] = 1 << 15,
    threads: Annotated[int, typer.Option(help="Shards made side by side; 0: one on each core.", min=0)] = 0,
    ray: Annotated[str | None, typer.Option(help="Address of a Ray cluster to spread the shards over.")] = None,
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Fly minimum snap, perturbed, searched and given trajectories and keep what became of them.

    Run again after an interruption, it goes on where it stopped. Cores, machines and interruptions leave no trace in
    the bytes.
    """
    from lcd_flight import plugins
    from lcd_flight.learning.collect import collect as collect_rollouts
    from lcd_flight.learning.collect_config import CollectConfig
    from lcd_flight.learning.manifest import totals

    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    where = _world(world, vehicle, loop, waypoints)
    given = _given(plans, where, seed, short_yaw)
    digest = "" if given is None else given.sha256
    config = CollectConfig(
        where, seed, mix=_mix(sources, given, shard_rows), short_yaw_share=short_yaw, plans_sha256=digest
    )
    spread = _spread(threads, ray)
    terminal.announce_compilation()
    with following(terminal, "COLLECT") as progress:
        dataset = collect_rollouts(config, count, out, plugins.simulator(), progress, given=given, spread=spread)
    found = totals([dataset.header(number) for number in dataset.numbers()])
    crashed = found["crashed"] / found["rows"]
    terminal.line("COLLECT", f"{found['rows']:,} rollouts at {out}, {crashed:.1%} of them crashed; see README.md there")
    return terminal.finish(
        Outcome.OK,
        {"rollouts": found["rows"], "shards": len(dataset.numbers()), "out": out, "data_hash": dataset.hash, **found},
    )


def _world(name: str, vehicle: str | None, loop: str | None, waypoints: int | None) -> World:
    """The world with what was asked for in place of its own; disturbances stay the world's."""
    from dataclasses import replace

    from lcd_flight.worlds import load_vehicle, load_world

    world = load_world(name)
    if vehicle is not None:
        own = world.base_vehicle
        lag_s, noise = own.motor_time_constant_s, own.motor_noise
        world = replace(
            world, base_vehicle=replace(load_vehicle(vehicle), motor_time_constant_s=lag_s, motor_noise=noise)
        )
    if loop is not None:
        world = replace(world, loop=_loop(loop))
    if waypoints is not None:
        world = replace(world, sampler=replace(world.sampler, waypoints=waypoints))
    return world


def _loop(name: str) -> Literal["paper", "flight"]:
    if name == "paper":
        return "paper"
    if name == "flight":
        return "flight"
    raise InputError(f"--loop {name}: choose paper or flight")


def _given(path: Path | None, world: World, seed: int, short_yaw: float) -> GivenPlans | None:
    from lcd_flight.learning.given import load_plans

    return None if path is None else load_plans(path, world.sampler, seed, short_yaw)


def _mix(sources: str | None, given: GivenPlans | None, shard_rows: int) -> Mix:
    """As asked for; else the given plans alone, or the usual mix."""
    from lcd_flight.learning.mix import Mix, parse_mix

    if sources is not None:
        return parse_mix(sources, shard_rows)
    return Mix(shard_rows=shard_rows) if given is None else parse_mix("plans=1", shard_rows)


def _spread(threads: int, ray: str | None) -> Spread:
    from lcd_flight.learning.spread import in_threads

    if ray is None:
        return in_threads(threads)
    from lcd_flight.learning.on_ray import on_ray

    return on_ray(ray)
