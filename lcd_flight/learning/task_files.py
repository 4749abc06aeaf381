"""Tasks from a file in place of the sampler: NumPy's .npz with `waypoints` (N, K, 3) in m and `yaws` (N, K) in rad.

Or with `waypoints` (N, K, 4) alone: x, y, z in m and yaw in rad.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lcd_flight.learning.npz import read_array, read_arrays
from lcd_flight.model import InputError, Tasks
from lcd_flight.planning.times import SAME_POINT


def load_tasks(path: Path) -> Tasks:
    """Read tasks; yaws are unwrapped as they are to be flown.

    Raises:
        InputError: one line that names the file, the array, what is wrong and what it should be.
    """
    arrays = read_arrays(path, "`waypoints` and `yaws`")
    waypoints = read_array(path, arrays, "waypoints", "(N, K, 3) in m", dimensions=3)
    if "yaws" not in arrays and waypoints.shape[2] == 4:
        waypoints, arrays = waypoints[..., :3], arrays | {"yaws": waypoints[..., 3]}
    yaws = read_array(path, arrays, "yaws", "(N, K) in rad", dimensions=2)
    if waypoints.shape[2] != 3 or waypoints.shape[1] < 2 or not len(waypoints):
        raise InputError(f"{path}: waypoints has shape {waypoints.shape}; give (N, K, 3), N tasks of K >= 2 waypoints")
    if yaws.shape != waypoints.shape[:2]:
        raise InputError(f"{path}: yaws has shape {yaws.shape}; give {waypoints.shape[:2]}, one yaw for each waypoint")
    distances = np.linalg.norm(np.diff(waypoints, axis=1), axis=2)
    if distances.min() < SAME_POINT:
        task, segment = (int(i) for i in np.argwhere(distances < SAME_POINT)[0])
        raise InputError(f"{path}: task {task}: waypoints {segment} and {segment + 1} are the same; leave one out")
    return Tasks(waypoints, yaws)


def save_tasks(path: Path, tasks: Tasks) -> None:
    """Write tasks as `load_tasks` reads them.

    Raises:
        InputError: the file cannot be written.
    """
    try:
        with path.open("wb") as file:
            np.savez(file, waypoints=tasks.waypoints_m, yaws=tasks.yaws_rad)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error})") from error
