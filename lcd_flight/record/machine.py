"""What wrote a log, and where."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
from pathlib import Path

_PACKAGES = ("lcd-flight", "numpy", "numba", "mcap", "pyzmq")


def this_machine() -> dict[str, str]:
    """Versions, commit where it is known, machine."""
    return {
        **{name: importlib.metadata.version(name) for name in _PACKAGES},
        "commit": _commit(),
        "python": platform.python_version(),
        "system": platform.platform(),
        "processors": f"{os.cpu_count()} x {platform.machine()}",
        "host": platform.node(),
    }


def _commit() -> str:
    """The commit that runs, with `-dirty` where files were changed; empty for an installed package or without git."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return ""
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=5.0, check=True).stdout.strip()  # noqa: S603
    except (OSError, subprocess.SubprocessError):
        return ""
