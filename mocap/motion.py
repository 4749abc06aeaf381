"""What the filter believes: pose, twist and acceleration with their covariances, and how a measurement changes it.

Translation is a constant-acceleration Kalman filter. Rotation is an error-state filter on SO(3) with constant angular
acceleration: the error is a rotation vector in the body frame, folded into the attitude after every measurement, so
that the attitude is never linearised about anything but itself (Sola, Quaternion kinematics for the error-state Kalman
filter, arXiv:1711.02508, sections 5 and 7).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from lcd_flight.model import PoseOptions, Quaternion, RawPose, State, Vector3
from lcd_flight.model.frames import conjugate, multiply, normalized
from mocap.kalman import RATE, VALUE, Covariance, grown, initial, measured

JERK_SIGMA = 100.0
"""m/s^3; how fast a quadrotor's acceleration changes."""
ANGULAR_JERK_SIGMA = 1000.0
"""rad/s^3"""
VELOCITY_SIGMA = 0.02
"""m/s, noise of a source's own twist."""
BODY_RATE_SIGMA = 0.05
"""rad/s, likewise."""

_UNKNOWN_VELOCITY, _UNKNOWN_ACCELERATION = 5.0, 20.0
_UNKNOWN_BODY_RATE, _UNKNOWN_ANGULAR_ACCELERATION = 10.0, 200.0
_ZERO: Vector3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Motion:
    """The estimate at the instant of the newest frame."""

    p_WB: Vector3
    v_WB_W: Vector3
    a_WB_W: Vector3
    """m/s^2"""
    linear: Covariance
    q_WB: Quaternion
    w_WB_B: Vector3
    alpha_WB_B: Vector3
    """rad/s^2"""
    angular: Covariance


def begun(raw: RawPose, options: PoseOptions) -> Motion:
    """From one frame alone: at rest, as far as is known."""
    motion = Motion(
        p_WB=raw.p_WB,
        v_WB_W=_ZERO,
        a_WB_W=_ZERO,
        linear=initial(options.position_noise_m, _UNKNOWN_VELOCITY, _UNKNOWN_ACCELERATION),
        q_WB=normalized(raw.q_WB),
        w_WB_B=_ZERO,
        alpha_WB_B=_ZERO,
        angular=initial(options.attitude_noise_rad, _UNKNOWN_BODY_RATE, _UNKNOWN_ANGULAR_ACCELERATION),
    )
    return _with_twist(motion, raw, options)


def followed(motion: Motion, raw: RawPose, dt_s: float, options: PoseOptions) -> Motion:
    """The estimate brought forward to a new frame, and the frame's pose (and twist) taken into it."""
    state = ahead(motion, dt_s)
    predicted = Motion(
        p_WB=state.p_WB,
        v_WB_W=state.v_WB_W,
        a_WB_W=motion.a_WB_W,
        linear=grown(motion.linear, dt_s, JERK_SIGMA),
        q_WB=state.q_WB,
        w_WB_B=state.w_WB_B,
        alpha_WB_B=motion.alpha_WB_B,
        angular=grown(motion.angular, dt_s, ANGULAR_JERK_SIGMA),
    )
    miss = _difference(raw.p_WB, state.p_WB)
    twist = rotation_vector(multiply(conjugate(state.q_WB), raw.q_WB))
    sigmas = (options.position_noise_m, options.attitude_noise_rad)
    return _with_twist(_corrected(predicted, VALUE, miss, twist, sigmas), raw, options)


def ahead(motion: Motion, dt_s: float) -> State:
    """Where the estimate will be `dt_s` later, its accelerations kept."""
    half = 0.5 * dt_s * dt_s
    turned = _along(_along(_ZERO, motion.w_WB_B, dt_s), motion.alpha_WB_B, half)
    return State(
        p_WB=_along(_along(motion.p_WB, motion.v_WB_W, dt_s), motion.a_WB_W, half),
        v_WB_W=_along(motion.v_WB_W, motion.a_WB_W, dt_s),
        q_WB=_turned(motion.q_WB, turned, 1.0),
        w_WB_B=_along(motion.w_WB_B, motion.alpha_WB_B, dt_s),
    )


def rotation_vector(q: Quaternion) -> Vector3:
    """The shorter rotation, as axis times angle in rad."""
    x, y, z, w = q if q[3] >= 0.0 else (-q[0], -q[1], -q[2], -q[3])
    sine = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 * math.atan2(sine, w) / sine if sine > 1e-9 else 2.0
    return (scale * x, scale * y, scale * z)


def _turned(q: Quaternion, vector: Vector3, share: float) -> Quaternion:
    """`q` turned by a share of a rotation vector in its own body frame."""
    x, y, z = share * vector[0], share * vector[1], share * vector[2]
    angle = math.sqrt(x * x + y * y + z * z)
    scale = math.sin(0.5 * angle) / angle if angle > 1e-9 else 0.5
    return normalized(multiply(q, (scale * x, scale * y, scale * z, math.cos(0.5 * angle))))


def _with_twist(motion: Motion, raw: RawPose, options: PoseOptions) -> Motion:
    """The source's own velocity and body rates as further measurements, where it sends them and they are wanted."""
    if not options.use_source_twist or raw.v_WB_W is None or raw.w_WB_B is None:
        return motion
    miss = _difference(raw.v_WB_W, motion.v_WB_W)
    twist = _difference(raw.w_WB_B, motion.w_WB_B)
    return _corrected(motion, RATE, miss, twist, (VELOCITY_SIGMA, BODY_RATE_SIGMA))


def _corrected(motion: Motion, component: int, miss: Vector3, twist: Vector3, sigmas: tuple[float, float]) -> Motion:
    """The estimate after a measurement of VALUE or RATE that missed it by `miss` and `twist`."""
    gain, linear = measured(motion.linear, component, sigmas[0])
    turn, angular = measured(motion.angular, component, sigmas[1])
    return Motion(
        p_WB=_along(motion.p_WB, miss, gain[0]),
        v_WB_W=_along(motion.v_WB_W, miss, gain[1]),
        a_WB_W=_along(motion.a_WB_W, miss, gain[2]),
        linear=linear,
        q_WB=_turned(motion.q_WB, twist, turn[0]),
        w_WB_B=_along(motion.w_WB_B, twist, turn[1]),
        alpha_WB_B=_along(motion.alpha_WB_B, twist, turn[2]),
        angular=angular,
    )


def _along(start: Vector3, direction: Vector3, distance: float) -> Vector3:
    return (
        start[0] + direction[0] * distance,
        start[1] + direction[1] * distance,
        start[2] + direction[2] * distance,
    )


def _difference(a: Vector3, b: Vector3) -> Vector3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])
