"""The page of results: words from `results_template.md`, tables, pictures as SVG, and every number as JSON.

The template's paragraphs hold `{{kind arguments}}`; one that begins with `{{if METHOD}}` or `{{unless METHOD}}` stands
only where that method was, or was not, flown. So the page says no figure that this very run has not measured.
"""

from __future__ import annotations

import json
import math
import re
import textwrap
from dataclasses import asdict
from datetime import UTC, datetime
from importlib import resources
from pathlib import Path
from typing import Any

from lcd_flight.files import write_whole
from lcd_flight.learning import results_tables as tables
from lcd_flight.learning.evaluation_figures import bar_figure, crash_rate_figure, error_figure
from lcd_flight.learning.fingerprint import versions
from lcd_flight.learning.flight_figures import PathTeller
from lcd_flight.learning.freshness import about_seed
from lcd_flight.learning.reproduce import Reproduction
from lcd_flight.learning.reproduction_models import LESSON_WORLD
from lcd_flight.learning.reproduction_settings import MIDDLE_DRAG
from lcd_flight.learning.results_flights import write_flights
from lcd_flight.model import Simulator

_TEMPLATE = "results_template.md"
_PLACE = re.compile(r"\{\{(\w+)((?: [\w-]+)*)\}\}")
_CONDITION = re.compile(r"\{\{(if|unless) ([\w-]+)\}\}\n")
_DIGITS = 5


def write_results(result: Reproduction, folder: Path, simulator: Simulator) -> Path:
    """Write the page and what it shows into `folder`; returns the page's path.

    Raises:
        InputError: a file cannot be written.
    """
    for experiment in result.in_group("paper"):
        evaluation = result.evaluations[experiment.name]
        title = f"{experiment.world.name}, {tables.TIMING_WORDS[experiment.options.timing]}"
        write_whole(folder / f"crash-rates-{experiment.name}.svg", crash_rate_figure(title, evaluation))
        write_whole(folder / f"errors-{experiment.name}.svg", error_figure(title, evaluation))
    for timing, rows in tables.lesson_rows(result).items():
        title = f"{LESSON_WORLD}, {tables.TIMING_WORDS[timing]}: what a model was made from"
        write_whole(folder / f"lesson-{timing}.svg", bar_figure(title, rows))
    flights = write_flights(result, folder, simulator, simulator) if isinstance(simulator, PathTeller) else []
    write_whole(folder / "results.json", json.dumps(_rounded(_as_json(result)), separators=(",", ":")) + "\n")
    write_whole(folder / "README.md", page(result, flights))
    return folder / "README.md"


def page(result: Reproduction, flights: list[str]) -> str:
    """The page in Markdown.

    flights: how it shows the pictures of single flights.
    """
    template = resources.files(__package__).joinpath(_TEMPLATE).read_text(encoding="utf-8")
    values = _values(result) | {"flights": "\n\n".join(flights)}
    flown = {name for experiment in result.in_group("paper") for name in experiment.methods}
    paragraphs = (_wrapped(_filled(result, values, flown, text)) for text in template.split("\n\n"))
    return "\n\n".join(text.strip("\n") for text in paragraphs if text.strip()) + "\n"


def _filled(result: Reproduction, values: dict[str, str], flown: set[str], paragraph: str) -> str:
    """A paragraph with its figures; empty where its condition does not hold."""
    condition = _CONDITION.match(paragraph)
    if condition:
        if (condition[2] in flown) != (condition[1] == "if"):
            return ""
        paragraph = paragraph[condition.end() :]

    def figure(place: re.Match[str]) -> str:
        kind, arguments = place[1], place[2].split()
        if kind == "rate":
            return f"{tables.rate(result.evaluations[arguments[0]].methods[arguments[1]])} %"
        if kind == "middle":
            return f"{tables.rate(result.evaluations[arguments[0]].at(MIDDLE_DRAG)[arguments[1]])} %"
        if kind == "table":
            return str(getattr(tables, arguments[0])(result))
        if kind == "figures":
            return "\n\n".join(
                f"![{arguments[0]}, {e.name}]({arguments[0]}-{e.name}.svg)" for e in result.in_group("paper")
            )
        return values[kind]

    return _PLACE.sub(figure, paragraph)


def _wrapped(paragraph: str) -> str:
    """Prose in lines of even length, now that its figures are in; tables, pictures and titles as they are."""
    if paragraph.startswith(("|", "!", "#")) or "\n|" in paragraph:
        return paragraph
    indent = "  " if paragraph.startswith("- ") else ""
    return textwrap.fill(
        " ".join(paragraph.split()), 120, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )


def _values(result: Reproduction) -> dict[str, str]:
    """What the template asks for by a single word."""
    settings = result.settings
    by = "one for each drag configuration" if settings.per_drag else "one for each vehicle over all drag configurations"
    trained = f"trained from nothing by the recipe `{settings.recipe}`, {by}"
    return {
        "tiny": "**A tiny run that tries out every step. Its figures mean nothing.**" if settings.quick else "",
        "command": settings.command,
        "date": f"{datetime.now(UTC):%Y-%m-%d}",
        "versions": ", ".join(f"{name} {number}" for name, number in versions("numpy", "numba").items()),
        "minutes": f"{result.seconds / 60.0:.0f}",
        "count": str(settings.count),
        "noise_seeds": str(settings.noise_seeds),
        "seed": about_seed(settings.seed),
        "models": trained if settings.models == "train" else "those that ship",
        "middle_drag": str(MIDDLE_DRAG),
        "drags": str(len(settings.drags)),
        "lesson_figures": "\n\n".join(f"![Models, {t}](lesson-{t}.svg)" for t in tables.lesson_rows(result)),
    }


def _as_json(result: Reproduction) -> dict[str, Any]:
    """Every table; models are told by where they come from, not by their files."""
    found = {}
    for experiment in result.experiments:
        model = "trained in this run" if experiment.trained else "as shipped"
        numbers = result.evaluations[experiment.name].as_json() | {"model": model}
        found[experiment.name] = {"title": experiment.title, "group": experiment.group, **numbers}
    made = {"settings": asdict(result.settings), "versions": versions("numpy", "numba"), "seconds": result.seconds}
    return {**made, "experiments": found}


def _rounded(value: Any) -> Any:
    """The same with floats to a few digits, and null for what is not finite."""
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    if isinstance(value, float):
        return float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else None
    return value
