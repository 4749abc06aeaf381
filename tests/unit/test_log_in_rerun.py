"""Rerun converts our logs: poses, transforms and lines arrive, and nothing is missing."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest
import synthetic_flight

from lcd_flight.record import LogWriter

RERUN = Path(sys.executable).with_name("rerun")
PAIRS = synthetic_flight.flight()

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("rerun_sdk") is None and not RERUN.exists(), reason="the extra `rerun` is not installed"
)


def rerun(*arguments: str, folder: Path) -> str:
    """What it prints; its settings go into the test's folder."""
    environment = {"HOME": str(folder), "PATH": "/usr/bin:/bin", "RERUN_ANALYTICS_ENABLED": "0"}
    done = subprocess.run(
        [str(RERUN), *arguments], capture_output=True, text=True, check=True, env=environment, timeout=120
    )
    return done.stdout


def test_it_converts_a_log(tmp_path: Path) -> None:
    log, recording = tmp_path / "flight.mcap", tmp_path / "flight.rrd"
    writer = LogWriter(log, synthetic_flight.header())
    for inputs, tick in PAIRS:
        writer.write(inputs, tick)
    writer.close()
    rerun("mcap", "convert", str(log), "-o", str(recording), folder=tmp_path)
    text = rerun("rrd", "print", "-v", str(recording), folder=tmp_path)
    assert "Transform3D:translation" in text
    assert "InstancePoses3D:quaternions" in text
    assert "TextLog:text" in text
    for topic in ("/pose", "/tf", "/reference", "/plan", "/log", "/tick", "/tick_inputs", "/scene"):
        assert f" - {topic} - " in text, topic
