"""`lcd train`: models of the tracking cost."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lcd_flight.cli.options import Json, NoColor, Quiet
from lcd_flight.cli.terminal import Terminal, following
from lcd_flight.errors import InputError, Outcome

Seed = Annotated[int, typer.Option(help="Of tasks, perturbations and noise.", min=0)]


def train(
    worlds: Annotated[str, typer.Option(help="Names, separated by commas: of one vehicle and one loop.")],
    out: Annotated[Path, typer.Option(help="The model file to write, *.safetensors.")],
    recipe: Annotated[str, typer.Option(help="small, medium or full: about one, two or four million labels.")] = "full",
    work: Annotated[Path | None, typer.Option(help="Folder for data and the models of the rounds.")] = None,
    seed: Seed = 0,
    json: Json = False,
    quiet: Quiet = False,
    no_color: NoColor = False,
) -> int:
    """Collect data, train the tracking cost, plan with it, fly the plans and train anew, round by round.

    Run again after an interruption, it goes on where it stopped.
    """
    from lcd_flight import plugins
    from lcd_flight.learning.recipes import RECIPES
    from lcd_flight.learning.train import train as train_model
    from lcd_flight.worlds import load_world

    if recipe not in RECIPES:
        raise InputError(f"--recipe {recipe}: choose one of {', '.join(RECIPES)}")
    if out.suffix != ".safetensors":
        raise InputError(f"--out {out}: a model's file ends in .safetensors")
    terminal = Terminal(json_line=json, quiet=quiet, color=not no_color)
    terminal.announce_compilation()
    config = RECIPES[recipe](out.stem, tuple(load_world(name.strip()) for name in worlds.split(",")), seed)
    folder = work or Path("data") / f"{out.stem}-{recipe}-{seed}"
    with following(terminal, "TRAIN") as progress:
        model = train_model(config, folder, out, plugins.simulator(), progress)
    validation = {} if model.card is None else model.card.validation
    terminal.line("TRAIN", f"{out}: " + ", ".join(f"{key} {value:.3g}" for key, value in validation.items()))
    return terminal.finish(Outcome.OK, {"model": str(out), "work": str(folder), "validation": validation})
