"""What a model is made from: worlds, data, rounds and networks; and recipes that are known to work."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from lcd_flight.learning.collect_config import CollectConfig
from lcd_flight.learning.fit import FitSettings
from lcd_flight.learning.mix import Mix
from lcd_flight.learning.policy import PolicyMix
from lcd_flight.learning.targets import TargetName
from lcd_flight.model import InputError, World
from lcd_flight.planning.cost.inputs import InputsName
from lcd_flight.worlds import fingerprint as vehicle_fingerprint

PAPER_LAYERS = (100, 100, 20)
"""Widths of the paper's network."""


@dataclass(frozen=True, slots=True)
class TrainConfig:
    """What a model is a function of."""

    name: str
    worlds: tuple[World, ...]
    """Of one vehicle and one loop; the data are shared out evenly among them."""
    seed: int = 0
    count: int = 800_000
    """Rollouts before the first round, of all worlds together."""
    rounds: int = 2
    """On-policy rounds after the first model."""
    policy_tasks: int = 6_000
    """Planned in each round, of all worlds together, up to whole blocks of `policy`."""
    members: int = 1
    """Of the last model; those before it only propose plans, and have one."""
    snap_weight: float = 0.03
    drags: tuple[int, ...] = (1, 2, 3, 4, 5)
    inputs: InputsName = "windows"
    """What the networks see; all but windows tie a model to the worlds' number of waypoints."""
    target: TargetName = "error"
    """What they predict; `released` is for networks that see whole trajectories."""
    mix: Mix = field(default_factory=Mix)
    policy: PolicyMix = field(default_factory=PolicyMix)
    fit: FitSettings = field(default_factory=FitSettings)

    def __post_init__(self) -> None:
        """Check that one network can serve the worlds.

        Raises:
            InputError: no world, worlds of several vehicles, loops or numbers of waypoints, a target or an activation
                that does not go with the rest.
        """
        if self.target == "released" and self.inputs == "windows":
            raise InputError("target released is of whole trajectories: choose the inputs coefficients or knots")
        if self.fit.convex and self.fit.activation == "silu":
            raise InputError("a convex network wants an activation that is convex: elu or relu")
        if not self.worlds:
            raise InputError("training needs at least one world")
        kinds = {(vehicle_fingerprint(w.base_vehicle, w.loop), w.loop, w.sampler.waypoints) for w in self.worlds}
        if len(kinds) > 1:
            names = ", ".join(w.name for w in self.worlds)
            raise InputError(f"worlds {names}: not of one vehicle, one loop and one number of waypoints")

    def collecting(self, world: World) -> CollectConfig:
        """The base data of a world."""
        return CollectConfig(world, self.seed, self.drags, self.mix)

    @property
    def count_of_each(self) -> int:
        """Rollouts of each world before the first round."""
        return -(-self.count // len(self.worlds))

    @property
    def policy_blocks_of_each(self) -> int:
        """Blocks of tasks of each world in each round."""
        return -(-self.policy_tasks // (len(self.worlds) * self.policy.block))

    @property
    def capacity(self) -> int:
        """Rollouts in all."""
        return len(self.worlds) * (self.count_of_each + self.rounds * self.policy_blocks_of_each * self.policy.rows)


def small_recipe(name: str, worlds: tuple[World, ...], seed: int = 0) -> TrainConfig:
    """About a million labels and one network: a few minutes on two cores."""
    return TrainConfig(name, worlds, seed, count=600_000, rounds=2, policy_tasks=12_800)


def medium_recipe(name: str, worlds: tuple[World, ...], seed: int = 0) -> TrainConfig:
    """About two million labels and two networks."""
    return TrainConfig(name, worlds, seed, count=1_000_000, rounds=2, policy_tasks=32_000, members=2)


def full_recipe(name: str, worlds: tuple[World, ...], seed: int = 0) -> TrainConfig:
    """About four million labels and two networks; what the models that ship were made by."""
    return TrainConfig(name, worlds, seed, count=1_600_000, rounds=3, policy_tasks=51_200, members=2)


def knots_recipe(name: str, worlds: tuple[World, ...], seed: int = 0) -> TrainConfig:
    """The paper's network (100, 100, 20) on the 39 numbers of a trajectory, by our data and rounds."""
    fit = FitSettings(hidden=PAPER_LAYERS, activation="elu")
    return replace(medium_recipe(name, worlds, seed), inputs="knots", fit=fit)


def convex_recipe(name: str, worlds: tuple[World, ...], seed: int = 0) -> TrainConfig:
    """The same, convex in what a planner chooses at fixed times: the paper's future work."""
    config = knots_recipe(name, worlds, seed)
    return replace(config, fit=replace(config.fit, convex=True))


def paper_code_recipe(name: str, worlds: tuple[World, ...], seed: int = 0) -> TrainConfig:
    """As released: 200,000 minimum-snap trajectories, 96 raw coefficients, the summed cost, no rounds.

    But for the optimiser: inputs are normalised (the released code has that written, and does not call it), and AdamW
    stands for a thousand epochs of SGD.
    """
    return TrainConfig(
        name,
        worlds,
        seed,
        count=200_000,
        rounds=0,
        inputs="coefficients",
        target="released",
        mix=Mix(search=0.0, random=0.0, optimum=1.0),
        fit=FitSettings(hidden=PAPER_LAYERS, activation="elu", batch=256, epochs=20),
    )


def optima_only_recipe(name: str, worlds: tuple[World, ...], seed: int = 0) -> TrainConfig:
    """Our network on minimum-snap trajectories alone, which is how not to do it."""
    return replace(small_recipe(name, worlds, seed), rounds=0, mix=Mix(search=0.0, random=0.0, optimum=1.0))


RECIPES = {
    "small": small_recipe,
    "medium": medium_recipe,
    "full": full_recipe,
    "mlp-knots": knots_recipe,
    "convex": convex_recipe,
    "paper-code": paper_code_recipe,
    "optima-only": optima_only_recipe,
}
