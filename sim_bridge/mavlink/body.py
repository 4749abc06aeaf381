"""The airframe under the autopilot: the multirotor model by rotor speeds, inertial sensors in FRD, the battery.

Sensors have a constant bias each, drawn from the seed, and no noise.
"""

from __future__ import annotations

import math
import random
from typing import NamedTuple

import numpy as np

from lcd_flight.model import GRAVITY_M_PER_S2, State, Vector3, Vehicle
from lcd_flight.model.frames import conjugate, from_yaw, rotate, yaw_of
from sim_bridge.battery import Battery
from sim_bridge.craft import craft_of
from sim_bridge.kernels import rows
from sim_bridge.kernels.block import Craft
from sim_bridge.kernels.judge import MAX_RATE, MAX_SPEED
from sim_bridge.kernels.lane import TICK_S, aim_rotors
from sim_bridge.kernels.multirotor import Motion
from sim_bridge.kernels.plant import IMPACT_SPEED, IMPACT_UPRIGHT
from sim_bridge.kernels.rows import LANES, ROWS, load4, load_motion, store_motion
from sim_bridge.mavlink.frames import forward_right_down
from sim_bridge.mavlink.rotor_kernel import rotor_kernel
from sim_bridge.plant import CRASH_SPEED, CRASH_UPRIGHT

PERIOD_NS = 4_000_000
"""Of the onboard controller: 250 Hz."""
PERIOD_S = PERIOD_NS * 1e-9
STEPS = 2
"""Of the equations of motion in a period."""
ACCELEROMETER_BIAS = 0.02
"""m/s^2, standard deviation of each axis."""
GYRO_BIAS = 3e-4
"""rad/s, likewise, after calibration at rest."""

Speeds = tuple[float, float, float, float]


class Inertial(NamedTuple):
    """What the inertial sensors measure: FRD."""

    specific_force: Vector3
    """m/s^2; (0, 0, -g) at rest."""
    body_rates: Vector3
    """rad/s"""


class Body:
    """One airframe, standing on the floor with its motors off."""

    def __init__(self, vehicle: Vehicle, standing: State, seed: int, battery_V: float | None) -> None:
        self.vehicle = vehicle
        self._craft = _craft(vehicle)
        self._seed = np.uint64(seed % 2**64)
        self._floor_m = standing.p_WB[2]
        self._battery = Battery.at_voltage(battery_V)
        draws = random.Random(seed)  # noqa: S311 - not a secret
        self._force_bias = _draws(draws, ACCELEROMETER_BIAS)
        self._rate_bias = _draws(draws, GYRO_BIAS)
        self._place(standing)

    def _place(self, standing: State) -> None:
        self._memory, self._contact, self._steps = np.zeros(ROWS * LANES), np.array([0.0, 1.0]), 0
        motion = Motion(standing.p_WB, standing.v_WB_W, standing.q_WB, standing.w_WB_B)
        store_motion(self._memory, rows.MOTION, 0, motion)
        self.state = standing
        """Where it truly is."""
        self.broken = False
        """Whether it hit the floor hard or tilted, or left what the model holds for: it lies there, motors still."""
        self.inertial = self._measured((0.0, 0.0, 0.0))

    @property
    def on_ground(self) -> bool:
        """Whether it stands or lies on the floor."""
        return self.broken or self.state.p_WB[2] <= self._floor_m

    @property
    def height_m(self) -> float:
        """Above the floor."""
        return self.state.p_WB[2] - self._floor_m

    @property
    def battery_V(self) -> float:
        """A cell's voltage, under load."""
        return self._battery.voltage_V

    @property
    def battery_share(self) -> float:
        """What is left of its charge, 0 to 1."""
        return self._battery.charge

    def set_battery(self, volts: float) -> None:
        """Exchange the cell for one that shows so many volts at rest."""
        self._battery = Battery.at_voltage(volts)

    def command(self, speeds: Speeds) -> None:
        """Turn the rotors, rad/s, in the order of the vehicle file."""
        still = (0.0, 0.0, 0.0, 0.0)
        aim_rotors(self._memory, 0, still if self.broken else speeds, self._craft.air)

    def advance(self) -> None:
        """Let one period pass."""
        if self.broken:
            return
        before = self.state
        rotor_kernel()(self._memory, self._contact, self._seed, self._steps, STEPS, self._craft, self._floor_m)
        self._steps += STEPS
        self.broken = self._has_crashed()
        self.state = self._lying(before) if self.broken else self._moved()
        a, b, c, d = load4(self._memory, rows.SPEEDS, 0)
        thrust_N = self.vehicle.k_eta * float(a * a + b * b + c * c + d * d)
        self._battery = self._battery.drained(thrust_N / self.vehicle.weight_N, PERIOD_S)
        change = zip(before.v_WB_W, self.state.v_WB_W, strict=True)
        x, y, z = ((after - earlier) / PERIOD_S for earlier, after in change)
        self.inertial = self._measured((0.0, 0.0, 0.0) if self.on_ground else (x, y, z))

    def warm_up(self) -> None:
        """Compile what flying needs: seconds the first time, which must not fall into somebody's connecting."""
        Body(self.vehicle, self.state, 0, None).advance()

    def put_upright(self) -> None:
        """Somebody sets it on its feet where it lies; it can fly again."""
        x, y, _ = self.state.p_WB
        rest = (0.0, 0.0, 0.0)
        self._place(State((x, y, self._floor_m), rest, from_yaw(yaw_of(self.state.q_WB)), rest))

    def _moved(self) -> State:
        x, y, z, vx, vy, vz, qx, qy, qz, qw, p, q, r = map(float, self._memory[: 13 * LANES : LANES])
        return State((x, y, z), (vx, vy, vz), (qx, qy, qz, qw), (p, q, r))

    def _lying(self, before: State) -> State:
        """On the floor, turned as it was when it crashed."""
        x, y, _ = before.p_WB
        rest = (0.0, 0.0, 0.0)
        return State((x, y, self._floor_m), rest, before.q_WB, rest)

    def _measured(self, acceleration_W: Vector3) -> Inertial:
        """The floor carries what stands: its velocity does not change."""
        x, y, z = acceleration_W
        force = rotate(conjugate(self.state.q_WB), (x, y, z + GRAVITY_M_PER_S2))
        rates = self.state.w_WB_B
        return Inertial(
            _sum(forward_right_down(force), self._force_bias), _sum(forward_right_down(rates), self._rate_bias)
        )

    def _has_crashed(self) -> bool:
        """Whether it may not fly on; what is not a number is within nothing."""
        _, v, _, w = load_motion(self._memory, rows.MOTION, 0)
        within = all(abs(x) <= MAX_SPEED for x in v) and all(abs(x) <= MAX_RATE for x in w)
        soft = self._contact[IMPACT_SPEED] <= CRASH_SPEED and self._contact[IMPACT_UPRIGHT] >= CRASH_UPRIGHT
        return not (within and soft)


def _craft(vehicle: Vehicle) -> Craft:
    """The model's constants at the steps flown here; what flies it is not the simulator's."""
    step_s = PERIOD_S / STEPS
    decay = math.exp(-0.5 * step_s / vehicle.motor_time_constant_s)
    return craft_of(vehicle, vehicle, "paper")._replace(steps=round(TICK_S / step_s), step_s=step_s, motor_decay=decay)


def _draws(draws: random.Random, sigma: float) -> Vector3:
    return (draws.gauss(0.0, sigma), draws.gauss(0.0, sigma), draws.gauss(0.0, sigma))


def _sum(a: Vector3, b: Vector3) -> Vector3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])
