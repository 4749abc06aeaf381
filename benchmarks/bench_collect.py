"""What a labelled rollout costs from nothing to disk, and where the time goes; RotorPy's way to one beside it.

Processor time counts where one core works, so that a busy machine is nobody's loss; rows of all cores are of the wall
clock. The peer plans its minimum snap and flies it in closed loop, one after another, and writes nothing.
"""

from __future__ import annotations

import cProfile
import pstats
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
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
from lcd_flight.learning.spread import Spread, cores, in_threads, in_turn
from lcd_flight.model import Trajectory
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
            _made(world, 1_000, in_turn)
        report(f"ours, {COUNT:,} rollouts on one core, then on all")
        profile = cProfile.Profile(time.thread_time)
        cpu_s = _made(WORLD, COUNT, in_turn, profile)[1]
        flight_cpu_s = _made(FLIGHT, COUNT // 10, in_turn)[1]
        wall_s = _made(WORLD, COUNT, in_threads())[0]
        report(f"RotorPy, {PEER_FLIGHTS} tasks")
        theirs = PEER_FLIGHTS / _rotorpy_cpu_s()
    return [
        _row("labels on disk, paper's loop, 1 core", "1/CPU-s", COUNT / cpu_s, theirs, "RotorPy MinSnap and single"),
        _row("labels on disk, flight loop, 1 core", "1/CPU-s", 0.1 * COUNT / flight_cpu_s),
        _row(f"labels on disk, paper's loop, {cores()} cores", "1/s", COUNT / wall_s),
        _row(f"{COUNT:,} rollouts on disk, {cores()} cores", "s", wall_s),
        *(_row(f"share of {step}", "%", share) for step, share in shares(profile).items()),
        _row(f"peak memory, {COUNT:,} rollouts, {cores()} cores", "MB", _peak_MB(COUNT)),
        _row(f"peak memory, {5 * COUNT:,} rollouts, {cores()} cores", "MB", _peak_MB(5 * COUNT)),
    ]


def _made(world: Any, count: int, spread: Spread, profile: cProfile.Profile | None = None) -> tuple[float, float]:
    """Make a data set in a folder that is thrown away; wall clock and processor time in s."""
    with tempfile.TemporaryDirectory() as folder:
        begun_s, begun_cpu_s = time.perf_counter(), time.process_time()
        if profile is not None:
            profile.enable()
        collect(CollectConfig(world, seed=0), count, Path(folder), MultirotorSimulator(), spread=spread)
        if profile is not None:
            profile.disable()
        return time.perf_counter() - begun_s, time.process_time() - begun_cpu_s


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


def _peak_MB(count: int) -> float:
    """The most memory that `lcd collect` ever held, in a process of its own."""
    script = """
import sys
from pathlib import Path
from lcd_flight.cli.main import app, run
code = run(app, sys.argv[1:])
status = dict(line.split(":") for line in Path("/proc/self/status").read_text().splitlines())
print(status["VmHWM"].split()[0])
sys.exit(code)
"""
    with tempfile.TemporaryDirectory() as folder:
        options = ["--world", WORLD.name, "--count", str(count), "--out", folder, "--quiet"]
        command = [sys.executable, "-c", script, "collect", *options]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    return int(done.stdout.split()[-1]) / 1024.0


def _row(what: str, unit: str, ours: float, peer: float | None = None, peer_name: str | None = None) -> Row:
    ratio = None if peer is None else ours / peer
    return {"what": what, "unit": unit, "ours": ours, "peer": peer, "peer_name": peer_name, "ratio": ratio}
