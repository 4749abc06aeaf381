"""What is reproduced, and how large."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from lcd_flight.model import InputError, World
from lcd_flight.worlds import load_world

WORLDS = ("crazyflie-paper", "crazyflie-saturated", "hummingbird-paper")
"""The paper's setting as written, the same where minimum snap crashes as often as reported, the released code's."""
DRAGS = (1, 2, 3, 4, 5)
MIDDLE_DRAG = 3
COUNT, QUICK_COUNT = 1000, 4
"""Tasks of each world, unless said otherwise."""
MAIN_RECIPES = ("small", "medium", "full")
_NOISE_SEEDS = 3

Models: TypeAlias = Literal["train", "shipped"]


@dataclass(frozen=True, slots=True)
class ReproduceSettings:
    """What is reproduced, and how large."""

    seed: int
    """Of tasks and noise."""
    count: int = COUNT
    """Tasks of each world."""
    noise_seeds: int = _NOISE_SEEDS
    recipe: str = "medium"
    """How the models are trained, by name (`recipes.py`)."""
    per_drag: bool = False
    """One model for each drag configuration, as the paper has them, in place of one over all."""
    models: Models = "train"
    """`shipped` evaluates the models that ship and trains nothing."""
    quick: bool = False
    """A tiny run of every step, for tests: its figures mean nothing."""

    @property
    def drags(self) -> tuple[int, ...]:
        """Configurations that the paper's experiment is flown in."""
        return (MIDDLE_DRAG,) if self.quick else DRAGS

    @property
    def command(self) -> str:
        """The command line that makes the same again."""
        words = {
            f"--count {self.count}": self.count != (QUICK_COUNT if self.quick else COUNT),
            f"--noise-seeds {self.noise_seeds}": self.noise_seeds != _NOISE_SEEDS,
            f"--recipe {self.recipe}": self.models == "train",
            "--models shipped": self.models == "shipped",
            "--per-drag": self.per_drag,
            "--quick": self.quick,
        }
        return " ".join(["lcd reproduce", *(word for word, said in words.items() if said)])

    def __post_init__(self) -> None:
        """Check before hours are spent.

        Raises:
            InputError: no such recipe, or counts that are not positive.
        """
        if self.recipe not in MAIN_RECIPES:
            raise InputError(f"recipe {self.recipe}: choose one of {', '.join(MAIN_RECIPES)}")
        if self.count < 2 or self.noise_seeds < 1:
            raise InputError(f"{self.count} tasks x {self.noise_seeds} noise seeds: give at least 2 tasks and 1 seed")
        if self.per_drag and self.models == "shipped":
            raise InputError("one model for each drag configuration does not ship: leave out --per-drag or train")


def paper_worlds() -> list[World]:
    """The worlds that the paper's experiment is flown in."""
    return [load_world(name) for name in WORLDS]
