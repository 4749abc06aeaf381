"""From a mission file to a `Mission`, or to everything that is wrong with it."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from lcd_flight.mission.airframe import gains_fit, vehicle_fits
from lcd_flight.mission.checks import CHECKS, contradictions
from lcd_flight.mission.draft import Draft
from lcd_flight.mission.explain import explanations, shown
from lcd_flight.mission.mission import Mission, Source, with_source
from lcd_flight.mission.problems import Key, MissionError, Problem
from lcd_flight.mission.source_file import read_text
from lcd_flight.mission.strict_yaml import Document, read_document
from lcd_flight.model import InputError

SUFFIX = ".yaml"


def load_mission(name_or_path: str | Path) -> Mission:
    """Read a mission file, or one that ships by its name (`demo`).

    Raises:
        InputError: there is no such file, or it cannot be read.
        MissionError: it is wrong; holds every problem, each with file, line, key, value, limit and remedy.
    """
    path = find_mission(name_or_path)
    text = read_text(path)
    document = read_document(text)
    problems = list(_problems(document, path))
    if problems:
        raise MissionError(str(path), problems)
    return with_source(Mission.model_validate(document.data), Source(path, text, document.lines))


def find_mission(name_or_path: str | Path) -> Path:
    """The file that a name or a path stands for; a file in the current folder comes before one that ships.

    Raises:
        InputError: a bare name (no folder, no suffix) that is neither a file nor a mission that ships.
    """
    path = Path(name_or_path)
    if path.suffix or len(path.parts) != 1 or _exists(path):
        return path
    shipped = shipped_missions()
    if path.name not in shipped:
        names = ", ".join(shipped)
        raise InputError(f"{path}: no such mission; give a file's path, or the name of one that ships: {names}")
    return shipped[path.name]


def _exists(path: Path) -> bool:
    """Whether there is such a file; also where it cannot be looked up, since reading it tells why."""
    try:
        return path.exists()
    except OSError:
        return True


def shipped_missions() -> dict[str, Path]:
    """The missions inside the package, by name."""
    folder = Path(str(resources.files("lcd_flight.mission") / "data"))
    return {path.stem: path for path in sorted(folder.glob(f"*{SUFFIX}"))}


def _problems(document: Document, path: Path) -> Iterator[Problem]:
    """Everything that is wrong: as YAML, key by key, and between keys; nothing twice."""
    yield from document.problems
    if not document.complete:
        return
    if not isinstance(document.data, dict):
        what = "is empty" if document.data is None else f"holds {shown(document.data)}"
        yield Problem(1, (), f"{what}; write a mission: version, name, vehicle, plan, safety (docs/mission.md)")
        return
    told = {problem.key for problem in document.problems if problem.key}
    for key, text in _findings(document.data, path):
        if not any(key[: len(other)] == other for other in told):
            yield Problem(document.line_of(key), key, text)


def _findings(data: dict[str, Any], path: Path) -> Iterator[tuple[Key, str]]:
    try:
        Mission.model_validate(data)
    except ValidationError as error:
        yield from explanations(error, Mission)
    draft = Draft(data, path.parent)
    yield from contradictions(draft, CHECKS)
    yield from vehicle_fits(draft)
    yield from gains_fit(draft)
