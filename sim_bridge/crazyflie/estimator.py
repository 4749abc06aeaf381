"""Where the vehicle believes it is: inertial sensors, corrected by the poses that come over the radio.

A Kalman filter of the form of crazyflie-firmware's (src/modules/src/kalman_core.c: the same states, initial and process
variances and bounds), with axes apart: position and velocity of an axis share a 2 x 2 covariance, each axis of the
attitude has a variance. What is left out: drag, and that a position corrects the attitude. Without pose it drifts.

Where poses are not used, the attitude alone is estimated, as by the complementary filter (sensfusion6_impl.c, after
Mahony): the accelerometer pulls it level.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from lcd_flight.model import GRAVITY_M_PER_S2, Quaternion, State, Vector3
from lcd_flight.model.frames import conjugate, from_yaw, multiply, normalized, rotate
from sim_bridge.crazyflie.body import PERIOD_S, Inertial

POSITION_VARIANCE = (1e4, 1e4, 1.0)
"""m^2 after a reset (100 m, 100 m, 1 m squared)."""
VELOCITY_VARIANCE = 1e-4
ATTITUDE_VARIANCE = 1e-4
PROCESS_ACCELERATION = (0.5, 0.5, 1.0)
"""m/s^2, standard deviation of what acceleration is not known."""
GYRO_NOISE = (0.1, 0.1, 0.1)
"""rad/s, likewise of the body rates."""
LEVELLING = 0.4
"""rad/s for each rad between the estimated up and the accelerometer's (TWO_KP_DEF / 2)."""
LARGEST_VARIANCE, SMALLEST_VARIANCE = 1e4, 1e-6
SIGMAS = (1e-6, 1e6)
"""Least and greatest standard deviation that a pose is believed to have, whatever the parameters say."""
FARTHEST_M, FASTEST = 100.0, 10.0
"""Beyond these the firmware's filter starts anew (kalman_supervisor.c)."""


@dataclass(slots=True)
class _Axis:
    """Position and velocity along one axis of the world and their covariance."""

    position: float
    pp: float
    sigma: float
    """Process acceleration."""
    velocity: float = 0.0
    pv: float = 0.0
    vv: float = VELOCITY_VARIANCE

    def predict(self, acceleration: float) -> None:
        dt = PERIOD_S
        self.position += dt * (self.velocity + 0.5 * dt * acceleration)
        self.velocity += dt * acceleration
        kick = self.sigma * dt
        self.pp = _bounded(self.pp + dt * (2.0 * self.pv + dt * self.vv) + 0.25 * (kick * dt) ** 2)
        self.pv += dt * self.vv + 0.5 * kick * kick * dt
        self.vv = _bounded(self.vv + kick * kick)

    def correct(self, measured: float, sigma: float) -> None:
        spread = self.pp + sigma * sigma
        gain, gain_v = self.pp / spread, self.pv / spread
        error = measured - self.position
        self.position += gain * error
        self.velocity += gain_v * error
        self.vv = _bounded(self.vv - gain_v * self.pv)
        self.pv *= 1.0 - gain
        self.pp = _bounded(self.pp * (1.0 - gain))


