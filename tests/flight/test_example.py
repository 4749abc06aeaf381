"""The ten lines of `examples/fly_a_mission.py`, in a process of their own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "fly_a_mission.py"
SHORT = """
version: 1
name: short
vehicle: {type: crazyflie}
planner: {type: minimum-snap, speed: 1.2}
plan:
  - takeoff: {height: 0.8, duration: 1.5}
  - trajectory: {waypoints: [{position: [0.0, 0.0, 0.8]}, {position: [1.2, 0.4, 1.0]}, {position: [0.4, 1.2, 0.8]}]}
  - land: {duration: 2.0}
safety: {geofence: {min: [-3.0, -3.0, 0.0], max: [4.0, 4.0, 3.0]}}
"""


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-W", "error", str(EXAMPLE), *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=300)


def told(done: subprocess.CompletedProcess[str], folder: Path) -> None:
    """Three lines, and the files that the last one names."""
    assert done.returncode == 0, done.stderr
    rehearsed, flown, files = done.stdout.splitlines()
    assert rehearsed.endswith("pass")
    assert flown.startswith("landed largest error 0.")
    assert [(folder / name).stat().st_size > 10_000 for name in files.split()] == [True, True]


def test_it_flies_a_mission(tmp_path: Path) -> None:
    (tmp_path / "short.yaml").write_text(SHORT)
    told(run(tmp_path, "short.yaml"), tmp_path)


def test_it_flies_the_mission_that_ships(tmp_path: Path) -> None:
    told(run(tmp_path), tmp_path)


def test_a_flight_that_is_refused_says_so(tmp_path: Path) -> None:
    (tmp_path / "fast.yaml").write_text(
        SHORT.replace("speed: 1.2", "speed: 3.4, limits: {max_thrust_ratio: 3.0, max_tilt_deg: 180}")
    )
    done = run(tmp_path, "fast.yaml")
    assert done.returncode == 1
    assert "RefusedError" in done.stderr
    assert not (tmp_path / "flights").exists()
