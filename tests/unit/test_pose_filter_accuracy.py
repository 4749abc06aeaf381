"""How well twist comes out of noisy poses: better than finite differences by the factors that are documented.

100 Hz, 1 mm and 0.5 deg of noise on each axis, a vehicle on sine waves of up to 15 m/s^2 and 3 rad/s.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from lcd_flight.model import PoseOptions, Quaternion, State, Vector3
from lcd_flight.model.frames import angle_between, conjugate, multiply
from lcd_flight.wire.mocap_frame import MocapFrame
from mocap.motion import rotation_vector
from mocap.pose_filter import FilterState, PoseFilter

PERIOD_S = 0.01
FRAMES = 1500
SETTLED = 100
POSITION_NOISE_M = 1e-3
ATTITUDE_NOISE_RAD = math.radians(0.5)
VELOCITY_NOISE, BODY_RATE_NOISE = 0.02, 0.05


def turn_about(axis: int, angle: float) -> Quaternion:
    vector = [0.0, 0.0, 0.0, math.cos(0.5 * angle)]
    vector[axis] = math.sin(0.5 * angle)
    return (vector[0], vector[1], vector[2], vector[3])


def pose_at(t: float) -> tuple[Vector3, Quaternion]:
    position = (1.5 * math.sin(math.pi * t), math.sin(0.8 * math.pi * t + 1.0), 1.0 + 0.5 * math.sin(0.6 * math.pi * t))
    roll, pitch = 0.5 * math.sin(2.0 * math.pi * t), 0.4 * math.sin(1.6 * math.pi * t + 0.5)
    yaw = 0.8 * math.sin(0.4 * math.pi * t)
    return position, multiply(multiply(turn_about(2, yaw), turn_about(1, pitch)), turn_about(0, roll))


def twist_at(t: float) -> tuple[Vector3, Vector3]:
    (p0, q0), (p1, q1) = pose_at(t - 1e-5), pose_at(t + 1e-5)
    turned = rotation_vector(multiply(conjugate(q0), q1))
    velocity = tuple((b - a) / 2e-5 for a, b in zip(p0, p1, strict=True))
    return velocity, tuple(c / 2e-5 for c in turned)


def shaken(rng: np.random.Generator, vector: Vector3, sigma: float) -> Vector3:
    x, y, z = (np.array(vector) + rng.normal(0.0, sigma, 3)).tolist()
    return (x, y, z)


def observed(*, with_twist: bool) -> list[MocapFrame]:
    rng = np.random.default_rng(5)
    frames = []
    for n in range(FRAMES):
        position, attitude = pose_at(PERIOD_S * n)
        velocity, rates = twist_at(PERIOD_S * n)
        wobble = shaken(rng, (0.0, 0.0, 0.0), ATTITUDE_NOISE_RAD)
        for axis in range(3):
            attitude = multiply(attitude, turn_about(axis, wobble[axis]))
        frames.append(
            MocapFrame(
                body="b",
                sequence=n,
                frame_number=n,
                source_time_ns=n * 10_000_000,
                send_time_ns=n * 10_000_000,
                clock_id="c",
                position=shaken(rng, position, POSITION_NOISE_M),
                quaternion=attitude,
                velocity=shaken(rng, velocity, VELOCITY_NOISE) if with_twist else None,
                body_rates=shaken(rng, rates, BODY_RATE_NOISE) if with_twist else None,
            )
        )
    return frames


def errors(state: State, t: float) -> tuple[float, float, float, float]:
    """Norms: m, m/s, rad, rad/s."""
    (position, attitude), (velocity, rates) = pose_at(t), twist_at(t)
    return (
        math.dist(state.p_WB, position),
        math.dist(state.v_WB_W, velocity),
        angle_between(state.q_WB, attitude),
        math.dist(state.w_WB_B, rates),
    )


def filtered_rms(frames: list[MocapFrame], ahead_s: float = 0.0) -> list[float]:
    """Root mean squares of `errors` over the flight, with the pose brought `ahead_s` beyond each frame."""
    pose_filter, state, found = PoseFilter(PoseOptions()), FilterState(), []
    for frame in frames:
        state = pose_filter.step(state, frame, frame.source_time_ns)
        estimate = pose_filter.report(state, frame.source_time_ns + round(ahead_s * 1e9)).state
        if frame.sequence >= SETTLED and estimate is not None:
            found.append(errors(estimate, PERIOD_S * frame.sequence + ahead_s))
    assert len(found) == FRAMES - SETTLED
    return np.sqrt(np.mean(np.square(found), axis=0)).tolist()


def differenced_rms(frames: list[MocapFrame]) -> tuple[float, float]:
    """What finite differences of neighbouring poses give, m/s and rad/s."""
    found = []
    for before, after in zip(frames[SETTLED - 1 :], frames[SETTLED:], strict=False):
        velocity, rates = twist_at(PERIOD_S * after.sequence)
        moved = [(b - a) / PERIOD_S for a, b in zip(before.position, after.position, strict=True)]
        turned = rotation_vector(multiply(conjugate(before.quaternion), after.quaternion))
        found.append((math.dist(moved, velocity), math.dist([c / PERIOD_S for c in turned], rates)))
    velocity_rms, rate_rms = np.sqrt(np.mean(np.square(found), axis=0)).tolist()
    return velocity_rms, rate_rms


def test_twist_from_poses_alone() -> None:
    frames = observed(with_twist=False)
    velocity_fd, rates_fd = differenced_rms(frames)
    assert velocity_fd == pytest.approx(0.25, rel=0.05)
    assert rates_fd == pytest.approx(2.1, rel=0.05)
    position, velocity, attitude, rates = filtered_rms(frames)
    assert position < 0.0015
    assert velocity < 0.076
    assert attitude < math.radians(0.75)
    assert rates < 0.71


def test_the_source_twist_makes_it_better_still() -> None:
    _, velocity, _, rates = filtered_rms(observed(with_twist=True))
    assert velocity < 0.03
    assert rates < 0.08


def test_half_a_period_ahead_is_hardly_worse() -> None:
    position, velocity, attitude, rates = filtered_rms(observed(with_twist=False), ahead_s=0.005)
    assert position < 0.002
    assert velocity < 0.09
    assert attitude < math.radians(0.9)
    assert rates < 0.8


def test_coasting_over_fifty_milliseconds_stays_within_centimetres() -> None:
    position, _, attitude, _ = filtered_rms(observed(with_twist=False), ahead_s=0.05)
    assert position < 0.01
    assert attitude < math.radians(4.0)
