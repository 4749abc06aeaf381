"""What a camera system would see of a simulated vehicle: noisy poses, as mocap frames in our own axes (ENU)."""

from __future__ import annotations

import math

import numpy as np

from lcd_flight.model import Quaternion, State, Vector3
from lcd_flight.model.frames import multiply, normalized
from lcd_flight.model.streams import Stream
from lcd_flight.wire.mocap_frame import MocapFrame, encode

VELOCITY_NOISE = 0.02
"""m/s, standard deviation of the published twist, each axis."""
BODY_RATE_NOISE = 0.05
"""rad/s, likewise."""
CLOCK_ID = "host monotonic"


class Camera:
    """Numbers frames and adds noise, which depends on the seed and the frame's number alone."""

    def __init__(self, rigid_body: str, seed: int, noise_mm: float, noise_deg: float, *, twist: bool) -> None:
        self._rigid_body = rigid_body
        self._noise = Stream(seed, "sim/camera")
        self._position_sigma_m = noise_mm * 1e-3
        self._attitude_sigma_rad = math.radians(noise_deg)
        self._twist = twist
        self._frames = 0

    def frame(self, state: State, state_ns: int, now_ns: int) -> bytes:
        """The next frame, sent at `now_ns`: the vehicle as it was at `state_ns`."""
        n = self._frames
        self._frames += 1
        draws: list[float] = self._noise.normals(np.array([n]), 12)[0].tolist()
        seen = MocapFrame(
            body=self._rigid_body,
            sequence=n,
            frame_number=n,
            source_time_ns=state_ns,
            send_time_ns=now_ns,
            clock_id=CLOCK_ID,
            position=_shaken(state.p_WB, draws[0:3], self._position_sigma_m),
            quaternion=_turned(state.q_WB, draws[3:6], self._attitude_sigma_rad),
            velocity=_shaken(state.v_WB_W, draws[6:9], VELOCITY_NOISE) if self._twist else None,
            body_rates=_shaken(state.w_WB_B, draws[9:12], BODY_RATE_NOISE) if self._twist else None,
        )
        return encode(seen)


def _shaken(vector: Vector3, draws: list[float], sigma: float) -> Vector3:
    return (vector[0] + sigma * draws[0], vector[1] + sigma * draws[1], vector[2] + sigma * draws[2])


def _turned(q: Quaternion, draws: list[float], sigma: float) -> Quaternion:
    """Turned by a small rotation vector in the body."""
    x, y, z = (0.5 * sigma * draw for draw in draws)
    return normalized(multiply(q, (x, y, z, 1.0)))
