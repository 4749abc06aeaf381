"""Reading the documentation's pages: their code blocks, their tables, and the tables that are made from code."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from lcd_flight.model import Geofence, SafetyLimits
from lcd_flight.safety.monitors import Monitor, monitors

ROOT = Path(__file__).parents[1]
PAGES = sorted((ROOT / "docs").glob("*.md"))
NOT_RUN = "<!-- not run -->"
LIMITS = SafetyLimits(geofence=Geofence((-1.0, -1.0, 0.0), (1.0, 1.0, 2.0)))
"""The defaults; the box shows in no table."""

_BLOCK = re.compile(r"(?P<before>[^\n]*)\n```(?P<language>\w+)\n(?P<text>.*?)```", re.DOTALL)
_UNIT = re.compile(r"limit \{limit[^}]*\} ?([^)]+)\)")


@dataclass(frozen=True)
class Block:
    """One fenced block of code."""

    page: str
    line: int
    language: str
    text: str
    runs: bool
    """Whether nothing before it says that it is not run."""


def page(name: str) -> str:
    """A page's text."""
    return (ROOT / "docs" / name).read_text(encoding="utf-8")


def blocks(name: str, language: str) -> list[Block]:
    """The blocks of a page in one language, in order."""
    text = page(name)
    return [
        Block(name, text[: match.start("text")].count("\n") + 1, language, match["text"], match["before"] != NOT_RUN)
        for match in _BLOCK.finditer(text)
        if match["language"] == language
    ]


def table(name: str, first_header: str) -> list[list[str]]:
    """The rows below the header of the page's table whose first column is `first_header`; cells without backticks."""
    lines = iter(page(name).splitlines())
    for line in lines:
        if line.startswith(f"| {first_header} |"):
            break
    else:
        raise AssertionError(f"docs/{name} has no table that begins with {first_header!r}")
    next(lines)
    rows = []
    for line in lines:
        if not line.startswith("|"):
            return rows
        rows.append([cell.strip().replace("`", "") for cell in re.split(r"(?<!\\)\|", line)[1:-1]])
    return rows


def monitors_table() -> str:
    """The monitors in Markdown, one row each, with the default limits."""
    head = ["monitor", "watches", "beyond", "for", "asks for", "from"]
    rows = [[f"`{m.code}`", m.reads, _limit(m), _debounce(m), m.severity.name, m.scope.name] for m in monitors(LIMITS)]
    return "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows])


def _limit(monitor: Monitor) -> str:
    """What it is held to, in the words and units of its message."""
    number, unit = f"{monitor.limit * monitor.scale:.4g}", _UNIT.search(monitor.message)
    if unit is not None:
        return f"{'below' if monitor.below else 'above'} {number} {unit[1]}"
    return "any" if monitor.limit == 0.0 else f"more than {number}"


def _debounce(monitor: Monitor) -> str:
    return f"{monitor.debounce_s:g} s" if monitor.debounce_s else ""
