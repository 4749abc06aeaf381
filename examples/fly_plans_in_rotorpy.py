"""Fly planned polynomials in RotorPy 3.0.0, beside our simulator: `python examples/fly_plans_in_rotorpy.py PLANS.npz`.

PLANS.npz is what `lcd plan --tasks FILE.npz --world W --out PLANS.npz` writes; it says which world it was planned for.
Each plan is flown once for each noise seed by RotorPy's own Multirotor and SE3Control (a second or two a flight), and
as often as that and more in our simulator. A crash is a position error above 1.5 m, or leaving the model's validity.
"""

import argparse
import json
import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from lcd_flight import plugins
from lcd_flight.learning.plan_files import PlannedTasks, load_plans
from lcd_flight.model import CRASH_ERROR_M, RolloutOptions, Trajectories, Trajectory, Vehicle, World
from lcd_flight.worlds import fingerprint, load_world

OUR_FLIGHTS = 20
"""Of each plan in our simulator: they cost nothing, and leave RotorPy's flights as the only source of scatter."""


def fly(plan: Trajectory, vehicle: Vehicle, seed: int, aligned: bool) -> tuple[float, bool]:
    """One flight in RotorPy: largest position error in m, and whether it flew to the end."""
    from sim_bridge import rotorpy_adapter

    flight = rotorpy_adapter.fly(plan, vehicle, seed, start_aligned=aligned)
    return flight.max_error_m, flight.valid


def in_rotorpy(plans: Trajectories, vehicle: Vehicle, world: World, seeds: int, processes: int) -> np.ndarray:
    """(N, seeds) which flights crashed."""
    crashed = np.zeros((len(plans), seeds), bool)
    with ProcessPoolExecutor(processes) as pool:
        rows = [
            (n, seed, pool.submit(fly, plans[n], vehicle, 1000 * seed + n, world.start_aligned))
            for n in range(len(plans))
            for seed in range(seeds)
        ]
        for flown, (n, seed, flight) in enumerate(rows, start=1):
            error_m, valid = flight.result()
            crashed[n, seed] = error_m > CRASH_ERROR_M or not valid
            print(f"\r{flown}/{len(rows)} flights, {crashed.sum()} crashed", end="", flush=True)
    print()
    return crashed


def in_ours(plans: Trajectories, vehicle: Vehicle, world: World) -> np.ndarray:
    """(N, OUR_FLIGHTS) which flights crashed."""
    rows = np.repeat(np.arange(len(plans)), OUR_FLIGHTS)
    options = RolloutOptions(loop=world.loop, start_aligned=world.start_aligned)
    seeds = np.arange(len(rows), dtype=np.uint64)
    return plugins.simulator().rollout(plans.take(rows), vehicle, seeds, options).crashed.reshape(-1, OUR_FLIGHTS)


def planned_for(plans: PlannedTasks, name: str | None, drag: int | None) -> tuple[World, Vehicle]:
    """The world and the vehicle of a file, or those asked for."""
    world = load_world(name or plans.about["world"].split()[0])
    if world.loop != "paper":
        raise SystemExit(f"{world.name}: RotorPy flies the paper's loop, not the {world.loop} loop")
    vehicle = world.vehicle(drag or plans.about.get("drag", 3))
    if plans.about.get("vehicle_fingerprint", fingerprint(vehicle, world.loop)) != fingerprint(vehicle, world.loop):
        raise SystemExit(f"{world.name}: its vehicle is another one now than the plans were made for; plan again")
    if plans.about.get("controller", "geometric") != "geometric":
        raise SystemExit(f"planned for the controller {plans.about['controller']}, which RotorPy does not have")
    return world, vehicle


def main() -> None:
    """Fly, and compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plans", type=Path)
    parser.add_argument("--world", help="in place of the one that the file names")
    parser.add_argument("--drag", type=int, help="drag configuration, in place of the file's")
    parser.add_argument("--count", type=int, default=100, help="so many of the plans, the first ones")
    parser.add_argument("--seeds", type=int, default=1, help="flights of each plan in RotorPy")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--out", type=Path, help="write the result as JSON")
    options = parser.parse_args()

    planned = load_plans(options.plans)
    world, vehicle = planned_for(planned, options.world, options.drag)
    plans = planned.trajectories.take(np.arange(min(options.count, len(planned))))
    ours = in_ours(plans, vehicle, world)
    theirs = in_rotorpy(plans, vehicle, world, options.seeds, options.processes)

    chances = ours.mean(axis=1)
    expected = float(chances.sum()) * options.seeds
    scatter = float(np.sqrt((chances * (1.0 - chances)).sum() * options.seeds))
    unexpected = np.abs(theirs.mean(axis=1) - chances) > 0.5
    result = {
        "plans": str(options.plans),
        "planned": {key: planned.about.get(key) for key in ("world", "method", "timing", "drag", "model")},
        "flights": theirs.size,
        "rotorpy_crashes": int(theirs.sum()),
        "expected_crashes": expected,
        "expected_scatter": scatter,
        "rotorpy_crash_percent": 100.0 * float(theirs.mean()),
        "our_crash_percent": 100.0 * float(ours.mean()),
        "unexpected_plans": np.flatnonzero(unexpected).tolist(),
    }
    print(f"RotorPy: {theirs.sum()} of {theirs.size} flights crashed ({result['rotorpy_crash_percent']:.1f} %)")
    print(f"expected by our simulator: {expected:.1f} +- {scatter:.1f} ({result['our_crash_percent']:.1f} %)")
    print(f"plans that fared otherwise than expected: {result['unexpected_plans'] or 'none'}")
    if options.out:
        options.out.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
