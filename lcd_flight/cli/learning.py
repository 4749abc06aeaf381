"""`lcd train`: models of the tracking cost."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal, following
from lcd_flight.errors import InputError, Outcome

if TYPE_CHECKING:
    from lcd_flight.model import World


def train(
    out: Annotated[Path, typer.Option(help="The model file to write, *.safetensors; its card is drawn beside it.")],
    worlds: Annotated[
        str | None, typer.Option(help="Names, separated by commas: of one vehicle and one loop; NAME@SPEED too.")
    ] = None,
    vehicle: Annotated[
        str | None, typer.Option(help="A vehicle's name or file in place of worlds; speeds are found that suit it.")
    ] = None,
    loop: Annotated[str | None, typer.Option(help="With --vehicle: flight (the default) or paper.")] = None,
    recipe: Annotated[
        str, typer.Option(help="small, medium or full (about one, two, four million labels), or a baseline's.")
    ] = "full",
    work: Annotated[Path | None, typer.Option(help="Folder for data and the models of the rounds.")] = None,
    seed: Annotated[int, typer.Option(help="Of tasks, perturbations and noise.", min=0)] = 0,
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Collect data, train the tracking cost, plan with it, fly the plans and train anew, round by round.

    Run again after an interruption, it goes on where it stopped.
    """
    from lcd_flight import plugins
    from lcd_flight.files import write_whole
    from lcd_flight.learning.card_figure import card_figure
    from lcd_flight.learning.recipes import RECIPES
    from lcd_flight.learning.train import train as train_model

    if recipe not in RECIPES:
        raise InputError(f"--recipe {recipe}: choose one of {', '.join(RECIPES)}")
    if out.suffix != ".safetensors":
        raise InputError(f"--out {out}: a model's file ends in .safetensors")
    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    chosen = _worlds(worlds, vehicle, loop, terminal)
    config = RECIPES[recipe](out.stem, chosen, seed)
    folder = work or Path("data") / f"{out.stem}-{recipe}-{seed}"
    with following(terminal, "TRAIN") as progress:
        card = train_model(config, folder, out, plugins.simulator(), progress)
    write_whole(out.with_suffix(".svg"), card_figure(card))
    told = ", ".join(f"{key} {value:.3g}" for key, value in card.validation.items())
    terminal.line("TRAIN", f"{out}: {told}; {out.with_suffix('.svg').name} shows its card")
    return terminal.finish(Outcome.OK, {"model": str(out), "work": str(folder), "validation": card.validation})


def _worlds(worlds: str | None, vehicle: str | None, loop: str | None, terminal: Terminal) -> tuple[World, ...]:
    """Those that are named, or some for a vehicle."""
    from lcd_flight import plugins
    from lcd_flight.learning.own_world import worlds_of
    from lcd_flight.worlds import load_vehicle, load_world

    if (worlds is None) == (vehicle is None):
        raise InputError("give --worlds NAME,NAME or --vehicle NAME_OR_FILE, one of the two")
    if worlds is not None:
        if loop is not None:
            raise InputError(f"--loop {loop}: worlds have their own; it goes with --vehicle")
        named = tuple(load_world(name.strip()) for name in worlds.split(","))
        terminal.announce_compilation()
        return named
    assert vehicle is not None  # noqa: S101 - as checked above
    if loop not in (None, "flight", "paper"):
        raise InputError(f"--loop {loop}: flight or paper")
    craft = load_vehicle(vehicle)
    terminal.announce_compilation()
    found = worlds_of(craft, "paper" if loop == "paper" else "flight", plugins.simulator())
    speeds = ", ".join(f"{world.speed:g}" for world in found)
    terminal.line("TRAIN", f"{craft.name}: tasks at {speeds} m/s; at the first, minimum snap crashes in two of five")
    return found
