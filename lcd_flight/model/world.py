"""A world: vehicle, disturbances, speed and sampler of tasks, by name."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lcd_flight.model.types import FloatArray, IntArray, Loop, Vector3
from lcd_flight.model.vehicle import Vehicle


@dataclass(frozen=True, slots=True)
class TaskSampler:
    """How the paper draws waypoint-following tasks (paper, "Data Collection")."""

    waypoints: int
    box_m: Vector3
    """Edge lengths of the domain; it is centred at the origin in x and y and begins at z = 0."""
    distance_m: tuple[float, float]
    """Least and greatest distance from the previous waypoint."""
    yaw_span_rad: float
    """Yaw of each waypoint is uniform in +- this; 0 keeps it at zero."""
    margin_m: float = 0.0
    """How far waypoints stay from the walls of the domain."""


@dataclass(frozen=True, slots=True)
class World:
    """Everything that decides how hard a task is, apart from the task."""

    name: str
    version: int
    base_vehicle: Vehicle
    """With the motor lag and the noise of this world already in it."""
    drag_configurations: tuple[Vector3, ...]
    """c_D in N/(m/s)^2; the paper's experiment configurations 1 to 5."""
    speed: float
    """m/s, mean over a segment: T_i = |p_i+1 - p_i| / speed (paper's time allocation)."""
    sampler: TaskSampler
    loop: Loop
    start_aligned: bool
    """Whether the vehicle starts with the yaw of the first waypoint (else with yaw 0)."""
    source: str

    def vehicle(self, drag_configuration: int = 3) -> Vehicle:
        """The vehicle with one of the drag configurations, counted from 1 as in the paper.

        Raises:
            IndexError: there is no such configuration.
        """
        if not 1 <= drag_configuration <= len(self.drag_configurations):
            raise IndexError(f"world {self.name} has drag configurations 1 to {len(self.drag_configurations)}")
        return replace(self.base_vehicle, parasitic_drag=self.drag_configurations[drag_configuration - 1])


@dataclass(frozen=True, slots=True, eq=False)
class Tasks:
    """N waypoint-following tasks of K waypoints.

    waypoints_m: (N, K, 3) in the world; yaws_rad: (N, K), unwrapped as they are to be flown.
    """

    waypoints_m: FloatArray
    yaws_rad: FloatArray

    def __len__(self) -> int:
        """How many tasks there are."""
        return int(self.waypoints_m.shape[0])

    @property
    def poses(self) -> FloatArray:
        """(N, K, 4) x, y, z in m and yaw in rad, as planning takes waypoints."""
        return np.concatenate([self.waypoints_m, self.yaws_rad[..., None]], axis=2)

    def take(self, indices: slice | IntArray) -> Tasks:
        """The chosen ones."""
        return Tasks(self.waypoints_m[indices], self.yaws_rad[indices])

    def durations_s(self, speed: float) -> FloatArray:
        """(N, K - 1) the paper's time allocation at a mean speed in m/s."""
        return np.asarray(np.linalg.norm(np.diff(self.waypoints_m, axis=1), axis=2) / speed)
