"""The airframe under the firmware: the multirotor model, its inertial sensors and its battery.

Thrust counts and angles go in, what the sensors measure comes out. Sensors have a constant bias each, drawn from the
seed, and no noise: what an estimator without pose drifts by.
"""

from __future__ import annotations

import math
import random
from typing import NamedTuple

from lcd_flight.model import GRAVITY_M_PER_S2, Quaternion, State, Vector3, Vehicle
from lcd_flight.model.frames import conjugate, from_yaw, rotate, yaw_of
from sim_bridge.crazyflie.variants import FULL_SCALE, Variant
from sim_bridge.plant import Plant

PERIOD_NS = 2_000_000
"""Of the onboard controller: 500 Hz."""
PERIOD_S = PERIOD_NS * 1e-9
TURNING_COUNTS = 7000.0
"""Below this thrust no motor turns (dead band of the 2.x motors)."""
ACCELEROMETER_BIAS = 0.02
"""m/s^2, standard deviation of each axis."""
GYRO_BIAS = 3e-4
"""rad/s, likewise, after the firmware's calibration at rest."""


class Inertial(NamedTuple):
    """What the inertial sensors measure, body axes."""

    specific_force: Vector3
    """m/s^2; (0, 0, g) at rest."""
    body_rates: Vector3
    """rad/s"""


class Body:
    """One airframe, standing on the floor with its motors off."""

    def __init__(self, vehicle: Vehicle, variant: Variant, standing: State, seed: int, battery_V: float | None) -> None:
        self._vehicle = vehicle
        self._force_N = variant.force_N
        self._seed = seed
        self._plant = Plant(vehicle, standing, seed, battery_V=battery_V)
        self._floor_m = standing.p_WB[2]
        draws = random.Random(seed)  # noqa: S311 - not a secret
        self._acceleration_bias = _draws(draws, ACCELEROMETER_BIAS)
        self._rate_bias = _draws(draws, GYRO_BIAS)
        self._state = standing
        self.inertial = Inertial((0.0, 0.0, GRAVITY_M_PER_S2), (0.0, 0.0, 0.0))

    @property
    def state(self) -> State:
        """Where it truly is."""
        return self._state

    @property
    def on_ground(self) -> bool:
        """Whether it stands or lies on the floor."""
        return self.broken or self._plant.on_ground

    @property
    def broken(self) -> bool:
        """Whether it has crashed and lies on the floor, motors still, until somebody picks it up.

        It hit the floor hard or tilted, or left what the model holds for.
        """
        return self._plant.crashed

    @property
    def battery_V(self) -> float:
        """At the battery's terminals, under load."""
        return self._plant.battery_V

    @property
    def motor_shares(self) -> tuple[float, float, float, float]:
        """Commands as shares of the largest thrust, in the order of the vehicle file."""
        return self._plant.motor_shares

    @property
    def acceleration_g(self) -> Vector3:
        """What the accelerometer measures, in g."""
        x, y, z = self.inertial.specific_force
        return (x / GRAVITY_M_PER_S2, y / GRAVITY_M_PER_S2, z / GRAVITY_M_PER_S2)

    def command(self, counts: float, attitude_deg: Vector3) -> None:
        """Fly collective thrust counts and angles in deg of the body frame (pitch positive nose down)."""
        turning = counts if counts >= TURNING_COUNTS else 0.0
        full_N = self._vehicle.max_thrust_N
        self._plant.command(FULL_SCALE * self._force_N(turning, full_N) / full_N, attitude_deg)

    def advance(self) -> None:
        """Let one period pass."""
        before = self._state
        self._plant.advance(PERIOD_NS)
        self._state = self._lying(before) if self._plant.crashed else self._plant.state
        self.inertial = self._measured(before, self._state)

    def warm_up(self) -> None:
        """Compile what flying needs: seconds the first time, which must not fall into somebody's connecting."""
        Plant(self._vehicle, self._state, self._seed).advance(PERIOD_NS)

    def put_upright(self) -> None:
        """Somebody sets it on its feet where it lies; it can fly again."""
        x, y, _ = self._state.p_WB
        rest = (0.0, 0.0, 0.0)
        standing = State((x, y, self._floor_m), rest, from_yaw(yaw_of(self._state.q_WB)), rest)
        battery_V = self._plant.battery_V
        self._plant = Plant(self._vehicle, standing, self._seed, battery_V=battery_V, floor_m=self._floor_m)
        self._state = standing

    def _lying(self, before: State) -> State:
        """On the floor, turned as it was when it crashed."""
        x, y, _ = before.p_WB
        rest = (0.0, 0.0, 0.0)
        return State((x, y, self._floor_m), rest, before.q_WB, rest)

    def _measured(self, before: State, after: State) -> Inertial:
        """Standing, the floor carries it: its velocity does not change."""
        dv = [(b - a) / PERIOD_S for a, b in zip(before.v_WB_W, after.v_WB_W, strict=True)]
        free = (0.0, 0.0, GRAVITY_M_PER_S2) if self.on_ground else (dv[0], dv[1], dv[2] + GRAVITY_M_PER_S2)
        force = rotate(conjugate(after.q_WB), free)
        return Inertial(_sum(force, self._acceleration_bias), _sum(after.w_WB_B, self._rate_bias))


def _draws(draws: random.Random, sigma: float) -> Vector3:
    return (draws.gauss(0.0, sigma), draws.gauss(0.0, sigma), draws.gauss(0.0, sigma))


def _sum(a: Vector3, b: Vector3) -> Vector3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def degrees_of(q_WB: Quaternion) -> Vector3:
    """Roll, pitch (positive nose down) and yaw in deg (turns about x, y, z; yaw first)."""
    x, y, z, w = q_WB
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
    return (math.degrees(roll), math.degrees(pitch), math.degrees(yaw_of(q_WB)))
