"""Results as Markdown tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from lcd_flight.learning.evaluation import Evaluation, MethodFigures
from lcd_flight.learning.experiments import TIMINGS
from lcd_flight.learning.methods import METHODS
from lcd_flight.learning.reproduce import Reproduction
from lcd_flight.learning.reproduction_models import LESSON_WORLD
from lcd_flight.learning.reproduction_settings import MIDDLE_DRAG, WORLDS

PAIRS = (
    ("learned", "minimum-snap"),
    ("learned", "analytic"),
    ("learned", "analytic-long"),
    ("learned-polished", "analytic-polished"),
    ("learned-polished", "search"),
)
"""Methods that are compared task by task: the first minus the second."""
TIMING_WORDS = {"fixed": "times fixed", "retimed": "re-timed"}
_REPORTED = (
    ("learned planner (the paper's Ours)", "6", "learned"),
    ("its objective as released", "", "paper"),
    ("minimum snap, geometric controller (MS-GC)", "41", "minimum-snap"),
    ("the same with drag compensation (MS-GCD), Svacha's", "54", "minimum-snap-drag"),
    ("the same with drag compensation, L1", "", "minimum-snap-l1"),
    ("deep reinforcement learning", "100; 47 without motor noise", "deep-rl"),
)
"""The paper's rows, the crash rates that it reports in %, and the method here."""
_SURE = 2.0
"""Standard errors beyond which a difference counts."""


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def rate(figures: MethodFigures) -> str:
    """Crash rate and standard error."""
    error = "" if figures.crash_rate_error is None else f" ({figures.crash_rate_error:.1f})"
    return f"{figures.crash_rate:.1f}{error}"


def beside_the_paper(result: Reproduction) -> str:
    """The paper's figure as a table: times fixed as there, all drag configurations together."""
    found = [result.evaluations[f"{world}-fixed"].methods for world in WORLDS]
    rows = [
        [title, reported, *(rate(t[name]) if name in t else "not built" for t in found)]
        for title, reported, name in _REPORTED
        if reported or name in found[0]
    ]
    return table(["", "paper", *WORLDS], rows)


def summary(result: Reproduction) -> str:
    """Every method in the middle drag configuration: three worlds, both timings."""
    columns = [(world, timing) for world in WORLDS for timing in TIMINGS]
    tables = [result.evaluations[f"{world}-{timing}"].at(MIDDLE_DRAG) for world, timing in columns]
    head = ["method", *(f"{world}, {TIMING_WORDS[timing]}" for world, timing in columns)]
    return table(head, [[f"`{name}`", *(rate(t[name]) for t in tables)] for name in tables[0]])


def by_drag(evaluation: Evaluation) -> str:
    """Crash rates in each drag configuration and in all together."""
    drags = evaluation.options.drags
    single, together = [evaluation.at(drag) for drag in drags], evaluation.methods
    rows = [
        [
            f"`{name}`",
            *(rate(t[name]) for t in single),
            rate(row),
            f"{row.crash_rate_low:.1f} to {row.crash_rate_high:.1f}",
        ]
        for name, row in together.items()
    ]
    return table(["method", *(f"drag {d}" for d in drags), "all", "95 % interval"], rows)


_FIGURES: dict[str, Callable[[MethodFigures], str]] = {
    "median of the largest error, m": lambda row: f"{row.median_max_error_m:.2f}",
    "95th percentile, m": lambda row: f"{row.p95_max_error_m:.2f}",
    "largest, m": lambda row: f"{row.largest_max_error_m:.1f}",
    "at a waypoint, m": lambda row: f"{row.median_waypoint_error_m:.2f}",
    "snap ratio": lambda row: f"{row.median_relative_snap:.2f}",
    "clipped, %": lambda row: f"{100.0 * row.saturation_share:.1f}",
    "fell back": lambda row: str(row.fell_back),
    "plan, ms": lambda row: f"{row.plan_time_ms:.2f}",
}


def all_figures(evaluation: Evaluation) -> str:
    """What else was measured of each method, over all drag configurations."""
    rows = [[f"`{name}`", *(text(row) for text in _FIGURES.values())] for name, row in evaluation.methods.items()]
    return table(["method", *_FIGURES], rows)


