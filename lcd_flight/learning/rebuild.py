"""From stored rows back to what was flown: the same arithmetic as when it was flown."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from lcd_flight.learning.rollouts import Plans
from lcd_flight.learning.sources import training_tasks, whitening
from lcd_flight.learning.spread import cores
from lcd_flight.model import FloatArray, Trajectories, World
from lcd_flight.planning.knots import Whitening

_ROWS_AT_A_TIME = 2048


def variables(world: World, seed: int, plans: Plans) -> Whitening:
    """The planner's variables for each row's task."""
    key, row_key = np.unique(2 * plans.task + plans.short_yaw, return_inverse=True)
    tasks = training_tasks(world.sampler, seed, key // 2, key % 2 == 1)
    return whitening(tasks, world.speed).take(row_key)


def trajectories(world: World, seed: int, plans: Plans) -> Trajectories:
    """The plans as polynomials."""
    space = variables(world, seed, plans)
    return space.plan(plans.z.astype(np.float64).reshape(space.z_shape), plans.theta.astype(np.float64))


def in_slices(part: Callable[[slice], FloatArray], rows: int) -> list[FloatArray]:
    """What `part` gives for slices of the rows, in order; it must release the interpreter's lock to gain from this."""
    slices = [slice(i, min(i + _ROWS_AT_A_TIME, rows)) for i in range(0, rows, _ROWS_AT_A_TIME)]
    with ThreadPoolExecutor(cores()) as pool:
        return list(pool.map(part, slices))
