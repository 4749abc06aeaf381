"""From an attitude and a collective force to rotor speeds, 250 times a second, in the autopilot's own axes.

Source: PX4, src/modules/mc_att_control/AttitudeControl (Brescianini, Hehn, D'Andrea 2013: tilt first, heading with less
weight); body rates are corrected proportionally. The mixer is the airframe's inverse; too much for a rotor lowers all.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from lcd_flight.model import Vector3, Vehicle
from sim_bridge.mavlink.body import Speeds
from sim_bridge.mavlink.frames import Hamilton, inverse, product, turn, unit

HEADING_WEIGHT = 0.4
RATE_GAIN = 25.0
"""1/s, from an error of body rates to angular acceleration; less where the rotors follow slowly."""
LARGEST_RATES = (3.84, 3.84, 3.49)
"""rad/s (MC_ROLLRATE_MAX 220, MC_YAWRATE_MAX 200 deg/s)."""
HEADING_SHARE = 0.3
"""Of what the rotors could do about the heading at this thrust; the rest stays for the tilt."""
DOWN = (0.0, 0.0, 1.0)


class Gains(NamedTuple):
    """1/s, from an angle to a body rate."""

    tilt: float
    heading: float


class Stabilizer:
    """One airframe's."""

    def __init__(self, vehicle: Vehicle) -> None:
        self._k_eta, self._most_N = vehicle.k_eta, 0.25 * vehicle.max_thrust_N
        self._inertia = vehicle.inertia_kg_m2
        self._rate_gain = min(RATE_GAIN, 1.0 / vehicle.motor_time_constant_s)
        self._arm_m = vehicle.k_m / vehicle.k_eta
        right = [-y for _, y, _ in vehicle.rotor_positions_m]
        forward = [x for x, _, _ in vehicle.rotor_positions_m]
        clockwise = [-self._arm_m * direction for direction in vehicle.rotor_directions]
        effect = np.array([[1.0] * 4, [-y for y in right], forward, clockwise])
        self._mix: list[list[float]] = np.linalg.inv(effect).tolist()

    def speeds(self, wanted: Hamilton, force_N: float, q: Hamilton, rates: Vector3, gains: Gains) -> Speeds:
        """Rotor speeds in rad/s that turn `q` to `wanted` with this collective force."""
        goal = wanted_rates(wanted, q, gains)
        turns = (self._rate_gain * (g - w) * j for g, w, j in zip(goal, rates, self._inertia, strict=True))
        roll, pitch, yaw = turns
        most = HEADING_SHARE * force_N * self._arm_m
        return self._mixed((force_N, roll, pitch, _within(yaw, most)))

    def _mixed(self, wrench: tuple[float, float, float, float]) -> Speeds:
        forces = [sum(m * w for m, w in zip(row, wrench, strict=True)) for row in self._mix]
        excess = max(0.0, max(forces) - self._most_N)
        a, b, c, d = (math.sqrt(max(0.0, force - excess) / self._k_eta) for force in forces)
        return (a, b, c, d)


def wanted_rates(wanted: Hamilton, q: Hamilton, gains: Gains) -> Vector3:
    """Body rates in rad/s: the shortest way to the wanted thrust axis, and some of the turn about it."""
    tilt = product(_between(turn(q, DOWN), turn(wanted, DOWN)), q)
    rest = product(inverse(tilt), wanted)
    about = HEADING_WEIGHT * math.remainder(2.0 * math.atan2(rest[3], rest[0]), math.tau)
    goal = product(tilt, (math.cos(0.5 * about), 0.0, 0.0, math.sin(0.5 * about)))
    _, x, y, z = product(inverse(q), goal)  # its w is not negative: both turns are short ways
    each = (gains.tilt, gains.tilt, gains.heading / HEADING_WEIGHT)
    p, r, s = (_within(2.0 * g * e, most) for g, e, most in zip(each, (x, y, z), LARGEST_RATES, strict=True))
    return (p, r, s)


def _between(a: Vector3, b: Vector3) -> Hamilton:
    """The shortest turn from one direction to another; from one to its opposite, about x."""
    dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    if dot < -0.999999:
        return (0.0, 1.0, 0.0, 0.0)
    cross = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    return unit((1.0 + dot, *cross))


def _within(value: float, most: float) -> float:
    return max(-most, min(most, value))