@dataclass(slots=True)
class Estimator:
    """State and covariance; `fresh` makes one."""

    axes: tuple[_Axis, _Axis, _Axis]
    attitude: Quaternion
    attitude_variance: list[float] = field(default_factory=lambda: [ATTITUDE_VARIANCE] * 3)
    acceleration: Vector3 = (0.0, 0.0, 0.0)
    """m/s^2 in the world, without gravity."""
    body_rates: Vector3 = (0.0, 0.0, 0.0)

    @staticmethod
    def fresh(position_m: Vector3 = (0.0, 0.0, 0.0), yaw_rad: float = 0.0) -> Estimator:
        """As after a reset: level, at rest, sure of nothing."""
        start = [_bounded(position, -FARTHEST_M, FARTHEST_M) for position in position_m]
        yaw_rad = _bounded(yaw_rad, -math.tau, math.tau)
        values = zip(start, POSITION_VARIANCE, PROCESS_ACCELERATION, strict=True)
        x, y, z = (_Axis(position, variance, sigma) for position, variance, sigma in values)
        return Estimator((x, y, z), from_yaw(yaw_rad))

    @property
    def state(self) -> State:
        """The estimate."""
        x, y, z = self.axes
        return State(
            (x.position, y.position, z.position), (x.velocity, y.velocity, z.velocity), self.attitude, self.body_rates
        )

    @property
    def position_variance(self) -> Vector3:
        """Of each axis, m^2."""
        x, y, z = self.axes
        return (x.pp, y.pp, z.pp)

    @property
    def velocity_variance(self) -> Vector3:
        """Of each axis, m^2/s^2."""
        x, y, z = self.axes
        return (x.vv, y.vv, z.vv)

    @property
    def lost(self) -> bool:
        """Whether it has left what it can hold."""
        return not all(abs(axis.position) <= FARTHEST_M and abs(axis.velocity) <= FASTEST for axis in self.axes)

    def predict(self, measured: Inertial) -> None:
        """One period of the inertial sensors, in the filter that takes poses."""
        self._turn(measured, (0.0, 0.0, 0.0))
        for n, sigma in enumerate(GYRO_NOISE):
            self.attitude_variance[n] = _bounded(self.attitude_variance[n] + (sigma * PERIOD_S) ** 2)
        for axis, acceleration in zip(self.axes, self.acceleration, strict=True):
            axis.predict(acceleration)

    def level(self, measured: Inertial) -> None:
        """One period in the filter that takes none: turn towards where the accelerometer sees up."""
        ux, uy, uz = rotate(conjugate(self.attitude), (0.0, 0.0, 1.0))
        ax, ay, az = measured.specific_force
        gain = LEVELLING / max(math.hypot(ax, ay, az), 1e-3)
        self._turn(measured, (gain * (ay * uz - az * uy), gain * (az * ux - ax * uz), gain * (ax * uy - ay * ux)))

    def _turn(self, measured: Inertial, extra: Vector3) -> None:
        """Integrate the gyroscope, and what is to be added to it; rad/s."""
        self.body_rates = measured.body_rates
        p, q, r = (0.5 * PERIOD_S * (rate + more) for rate, more in zip(measured.body_rates, extra, strict=True))
        self.attitude = normalized(multiply(self.attitude, (p, q, r, 1.0)))
        x, y, z = rotate(self.attitude, measured.specific_force)
        self.acceleration = (x, y, z - GRAVITY_M_PER_S2)

    def see_position(self, p_WB: Vector3, sigma_m: float) -> None:
        """A position from outside."""
        sigma_m = _bounded(sigma_m, *SIGMAS)
        for axis, measured in zip(self.axes, p_WB, strict=True):
            axis.correct(measured, sigma_m)

    def see_attitude(self, q_WB: Quaternion, sigma_rad: float) -> None:
        """An attitude from outside, any length but none: its difference as a small turn in the body."""
        sigma_rad = _bounded(sigma_rad, *SIGMAS)
        x, y, z, w = multiply(conjugate(self.attitude), normalized(q_WB))
        sign = 2.0 if w >= 0.0 else -2.0
        turn = [0.0, 0.0, 0.0]
        for n, error in enumerate((sign * x, sign * y, sign * z)):
            variance = self.attitude_variance[n]
            gain = variance / (variance + sigma_rad * sigma_rad)
            turn[n] = 0.5 * gain * error
            self.attitude_variance[n] = _bounded(variance * (1.0 - gain))
        self.attitude = normalized(multiply(self.attitude, (turn[0], turn[1], turn[2], 1.0)))


def _bounded(value: float, low: float = SMALLEST_VARIANCE, high: float = LARGEST_VARIANCE) -> float:
    """Within the limits, those of a variance unless others are given; what is no number becomes the larger one."""
    return min(max(value, low), high) if not math.isnan(value) else high
