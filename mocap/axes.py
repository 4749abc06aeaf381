"""From the axes of a motion capture system to ours: world z up (ENU), body forward-left-up, right-handed.

| axes | world | body |
|---|---|---|
| enu | x east or forward, y north or left, z up | x forward, y left, z up |
| ned | x north, y east, z down | x forward, y right, z down (FRD) |
| y_up | x as ours, y up, z = minus our y | x forward, y up, z right |

`y_up` is how cameras with a vertical y axis name things (OptiTrack Motive's default): a body that was defined while its
nose pointed along +x has its own axes named likewise. All maps are rotations, so handedness is kept.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from lcd_flight.model import MocapAxes, Quaternion, RawPose, Vector3
from lcd_flight.model.frames import conjugate, multiply
from lcd_flight.wire.mocap_frame import MocapFrame

_HALF_ROOT = 0.5**0.5


@dataclass(frozen=True, slots=True)
class _Map:
    """World and body vectors as permutations, and the same two rotations as quaternions."""

    world: Callable[[Vector3], Vector3]
    body: Callable[[Vector3], Vector3]
    q_world: Quaternion
    q_body: Quaternion


def _unchanged(v: Vector3) -> Vector3:
    return v


def _swapped(v: Vector3) -> Vector3:
    """North-east-down to east-north-up: half a turn about the horizontal diagonal."""
    return (v[1], v[0], -v[2])


def _rolled_over(v: Vector3) -> Vector3:
    """Forward-right-down to forward-left-up: half a turn about x."""
    return (v[0], -v[1], -v[2])


def _tipped(v: Vector3) -> Vector3:
    """y up to z up: a quarter turn about x."""
    return (v[0], -v[2], v[1])


_MAPS: dict[MocapAxes, _Map] = {
    "enu": _Map(_unchanged, _unchanged, (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0)),
    "ned": _Map(_swapped, _rolled_over, (_HALF_ROOT, _HALF_ROOT, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)),
    "y_up": _Map(_tipped, _tipped, (_HALF_ROOT, 0.0, 0.0, _HALF_ROOT), (_HALF_ROOT, 0.0, 0.0, _HALF_ROOT)),
}


def to_world(frame: MocapFrame, arrival_ns: int) -> RawPose:
    """The frame's pose and twist in our world and body axes; numbers are taken as they are, NaN included."""
    mapped = _MAPS[frame.axes]
    q_WB = frame.quaternion
    if frame.axes != "enu":
        q_WB = multiply(multiply(mapped.q_world, q_WB), conjugate(mapped.q_body))
    return RawPose(
        sequence=frame.sequence,
        source_stamp_ns=frame.source_time_ns,
        arrival_ns=arrival_ns,
        p_WB=mapped.world(frame.position),
        q_WB=q_WB,
        v_WB_W=None if frame.velocity is None else mapped.world(frame.velocity),
        w_WB_B=None if frame.body_rates is None else mapped.body(frame.body_rates),
    )
