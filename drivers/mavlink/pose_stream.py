"""Which frames of motion capture go to the vehicle, with the velocity that they show. Pure."""

from __future__ import annotations

import math
from collections import deque

from drivers.mavlink.odometry_wire import Odometry
from lcd_flight.model import Quaternion, RawPose, Vector3
from lcd_flight.model.frames import conjugate, multiply

WINDOW = 6
"""Frames that a velocity is taken over: 50 ms at 100 Hz, so it lags by 25 ms."""
JUMP_SPEED = 10.0
"""m/s: faster is a jump."""
JUMP_M = 0.05
"""On top, for noise."""
GAP_NS = 500_000_000
"""After so long without a frame, what follows is a new beginning."""


class PoseStream:
    """Takes every frame; gives those that are due."""

    def __init__(self, rate_hz: float) -> None:
        self._period_ns = round(1e9 / rate_hz)
        self._due_ns: int | None = None
        self._frames: deque[RawPose] = deque(maxlen=WINDOW)
        self._resets = 0

    def take(self, raw: RawPose) -> Odometry | None:
        """One frame as it arrived; None where another went out a moment ago."""
        if self._frames and self._jumped(self._frames[-1], raw):
            self._resets += 1
            self._frames.clear()
        self._frames.append(raw)
        if self._due_ns is not None and raw.arrival_ns < self._due_ns - self._period_ns // 4:
            return None
        before_ns = raw.arrival_ns if self._due_ns is None else self._due_ns
        self._due_ns = max(before_ns, raw.arrival_ns - self._period_ns // 2) + self._period_ns
        return Odometry(raw.arrival_ns, raw.p_WB, raw.q_WB, self._velocity(raw), self._rates(raw), self._resets)

    @staticmethod
    def _jumped(before: RawPose, raw: RawPose) -> bool:
        gap_ns = raw.arrival_ns - before.arrival_ns
        reach_m = JUMP_SPEED * max(gap_ns, 0) * 1e-9 + JUMP_M
        return gap_ns > GAP_NS or math.dist(before.p_WB, raw.p_WB) > reach_m

    def _span_s(self) -> float:
        """By the source's own clock: arrivals jitter."""
        return (self._frames[-1].source_stamp_ns - self._frames[0].source_stamp_ns) * 1e-9

    def _velocity(self, raw: RawPose) -> Vector3:
        """m/s in the world: the source's own, or by differences."""
        if raw.v_WB_W is not None:
            return raw.v_WB_W
        span_s, first = self._span_s(), self._frames[0].p_WB
        if span_s <= 0.0:
            return (0.0, 0.0, 0.0)
        x, y, z = ((b - a) / span_s for a, b in zip(first, raw.p_WB, strict=True))
        return (x, y, z)

    def _rates(self, raw: RawPose) -> Vector3:
        """rad/s in the body."""
        if raw.w_WB_B is not None:
            return raw.w_WB_B
        span_s = self._span_s()
        if span_s <= 0.0:
            return (0.0, 0.0, 0.0)
        x, y, z = _turn(multiply(conjugate(self._frames[0].q_WB), raw.q_WB))
        return (x / span_s, y / span_s, z / span_s)


def _turn(q: Quaternion) -> Vector3:
    """The rotation vector of a small rotation, rad."""
    x, y, z, w = q if q[3] >= 0.0 else (-q[0], -q[1], -q[2], -q[3])
    size = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 if size < 1e-9 else 2.0 * math.atan2(size, w) / size
    return (scale * x, scale * y, scale * z)