def beyond(result: Reproduction) -> str:
    """Experiments beside the paper's, in the middle drag configuration: a row each, a column for each method."""
    chosen = result.in_group("beyond")
    names = [name for name in METHODS if any(name in result.evaluations[e.name].runs for e in chosen)]
    rows = []
    for experiment in chosen:
        found = result.evaluations[experiment.name].methods
        where = f"{experiment.world.name}, {experiment.title}, {TIMING_WORDS[experiment.options.timing]}"
        rows.append([where, *(rate(found[name]) if name in found else "" for name in names)])
    return table(["experiment", *(f"`{name}`" for name in names)], rows)


def shipped(result: Reproduction) -> str:
    """The models that ship beside those trained here, in the middle drag configuration."""
    rows = []
    if not result.in_group("shipped"):
        return ""
    for experiment in result.in_group("shipped"):
        ours = result.evaluations[experiment.name.removesuffix("-shipped")].at(MIDDLE_DRAG)
        for name, row in result.evaluations[experiment.name].methods.items():
            where = f"{experiment.world.name}, {TIMING_WORDS[experiment.options.timing]}"
            rows.append([where, f"`{name}`", rate(ours[name]), rate(row)])
    words = "The models that ship, made by a larger recipe than this run's:\n\n"
    return words + table(["experiment", "method", "trained here", "as shipped"], rows)


LESSON_WORDS = {
    "optima-only": "learned, on optima alone",
    "convex": "learned, input-convex",
}


def lesson_rows(result: Reproduction) -> dict[str, dict[str, MethodFigures]]:
    """For each timing, minimum snap and what the learned method makes of models from other data and networks."""
    found: dict[str, dict[str, MethodFigures]] = {}
    for experiment in result.in_group("lesson"):
        ours = result.evaluations[f"{experiment.world.name}-{experiment.options.timing}"].at(MIDDLE_DRAG)
        rows = found.setdefault(experiment.options.timing, {"minimum-snap": ours["minimum-snap"]})
        rows[LESSON_WORDS[experiment.title]] = result.evaluations[experiment.name].methods["learned"]
    for timing, rows in found.items():
        ours = result.evaluations[f"{LESSON_WORLD}-{timing}"].at(MIDDLE_DRAG)
        rows["mlp-knots"] = ours["mlp-knots"]
        rows["learned, as above"] = ours["learned"]
    return found


def lessons(result: Reproduction) -> str:
    """What the learned method makes of models from other data and networks."""
    found = lesson_rows(result)
    if not found:
        return "Not part of a run with the models that ship."
    names = list(next(iter(found.values())))
    head = ["model", *(TIMING_WORDS[timing] for timing in found)]
    return table(head, [[name, *(rate(rows[name]) for rows in found.values())] for name in names])


def comparisons(result: Reproduction) -> str:
    """Methods against each other on the same tasks and noise, over all drag configurations."""
    rows = []
    for experiment in result.in_group("paper"):
        evaluation = result.evaluations[experiment.name]
        for a, b in PAIRS:
            if a in evaluation.runs and b in evaluation.runs:
                where = f"{experiment.world.name}, {TIMING_WORDS[experiment.options.timing]}"
                rows.append([where, f"`{a}` minus `{b}`", *_compared(evaluation, a, b)])
    head = ["experiment", "methods", "difference, %", "95 % interval", "tasks better / worse", "p", "says"]
    return table(head, rows)


def _compared(evaluation: Evaluation, a: str, b: str) -> list[str]:
    pair = evaluation.compare(a, b)
    error = pair.standard_error or 0.0
    sure = abs(pair.difference) > _SURE * error
    says = ("fewer crashes" if pair.difference < 0.0 else "more crashes") if sure else "no difference shown"
    return [
        f"{pair.difference:+.2f} ({error:.2f})",
        f"{pair.low:+.2f} to {pair.high:+.2f}",
        f"{pair.tasks_better} / {pair.tasks_worse}",
        f"{pair.p_value:.1g}" if pair.p_value > 1e-12 else "< 1e-12",
        says,
    ]


def in_full(result: Reproduction) -> str:
    """Two tables for each of the paper's experiments."""
    parts = []
    for experiment in result.in_group("paper"):
        evaluation = result.evaluations[experiment.name]
        title = f"### {experiment.world.name}, {TIMING_WORDS[experiment.options.timing]}\n"
        parts += [title, by_drag(evaluation), all_figures(evaluation)]
    return "\n".join(parts)
