"""Worlds for a vehicle of one's own: the paper's tasks, at speeds that suit it.

The hardest is the speed at which minimum snap crashes in about two tasks of five, as in the paper's tables; two
slower ones teach the model what ordinary missions look like (decision 0048).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from lcd_flight.learning.flying import options_of
from lcd_flight.learning.sampling import first_tasks
from lcd_flight.model import InputError, Loop, Simulator, Vehicle, World
from lcd_flight.planning.minimum_snap import minimum_snap_batch
from lcd_flight.worlds import load_world

CRASH_SHARE = 0.4
"""Of the tasks, by minimum snap, in the hardest world."""
SLOWER = (1.0, 0.7, 0.4)
"""Speeds of the worlds, relative to the hardest."""
DRAG_SCALES = (0.5, 1.0, 1.5)
"""Of the vehicle's own parasitic drag, which nobody knows exactly."""
_TASKS = 400
_SPEED_RANGE = (0.25, 16.0)
_STEPS = 12


def worlds_of(vehicle: Vehicle, loop: Loop, simulator: Simulator) -> tuple[World, ...]:
    """Worlds of `vehicle` flown by `loop`, hardest first; their speeds are measured in the simulator.

    Raises:
        InputError: minimum snap crashes at every speed, or at none.
    """
    hardest = _hardest_speed(_world(vehicle, loop, 1.0), simulator)
    return tuple(_world(vehicle, loop, float(f"{share * hardest:.2g}")) for share in SLOWER)


def _world(vehicle: Vehicle, loop: Loop, speed: float) -> World:
    drag = np.array(vehicle.parasitic_drag)
    scales = DRAG_SCALES if drag.any() else (1.0,)
    configurations = tuple(tuple((scale * drag).tolist()) for scale in scales)
    return replace(
        load_world("crazyflie-paper"),
        name=f"{vehicle.name}-{loop}@{speed:g}",
        version=1,
        base_vehicle=vehicle,
        drag_configurations=configurations,
        speed=speed,
        loop=loop,
        source=f"the paper's tasks, at a speed chosen for {vehicle.name}",
    )


def _hardest_speed(world: World, simulator: Simulator) -> float:
    """By halving the range of its logarithm, m/s."""
    low, high = _SPEED_RANGE
    if crash_share(replace(world, speed=low), simulator) > CRASH_SHARE:
        raise InputError(
            f"vehicle {world.base_vehicle.name}: crashes along minimum snap even at {low:g} m/s; check mass, thrust "
            "coefficient, rotor speeds and gains in its file"
        )
    if crash_share(replace(world, speed=high), simulator) < CRASH_SHARE:
        raise InputError(
            f"vehicle {world.base_vehicle.name}: never crashes along minimum snap up to {high:g} m/s; check its file"
        )
    for _ in range(_STEPS):
        middle = math.sqrt(low * high)
        if crash_share(replace(world, speed=middle), simulator) < CRASH_SHARE:
            low = middle
        else:
            high = middle
    return math.sqrt(low * high)


def crash_share(world: World, simulator: Simulator) -> float:
    """Of minimum snap on development tasks of a world, its middle drag configuration."""
    tasks = first_tasks(world.sampler, 0, _TASKS)
    plans = minimum_snap_batch(tasks.poses, tasks.durations_s(world.speed))
    vehicle = world.vehicle((len(world.drag_configurations) + 1) // 2)
    seeds = np.arange(_TASKS, dtype=np.uint64)
    return float(simulator.rollout(plans, vehicle, seeds, options_of(world)).crashed.mean())
