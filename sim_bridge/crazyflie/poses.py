"""Poses from outside, as they come over the localization port.

Source: crazyflie-firmware 2026.08, src/modules/src/crtp_localization_service.c; quatcompress.h.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

from lcd_flight.model import Quaternion, Vector3
from sim_bridge.crazyflie.crtp import Packet

POSITION, GENERIC, POSITION_PACKED = 0, 1, 2
EMERGENCY_STOP, EMERGENCY_STOP_WATCHDOG, POSE, POSE_PACKED = 3, 4, 8, 9
_POSITION = struct.Struct("<fff")
_POSE = struct.Struct("<fffffff")
_PACKED_POSITION = struct.Struct("<Bhhh")
_PACKED_POSE = struct.Struct("<BhhhI")
_MAGNITUDE = (1 << 9) - 1


@dataclass(frozen=True, slots=True)
class SeenPose:
    """What somebody saw of the vehicle, in the world: position in m, and attitude xyzw where it was seen."""

    p_WB: Vector3
    q_WB: Quaternion | None


def decode_pose(packet: Packet, address: int) -> SeenPose | None:
    """The pose in a localization packet; None where there is none for this vehicle, or one that is not finite.

    address: the last byte of the vehicle's radio address, by which it finds itself in the packed forms.
    """
    seen = _decoded(packet, address)
    if seen is None or not all(map(math.isfinite, (*seen.p_WB, *(seen.q_WB or ())))):
        return None
    return seen if seen.q_WB is None or math.hypot(*seen.q_WB) > 1e-6 else None


def _decoded(packet: Packet, address: int) -> SeenPose | None:
    payload = packet.payload
    if packet.channel == POSITION and len(payload) >= _POSITION.size:
        x, y, z = _POSITION.unpack_from(payload)
        return SeenPose((x, y, z), None)
    if packet.channel == POSITION_PACKED:
        return _own(payload, _PACKED_POSITION, address)
    if packet.channel != GENERIC or not payload:
        return None
    if payload[0] == POSE and len(payload) > _POSE.size:
        x, y, z, *q = _POSE.unpack_from(payload, 1)
        return SeenPose((x, y, z), (q[0], q[1], q[2], q[3]))
    return _own(payload[1:], _PACKED_POSE, address) if payload[0] == POSE_PACKED else None


def _own(data: bytes, form: struct.Struct, address: int) -> SeenPose | None:
    """This vehicle's among several; lengths are in mm."""
    whole = data[: len(data) - len(data) % form.size]
    for number, x, y, z, *attitude in form.iter_unpack(whole):
        if number == address:
            q_WB = decompressed(attitude[0]) if attitude else None
            return SeenPose((x * 1e-3, y * 1e-3, z * 1e-3), q_WB)
    return None


def decompressed(bits: int) -> Quaternion:
    """The quaternion xyzw in 32 bits: which component is largest, then sign and size of the other three."""
    largest = bits >> 30
    q = [0.0, 0.0, 0.0, 0.0]
    for component in (3, 2, 1, 0):
        if component != largest:
            size = (bits & _MAGNITUDE) / _MAGNITUDE * math.sqrt(0.5)
            q[component] = -size if bits >> 9 & 1 else size
            bits >>= 10
    q[largest] = math.sqrt(max(0.0, 1.0 - sum(x * x for x in q)))
    return (q[0], q[1], q[2], q[3])


def compressed(q: Quaternion) -> int:
    """The 32 bits of a unit quaternion."""
    largest = max(range(4), key=lambda component: abs(q[component]))
    bits = largest
    for component in range(4):
        if component != largest:
            negative = (q[component] < 0.0) != (q[largest] < 0.0)
            size = min(_MAGNITUDE, int(_MAGNITUDE * abs(q[component]) / math.sqrt(0.5) + 0.5))
            bits = bits << 10 | negative << 9 | size
    return bits
