"""Where the autopilot believes it is: inertial sensors, corrected by the poses that come as ODOMETRY.

As in PX4's EKF2 and ArduPilot's EKF3, position, velocity and heading are taken from a pose; roll and pitch are not:
they come from the gyroscope and from what positions say about the acceleration. It is an observer with constant gains,
not a Kalman filter: poles at 4 rad/s for each axis, where the innovation also turns the attitude that explains it.
The frame is that of the poses: where their x is not north, its heading is not from north either.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from lcd_flight.model import GRAVITY_M_PER_S2, Vector3
from sim_bridge.mavlink.body import PERIOD_S, Inertial
from sim_bridge.mavlink.frames import Hamilton, heading, level, product, small_turn, turn, unit, wrapped

POLE = 4.0
"""rad/s"""
HEADING_POLE = 5.0
"""rad/s"""
VELOCITY_POLE = 3.0
"""rad/s, for a velocity that comes with a pose."""
LEVELLING, LEVELLING_AT_REST = 0.1, 2.0
"""rad/s for each rad between the estimated down and the accelerometer's, where no pose corrects it."""
GATE_M, GATE_GROWTH = 0.5, 0.5
"""m, and m/s since the last pose that was taken: a position that is farther off is not."""
FORGET_NS = 7_000_000_000
"""After so long of poses that were not taken it starts anew from one."""
STEADY_NS = 300_000_000
"""Poses farther apart are no steady stream (ArduPilot, AP_VisualOdom: 300 ms)."""
LONGEST_STEP_S = 0.25
_NS_PER_S = 1e9


@dataclass(frozen=True, slots=True)
class SeenPose:
    """What somebody saw of the vehicle, in a frame whose z is down."""

    position: Vector3
    attitude: Hamilton
    velocity_B: Vector3 | None
    """m/s, FRD; None: unknown."""
    resets: int
    """Changes where the frame or the tracking did."""


class Estimator:
    """One vehicle's; it starts level, at the origin, without a position."""

    def __init__(self, yaw_rad: float = 0.0) -> None:
        self.attitude: Hamilton = level(yaw_rad)
        self.position: Vector3 = (0.0, 0.0, 0.0)
        self.velocity: Vector3 = (0.0, 0.0, 0.0)
        self.rates: Vector3 = (0.0, 0.0, 0.0)
        """rad/s, FRD."""
        self.offset: Vector3 = (0.0, 0.0, 0.0)
        """m, added to what is seen: where its origin is not the frame's."""
        self.taken_ns: int | None = None
        """When the last pose was taken; None: none was yet."""
        self.since_ns = self.steady_ns = 0
        """Since when poses have been coming, without a gap of 7 s; and without one of 0.3 s."""
        self.ratio = 0.0
        """The last innovation over its gate."""
        self._seen_ns: int | None = None
        self._resets: int | None = None

    def age_s(self, now_ns: int) -> float:
        """Since the last pose that was taken."""
        return math.inf if self.taken_ns is None else (now_ns - self.taken_ns) / _NS_PER_S

    def predict(self, measured: Inertial, now_ns: int, at_rest: bool) -> None:
        """One period of the inertial sensors. at_rest: landed, so that the accelerometer sees down alone."""
        self.rates = measured.body_rates
        p, q, r = (PERIOD_S * rate for rate in measured.body_rates)
        self.attitude = unit(product(self.attitude, small_turn((p, q, r))))
        north, east, down = turn(self.attitude, measured.specific_force)
        if at_rest or self.age_s(now_ns) > 1.0:
            gain = (LEVELLING_AT_REST if at_rest else LEVELLING) * PERIOD_S / GRAVITY_M_PER_S2
            self._lean((-gain * east, gain * north, 0.0))
        self._move((north, east, down + GRAVITY_M_PER_S2), at_rest)

    def see(self, pose: SeenPose, now_ns: int, *, heading_too: bool = True, velocity_too: bool = True) -> None:
        """A pose from outside."""
        seen = _added(pose.position, self.offset, 1.0)
        if self._seen_ns is None or now_ns - self._seen_ns > FORGET_NS:
            self.since_ns = now_ns
        if self._seen_ns is None or now_ns - self._seen_ns > STEADY_NS:
            self.steady_ns = now_ns
        dt_s = min(LONGEST_STEP_S, self.age_s(now_ns))
        self._seen_ns = now_ns
        error = _added(seen, self.position, -1.0)
        gate_m = GATE_M + GATE_GROWTH * self.age_s(now_ns)
        self.ratio = 0.0 if self.taken_ns is None else math.hypot(*error) / gate_m
        if self.taken_ns is None or pose.resets != self._resets or self.age_s(now_ns) * _NS_PER_S > FORGET_NS:
            self._start(seen, pose, heading_too)
        elif self.ratio > 1.0:
            return
        else:
            self._correct(error, pose, dt_s, heading_too, velocity_too)
        self.taken_ns, self._resets = now_ns, pose.resets

    def _start(self, seen: Vector3, pose: SeenPose, heading_too: bool) -> None:
        if heading_too:
            self._face(heading(pose.attitude) - heading(self.attitude))
        self.position, self.ratio = seen, 0.0
        self.velocity = (0.0, 0.0, 0.0) if pose.velocity_B is None else turn(self.attitude, pose.velocity_B)

    def _correct(self, error: Vector3, pose: SeenPose, dt_s: float, heading_too: bool, velocity_too: bool) -> None:
        pole = min(POLE, 0.4 / max(dt_s, 1e-3))
        self.position = _added(self.position, error, 3.0 * pole * dt_s)
        self.velocity = _added(self.velocity, error, 3.0 * pole * pole * dt_s)
        lean = pole**3 * dt_s / GRAVITY_M_PER_S2
        self._lean((lean * error[1], -lean * error[0], 0.0))
        if velocity_too and pose.velocity_B is not None:
            difference = _added(turn(self.attitude, pose.velocity_B), self.velocity, -1.0)
            self.velocity = _added(self.velocity, difference, 1.0 - math.exp(-VELOCITY_POLE * dt_s))
        if heading_too:
            turned = wrapped(heading(pose.attitude) - heading(self.attitude))
            self._face((1.0 - math.exp(-HEADING_POLE * dt_s)) * turned)

    def _lean(self, rotation: Vector3) -> None:
        """Turn the estimate by a small rotation vector of the frame."""
        self.attitude = unit(product(small_turn(rotation), self.attitude))

    def _face(self, yaw_rad: float) -> None:
        self.attitude = unit(product(level(yaw_rad), self.attitude))

    def _move(self, acceleration: Vector3, at_rest: bool) -> None:
        """Standing, nothing moves, whatever the accelerometer's bias says."""
        if at_rest:
            self.velocity = (0.0, 0.0, 0.0)
            return
        before = self.velocity
        self.velocity = _added(before, acceleration, PERIOD_S)
        self.position = _added(self.position, _added(before, acceleration, 0.5 * PERIOD_S), PERIOD_S)


def _added(a: Vector3, b: Vector3, share: float) -> Vector3:
    return (a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2])
