"""What an evaluation found: every flight, the table that sums them up, and comparisons of two methods.

Rows are tasks throughout: the flights of one task, with whatever drag and noise, are not independent of each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from lcd_flight.learning.statistics import PairedDifference, crash_rate, paired_difference
from lcd_flight.model import BoolArray, FloatArray, InputError, SeedArray
from lcd_flight.planning.planner import Timing

YawWay: TypeAlias = Literal["as-sampled", "short"]
"""`short`: every turn by less than half a turn, in place of the yaws as they were drawn."""


@dataclass(frozen=True, slots=True)
class EvaluationOptions:
    """How to evaluate, beside world, tasks and methods."""

    seed: int = 0
    """Of the tasks (where they are sampled) and of the noise."""
    timing: Timing = "retimed"
    """For all methods but minimum snap, which keeps the paper's."""
    drags: tuple[int, ...] = (3,)
    """Configurations that are planned for and flown in, counted from 1; each task is flown in all of them."""
    noise_seeds: int = 3
    """Flights of each plan."""
    model: str | None = None
    """Name or path of the learned cost; None: the one that ships for the world's vehicle and loop."""
    yaw: YawWay = "as-sampled"
    thrust_share: float = 1.0
    """Rotor thrust of the vehicle that flies over that of the vehicle that planner and controller believe in."""

    def __post_init__(self) -> None:
        """Refuse what cannot be flown.

        Raises:
            InputError: no drag configuration or one twice, no noise seed, or a thrust share that is not in (0, 2].
        """
        if not self.drags or len(set(self.drags)) < len(self.drags):
            raise InputError(f"drag configurations {list(self.drags)}: give at least one, each once")
        if self.noise_seeds < 1:
            raise InputError(f"{self.noise_seeds} noise seeds: give at least one")
        if not 0.0 < self.thrust_share <= 2.0:
            raise InputError(f"thrust share {self.thrust_share:g}: give a number above 0 and at most 2, e.g. 0.95")


@dataclass(frozen=True, slots=True)
class MethodFigures:
    """One row of the table."""

    crash_rate: float
    """Per cent of flights with a largest error above 1.5 m, or that left the model's validity."""
    crash_rate_error: float | None
    """Its standard error in per cent, clustered by task. None: one task."""
    crash_rate_low: float
    crash_rate_high: float
    """Wilson's 95 % interval in per cent (`statistics.py`)."""
    tasks: int
    noise_seeds: int
    median_max_error_m: float
    p95_max_error_m: float
    largest_max_error_m: float
    """Of a flight that left the model's validity: what was seen until then."""
    median_waypoint_error_m: float
    """Median over the flights of the largest distance from a waypoint at its instant."""
    median_relative_snap: float
    """Snap of the plan over minimum snap at the paper's times."""
    saturation_share: float
    """Mean share of motor commands that were clipped."""
    fell_back: int
    """Plans (task x drag) for which the method failed and minimum snap was flown."""
    plan_time_ms: float
    """Processor time per plan, in batches on this machine; informative, it varies between runs."""


@dataclass(frozen=True, slots=True, eq=False)
class MethodRun:
    """What one method did, for N tasks, D drag configurations and R noise seeds."""

    max_error_m: FloatArray
    """(N, D, R)"""
    crashed: BoolArray
    """(N, D, R)"""
    waypoint_error_m: FloatArray
    """(N, D, R) largest distance from a waypoint at its instant, of those that were reached."""
    saturation_share: FloatArray
    """(N, D, R)"""
    relative_snap: FloatArray
    """(N, D)"""
    fell_back: BoolArray
    """(N, D)"""
    plan_seconds: float
    """Processor time for all plans together."""

    def at(self, column: int) -> MethodRun:
        """The part flown in one drag configuration (a column of the arrays); its share of the planning time."""
        arrays = {f.name: getattr(self, f.name)[:, [column]] for f in fields(MethodRun) if f.name != "plan_seconds"}
        return MethodRun(**arrays, plan_seconds=self.plan_seconds / self.fell_back.shape[1])

    @staticmethod
    def beside(parts: Sequence[MethodRun]) -> MethodRun:
        """Runs of the same tasks in several drag configurations as one."""
        names = [f.name for f in fields(MethodRun) if f.name != "plan_seconds"]
        arrays = {name: np.concatenate([getattr(p, name) for p in parts], axis=1) for name in names}
        return MethodRun(**arrays, plan_seconds=sum(p.plan_seconds for p in parts))

    def figures(self) -> MethodFigures:
        """All flights summed up."""
        tasks, drags, flights = self.crashed.shape
        rate = crash_rate(self.crashed.reshape(tasks, -1))
        return MethodFigures(
            crash_rate=rate.per_cent,
            crash_rate_error=rate.standard_error,
            crash_rate_low=rate.low,
            crash_rate_high=rate.high,
            tasks=tasks,
            noise_seeds=flights,
            median_max_error_m=float(np.median(self.max_error_m)),
            p95_max_error_m=float(np.percentile(self.max_error_m, 95.0)),
            largest_max_error_m=float(self.max_error_m.max()),
            median_waypoint_error_m=float(np.median(self.waypoint_error_m)),
            median_relative_snap=float(np.median(self.relative_snap)),
            saturation_share=float(self.saturation_share.mean()),
            fell_back=int(self.fell_back.sum()),
            plan_time_ms=1e3 * self.plan_seconds / (tasks * drags),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """The flights of several methods on the same tasks, in the same drag configurations, with the same noise."""

    world: str
    options: EvaluationOptions
    runs: dict[str, MethodRun]
    noise: SeedArray
    """(N, R) of the flights, the same for every method and drag configuration."""

    @property
    def methods(self) -> dict[str, MethodFigures]:
        """The table, over all drag configurations together."""
        return {name: run.figures() for name, run in self.runs.items()}

    def at(self, drag: int) -> dict[str, MethodFigures]:
        """The table of one drag configuration.

        Raises:
            ValueError: it was not flown.
        """
        column = self.options.drags.index(drag)
        return {name: run.at(column).figures() for name, run in self.runs.items()}

    def compare(self, a: str, b: str) -> PairedDifference:
        """Method `a` minus method `b`, paired by task, over all drag configurations together.

        Raises:
            InputError: one of them was not evaluated.
        """
        for name in (a, b):
            if name not in self.runs:
                raise InputError(f"method {name} was not evaluated, so it cannot be compared; add it to the methods")
        flights = [self.runs[name].crashed for name in (a, b)]
        return paired_difference(*(crashed.reshape(len(crashed), -1) for crashed in flights))

    @staticmethod
    def beside(parts: Sequence[Evaluation]) -> Evaluation:
        """Evaluations of the same tasks and methods in one drag configuration each, by models of their own, as one.

        Its options name the first model.
        """
        first, drags = parts[0], tuple(drag for p in parts for drag in p.options.drags)
        runs = {name: MethodRun.beside([p.runs[name] for p in parts]) for name in first.runs}
        return replace(first, options=replace(first.options, drags=drags), runs=runs)

    def as_json(self) -> dict[str, Any]:
        """What `lcd evaluate --json` prints."""
        by_drag = {str(drag): _plain(self.at(drag)) for drag in self.options.drags}
        return {"world": self.world, **asdict(self.options), "methods": _plain(self.methods), "by_drag": by_drag}


def _plain(table: dict[str, MethodFigures]) -> dict[str, Any]:
    return {name: asdict(figures) for name, figures in table.items()}
