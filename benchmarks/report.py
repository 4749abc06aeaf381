"""Run every benchmark and write BENCHMARKS.md: `make bench`.

Each benchmark is a process of its own, one after another, so that none warms the caches of the next.
"""

from __future__ import annotations

import datetime
import json
import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "BENCHMARKS.md"
HEAD = """# Benchmarks

Written by `make bench` on {date}: {machine}, Python {python}. Both sides of each ratio were measured in the same
run on this machine; above 1 means that ours is better. `make bench NAME=plan` measures one table again. Absolute
figures differ between machines, and here they share two cores with everything else that runs; ratios travel better.
"""


def main() -> None:
    """Measure all and write the page."""
    names = sorted(path.stem.removeprefix("bench_") for path in (ROOT / "benchmarks").glob("bench_*.py"))
    tables = {name: _rows(name) for name in names}
    machine = f"{os.cpu_count()} x {_processor()}"
    head = HEAD.format(date=datetime.date.today().isoformat(), machine=machine, python=platform.python_version())
    PAGE.write_text(head + "".join(_section(name, rows) for name, rows in tables.items()))


def _rows(name: str) -> list[dict[str, Any]]:
    command = [sys.executable, "-c", "from lcd_flight.cli.main import lcd; lcd()", "bench", name, "--json"]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    rows: list[dict[str, Any]] = json.loads(done.stdout.splitlines()[-1])["rows"]
    return rows


def _section(name: str, rows: list[dict[str, Any]]) -> str:
    lines = [f"\n## {name}\n", "| what | unit | ours | peer | peer's name | ratio |", "|---|---|---:|---:|---|---:|"]
    for row in rows:
        ours, peer, ratio = (_number(row[key]) for key in ("ours", "peer", "ratio"))
        lines.append(f"| {row['what']} | {row['unit']} | {ours} | {peer} | {row['peer_name'] or ''} | {ratio} |")
    return "\n".join(lines) + "\n"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def _processor() -> str:
    """The processor's name, where the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.machine()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())


if __name__ == "__main__":
    main()
