"""Our frames (world z up, body forward-left-up, xyzw) and MAVLink's (NED or FRD, body forward-right-down, wxyz).

`enu`: x points east and y north, so MAVLink's world is north-east-down. `flu`: motion capture points anywhere, and
MAVLink's world is its x, minus its y and minus its z. Each map is its own inverse. Setpoint and pose must use the same.
"""

from __future__ import annotations

import math
from typing import TypeAlias

from drivers.mavlink.options import Frame
from lcd_flight.model import Quaternion, Vector3

WireQuaternion: TypeAlias = tuple[float, float, float, float]
"""w, x, y, z."""

_HALF = math.sqrt(0.5)


def vector(v_W: Vector3, frame: Frame) -> Vector3:
    """A vector of the world, from ours to theirs and from theirs to ours."""
    x, y, z = v_W
    return (y, x, -z) if frame == "enu" else (x, -y, -z)


def body(v_B: Vector3) -> Vector3:
    """A vector of the body: forward-left-up to forward-right-down, and back."""
    x, y, z = v_B
    return (x, -y, -z)


def attitude(q_WB: Quaternion, frame: Frame) -> WireQuaternion:
    """Ours as theirs: q' = q_frame * q_WB * rpy(pi, 0, 0), the q_frame of `enu` being rpy(pi, 0, pi/2)."""
    return _to_wire(_turned(q_WB, frame))


def attitude_from(q: WireQuaternion, frame: Frame) -> Quaternion:
    """Theirs as ours."""
    w, x, y, z = q
    return _turned((x, y, z, w), frame)


def _turned(q: Quaternion, frame: Frame) -> Quaternion:
    """The product of `attitude`, multiplied out; turning twice is turning not at all."""
    x, y, z, w = q
    if frame == "enu":
        return (_HALF * (x + y), _HALF * (x - y), _HALF * (w - z), _HALF * (w + z))
    return (x, -y, -z, w)


def _to_wire(q: Quaternion) -> WireQuaternion:
    x, y, z, w = q
    return (w, x, y, z)
