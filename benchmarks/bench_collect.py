"""What a labelled rollout costs from nothing to disk, and where the time goes; RotorPy's way to one beside it.

Processor time counts where one core works, so that a busy machine is nobody's loss; rows of all cores are of the wall
clock and of whole processes. The peer plans its minimum snap and flies it in closed loop, one after another; it writes
nothing.
"""

from __future__ import annotations

import cProfile
import pstats
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np
from rotorpy.trajectories.minsnap import MinSnap
from threadpoolctl import threadpool_limits

from lcd_flight.learning.collect import CollectConfig, collect
from lcd_flight.learning.dataset import Dataset
from lcd_flight.learning.dataset_card import write_card
from lcd_flight.learning.manifest import Manifest
from lcd_flight.learning.sampling import first_tasks, sample_tasks
from lcd_flight.learning.spread import cores, in_turn
from lcd_flight.model import Trajectory, World
from lcd_flight.model.streams import Stream
from lcd_flight.planning.knots import Whitening
from lcd_flight.worlds import load_world
from sim_bridge import rollouts, rotorpy_adapter
from sim_bridge.rollouts import MultirotorSimulator

WORLD = load_world("crazyflie-saturated")
FLIGHT = load_world("crazyflie-flight")
COUNT = 200_000
"""The paper's data set."""
PEER_FLIGHTS = 3

Report = Callable[[str], None]
Row = dict[str, Any]

STEPS: dict[str, tuple[Any, ...]] = {
    "sampling tasks and perturbations": (sample_tasks, Stream.normals),
    "minimum snap and perturbed plans": (Whitening.of, Whitening.plan),
    "rollouts": (rollouts.fly,),
    "labels": (rollouts.labels_of,),
    "writing": (Dataset.write, Manifest.add, Manifest.write, write_card),
}
"""What is done where; no function is called by another one."""


def rows(report: Report) -> list[Row]:
    """All rows of `lcd bench collect`."""
    with threadpool_limits(1):
        report("ours; a first run compiles")
        for world in (WORLD, FLIGHT):
            _made(world, 1_000)
        report(f"ours, {COUNT:,} rollouts on one core, then on all")
        profile = cProfile.Profile(time.thread_time)
        cpu_s = _made(WORLD, COUNT, profile)
        flight_cpu_s = _made(FLIGHT, COUNT // 10)
        commands = {count: _command(count) for count in (COUNT, 5 * COUNT)}
        report(f"RotorPy, {PEER_FLIGHTS} tasks")
        theirs = PEER_FLIGHTS / _rotorpy_cpu_s()
    return [
        _row("labels on disk, paper's loop, 1 core", "1/CPU-s", COUNT / cpu_s, theirs, "RotorPy MinSnap and single"),
        _row("labels on disk, flight loop, 1 core", "1/CPU-s", 0.1 * COUNT / flight_cpu_s),
        *(_row(f"{n:,} rollouts on disk, {cores()} cores", "s", wall_s) for n, (wall_s, _) in commands.items()),
        *(_row(f"{n:,} rollouts, peak memory", "MB", peak_MB) for n, (_, peak_MB) in commands.items()),
        *(_row(f"share of {step}", "%", share) for step, share in shares(profile).items()),
    ]


def _made(world: World, count: int, profile: cProfile.Profile | None = None) -> float:
    """Make a data set on one core, in a folder that is thrown away; processor time in s."""
    with tempfile.TemporaryDirectory() as folder, profile or nullcontext():
        begun = time.process_time()
        collect(CollectConfig(world, seed=0), count, Path(folder), MultirotorSimulator(), spread=in_turn)
        return time.process_time() - begun


def shares(profile: cProfile.Profile) -> dict[str, float]:
    """Per cent of the processor time that each step took, and what is left for the rest."""
    statistics: Any = pstats.Stats(profile)
    took = {step: sum(_cumulative_s(statistics, f) for f in functions) for step, functions in STEPS.items()}
    parts = {step: 100.0 * seconds / statistics.total_tt for step, seconds in took.items()}
    return {**parts, "the rest (search's steps, copying)": 100.0 - sum(parts.values())}


def _cumulative_s(statistics: Any, function: FunctionType) -> float:
    code = function.__code__
    found = statistics.stats.get((code.co_filename, code.co_firstlineno, code.co_name))
    return 0.0 if found is None else float(found[3])


def _rotorpy_cpu_s() -> float:
    """Processor time to plan and to fly a few tasks by RotorPy."""
    tasks = first_tasks(WORLD.sampler, 0, PEER_FLIGHTS)
    begun = time.process_time()
    for index, waypoints in enumerate(tasks.poses):
        plan = MinSnap(waypoints[:, :3], waypoints[:, 3], yaw_rate_max=1e3, v_max=1e3, v_avg=WORLD.speed, verbose=False)
        coefficients = np.concatenate([plan.x_poly, plan.yaw_poly], axis=1)[:, :, ::-1].transpose(1, 0, 2)
        rotorpy_adapter.fly(Trajectory(np.asarray(plan.delta_t), coefficients), WORLD.vehicle(3), index)
    return time.process_time() - begun


def _command(count: int) -> tuple[float, float]:
    """Wall clock in s and most memory in MB of `lcd collect` on all cores, a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        options = ["--world", WORLD.name, "--count", str(count), "--out", folder, "--quiet"]
        begun = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-c", _COMMAND, "collect", *options], check=True, stdout=subprocess.PIPE, text=True
        )
        return time.perf_counter() - begun, int(done.stdout.split()[-1]) / 1024.0


_COMMAND = """
import sys
from pathlib import Path
from lcd_flight.cli.main import app, run
code = run(app, sys.argv[1:])
status = dict(line.split(":") for line in Path("/proc/self/status").read_text().splitlines())
print(status["VmHWM"].split()[0])
sys.exit(code)
"""
"""The command, and what Linux says of its memory: a parent would see its own where it was larger."""


def _row(what: str, unit: str, ours: float, peer: float | None = None, peer_name: str | None = None) -> Row:
    ratio = None if peer is None else ours / peer
    return {"what": what, "unit": unit, "ours": ours, "peer": peer, "peer_name": peer_name, "ratio": ratio}
