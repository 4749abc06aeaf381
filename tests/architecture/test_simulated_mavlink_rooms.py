"""What the rooms of the simulated MAVLink vehicle may not have: a clock, a socket, a client's conversions."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOM = Path("sim_bridge/mavlink")
OUTSIDE = {"asyncio", "socket", "time", "threading", "zmq"}
AT_THE_EDGE = {"ports.py", "server.py"}


def imported(path: Path) -> set[str]:
    """Dotted names of all modules that a file imports, wherever in it."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
    return names


@pytest.mark.parametrize("path", sorted(ROOM.glob("*.py")), ids=lambda path: path.name)
def test_only_the_edge_knows_the_time(path: Path) -> None:
    found = {name.split(".")[0] for name in imported(path)} & OUTSIDE
    assert not found or path.name in AT_THE_EDGE


@pytest.mark.parametrize("path", sorted(ROOM.glob("*.py")), ids=lambda path: path.name)
def test_pymavlinks_transport_stays_out(path: Path) -> None:
    assert not any("mavutil" in name or name.endswith("mavwp") for name in imported(path))


def test_frame_conversions_are_the_vehicles_own() -> None:
    ours = {name for name in imported(ROOM / "frames.py") if not name.startswith("__")}
    assert ours == {"math", "lcd_flight.model"}
