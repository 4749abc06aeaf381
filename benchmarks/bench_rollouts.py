"""What a closed-loop rollout costs: ours against RotorPy 3.0.0, single and batched, on the same trajectories.

Everybody flies the paper's loop with motor noise at 100 Hz. Processor time on one thread counts, so that a busy machine
is nobody's loss; the rows of all cores are of the wall clock. RotorPy is measured twice: as it is used (`simulate` and
`simulate_batch`, with their sensors), and bare: its vehicle's step and its controller's update, nothing else. In the
batch it is given our references, which cost next to nothing.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from rotorpy.controllers.quadrotor_control import SE3Control
from rotorpy.environments import Environment
from rotorpy.sensors.imu import BatchedImu
from rotorpy.simulate import simulate_batch
from rotorpy.vehicles.multirotor import Multirotor
from rotorpy.wind.default_winds import BatchedNoWind
from rotorpy.world import World
from threadpoolctl import threadpool_limits

from benchmarks.rotorpy_batched import batch_of
from lcd_flight.learning.sampling import first_tasks
from lcd_flight.model import FloatArray, Loop, RolloutOptions, Trajectories, Trajectory
from lcd_flight.planning.minimum_snap import minimum_snap_batch
from lcd_flight.worlds import load_world
from sim_bridge import rotorpy_adapter
from sim_bridge.rollouts import MultirotorSimulator

WORLD = load_world("crazyflie-paper")
VEHICLE = WORLD.vehicle(3)
COUNT = 4096
"""Rollouts of ours in one batch."""
REPEATS = 5
"""The best counts: what disturbs a measurement only ever slows it down."""
SINGLE_FLIGHTS = 2
BATCHES = (500, 1000, 2000, 4000, 8000, 16000)
"""Sizes that RotorPy is tried with; its best counts."""
FLOP_PER_TICK = 2291
"""Additions, multiplications, divisions and square roots of a tick in the paper's loop with noise, as counted in the
machine code of the loops over lanes; one that is fused counts as two (decision 0083)."""
PEAK_NUMBERS, PEAK_ROUNDS, PEAK_CHAIN = 128, 100_000, 32
BATCH_TICKS = 10
BOUNDS = (-100.0, 100.0) * 3
"""Of RotorPy's world, m."""
LOOPS: tuple[Loop, ...] = ("paper", "flight")

Report = Callable[[str], None]
Row = dict[str, Any]


def rows(report: Report) -> list[Row]:
    """All rows of `lcd bench rollouts`."""
    torch.set_num_threads(1)
    with threadpool_limits(1):
        plans = tasks_flown(COUNT)
        report(f"ours, {COUNT} rollouts; a first run compiles")
        paper, flight = (_ours(loop, plans, threads=1) for loop in LOOPS)
        cores = os.cpu_count() or 1
        on_all = [_ours(loop, plans, threads=cores, clock=time.perf_counter) for loop in LOOPS]
        report(f"RotorPy single, {SINGLE_FLIGHTS} rollouts")
        few = plans.take(range(SINGLE_FLIGHTS))
        single = {"RotorPy single": _rotorpy_simulate(few), "RotorPy single, bare": _rotorpy_single(few)}
        batched = _best_batches(report)
        ceilings = {"multiply and add in registers": peak_rate(), "numpy's matrix product": product_rate()}
    unit, ticks = "ticks/CPU-s", float(np.mean(_ticks(plans)))
    what = "paper's loop, noise on, 1 core"
    rollouts = f"rollouts of {ticks / 100.0:.1f} s, paper's loop, 1 core"
    arithmetic = f"arithmetic, {FLOP_PER_TICK:,} operations a tick, 1 core"
    return [
        *(_row(what, unit, paper, peer, name) for name, peer in single.items()),
        *(_row(f"{what}; its best batch, {size}", unit, paper, peer, name) for name, (peer, size) in batched.items()),
        _row(rollouts, "1/CPU-s", paper / ticks, single["RotorPy single"] / ticks, "RotorPy single"),
        *(_row(arithmetic, "GFLOP/CPU-s", 1e-9 * paper * FLOP_PER_TICK, 1e-9 * c, n) for n, c in ceilings.items()),
        _row("flight loop, onboard PID at 500 Hz, noise on, 1 core", unit, flight),
        *(_row(f"{name} loop, {cores} cores", "ticks/s", ours) for name, ours in zip(LOOPS, on_all, strict=True)),
    ]


def _best_batches(report: Report) -> dict[str, tuple[float, int]]:
    """Both of RotorPy's batched measurements, each at the size that it is fastest with."""
    measures = {"RotorPy batched": _rotorpy_simulate_batch, "RotorPy batched, bare": _rotorpy_batched}
    best = dict.fromkeys(measures, (0.0, 0))
    for size in BATCHES:
        report(f"RotorPy batched rk4, {size} vehicles")
        for name, measure in measures.items():
            best[name] = max(best[name], (measure(tasks_flown(size)), size))
    return best


def tasks_flown(count: int) -> Trajectories:
    """Minimum snap through the world's tasks."""
    tasks = first_tasks(WORLD.sampler, 0, count)
    poses = np.concatenate([tasks.waypoints_m, tasks.yaws_rad[..., None]], axis=2)
    return minimum_snap_batch(poses, tasks.durations_s(WORLD.speed))


def _ticks(plans: Trajectories) -> FloatArray:
    """(N,) control steps of each rollout."""
    return np.ceil(plans.durations_s.sum(axis=1) / 0.01 - 1e-9)


def _ours(loop: Loop, plans: Trajectories, threads: int, clock: Callable[[], float] = time.process_time) -> float:
    """Ticks per second."""
    seeds = np.arange(len(plans), dtype=np.uint64)
    options = RolloutOptions(loop=loop, start_aligned=WORLD.start_aligned, threads=threads)
    simulator = MultirotorSimulator()
    simulator.rollout(plans, VEHICLE, seeds, options)
    best = np.inf
    for _ in range(REPEATS):
        begun = clock()
        simulator.rollout(plans, VEHICLE, seeds, options)
        best = min(best, clock() - begun)
    return float(_ticks(plans).sum() / best)


def _rotorpy_simulate(plans: Trajectories) -> float:
    """Ticks per CPU second of its own simulation, sensors and all."""
    took = 0.0
    for plan in plans:
        craft = Multirotor(rotorpy_adapter.parameters(VEHICLE))
        craft.initial_state = rotorpy_adapter.initial_state(plan, VEHICLE, start_aligned=True)
        controller = SE3Control(rotorpy_adapter.parameters(VEHICLE))
        environment = Environment(craft, controller, Flown(plan), world=World.empty(BOUNDS))
        begun = time.process_time()
        environment.run(t_final=plan.duration_s)
        took += time.process_time() - begun
    return float(_ticks(plans).sum() / took)


class Flown:
    """A plan as RotorPy's trajectory object."""

    def __init__(self, plan: Trajectory) -> None:
        self._plan = plan

    def update(self, time_s: float) -> dict[str, Any]:
        """The flat output at a time, as its `simulate` asks for it."""
        return rotorpy_adapter.flat_output(self._plan, time_s)


def _rotorpy_single(plans: Trajectories) -> float:
    """Ticks per CPU second of its vehicle's step and its controller's update alone."""
    begun = time.process_time()
    for index, plan in enumerate(plans):
        rotorpy_adapter.fly(plan, VEHICLE, index)
    return float(_ticks(plans).sum() / (time.process_time() - begun))


def _rotorpy_simulate_batch(plans: Trajectories) -> float:
    """Ticks per CPU second of its own batched simulation; rk4 is faster than its default dopri5."""
    count = len(plans)
    craft, controller, state = batch_of(plans, VEHICLE)
    imu, wind = BatchedImu(count, sampling_rate=100), BatchedNoWind(count)
    ends = np.full(count, 0.01 * BATCH_TICKS - 0.005)
    begun = time.process_time()
    simulate_batch(World.empty(BOUNDS), state, craft, controller, First(plans), wind, imu, ends, 0.01, 0.25, False)
    return count * BATCH_TICKS / (time.process_time() - begun)


def _rotorpy_batched(plans: Trajectories) -> float:
    """Ticks per CPU second of its batched step and update alone."""
    count, everybody, wanted = len(plans), np.arange(len(plans)), First(plans)
    craft, controller, state = batch_of(plans, VEHICLE)
    control = controller.update(0.0, state, wanted.update(np.zeros(1)), everybody)
    begun = time.process_time()
    for tick in range(1, BATCH_TICKS + 1):
        state["wind"] = torch.zeros(count, 3, dtype=torch.float64)
        state = craft.step(state, control, 0.01, everybody)
        control = controller.update(0.01 * tick, state, wanted.update(np.array([0.01 * tick])), everybody)
    return count * BATCH_TICKS / (time.process_time() - begun)


class First:
    """The plans' first segments as RotorPy's batched trajectory: as far as the measurement goes."""

    def __init__(self, plans: Trajectories) -> None:
        self._first = plans.coefficients[:, :, 0, :]

    def update(self, times_s: FloatArray) -> dict[str, Any]:
        """Flat outputs at one time for all."""
        time_s, powers = float(times_s[0]), np.arange(8)
        position = torch.from_numpy(self._first @ (time_s**powers))
        velocity = torch.from_numpy(self._first[..., 1:] @ (powers[1:] * time_s ** powers[:-1]))
        acceleration = torch.from_numpy(self._first[..., 2:] @ (powers[2:] * powers[1:-1] * time_s ** powers[:-2]))
        return {
            **{"x": position[:, :3], "x_dot": velocity[:, :3], "x_ddot": acceleration[:, :3]},
            **{"yaw": position[:, 3], "yaw_dot": velocity[:, 3]},
        }


def peak_rate() -> float:
    """Floating-point operations per CPU second of one thread that does nothing but multiply and add in registers."""
    import numba

    multiply = numba.njit(fastmath={"contract"})(_multiply_and_add)
    numbers = np.linspace(0.0, 1.0, PEAK_NUMBERS)
    multiply(numbers, 1)
    best = np.inf
    for _ in range(REPEATS):
        begun = time.process_time()
        multiply(numbers, PEAK_ROUNDS)
        best = min(best, time.process_time() - begun)
    return 2.0 * PEAK_CHAIN * PEAK_NUMBERS * PEAK_ROUNDS / best


def _multiply_and_add(numbers: FloatArray, rounds: int) -> None:
    for _ in range(rounds):
        for i in range(len(numbers)):
            value = numbers[i]
            for _ in range(PEAK_CHAIN):
                value = value * 0.999 + 1e-3
            numbers[i] = value


def product_rate() -> float:
    """Floating-point operations per CPU second of a product of matrices, as numpy's library does it."""
    size = 1024
    matrix = np.random.default_rng(0).random((size, size))
    best = np.inf
    for _ in range(REPEATS):
        begun = time.process_time()
        matrix @ matrix
        best = min(best, time.process_time() - begun)
    return 2.0 * size**3 / best


def _row(what: str, unit: str, ours: float, peer: float | None = None, peer_name: str | None = None) -> Row:
    ratio = None if peer is None else ours / peer
    return {"what": what, "unit": unit, "ours": ours, "peer": peer, "peer_name": peer_name, "ratio": ratio}
