"""SET_ATTITUDE_TARGET (82), validated before it goes anywhere: pymavlink encodes NaN and 1.5 without complaint."""

from __future__ import annotations

import math

from drivers.mavlink import frames_wire
from drivers.mavlink.dialect import Message, mavlink
from drivers.mavlink.options import Frame
from lcd_flight.model import Quaternion

IGNORE_RATES = 7
"""type_mask: attitude and thrust count. Both flavours take it; ArduPilot drops 71 and resets itself on mixed masks."""
UNIT_TOLERANCE = 1e-3
"""ArduPilot drops a quaternion whose squared length is further off."""
_WRAP_MS = 1 << 32


def time_boot_ms(now_ns: int) -> int:
    """Milliseconds in the 32 bits that the field has."""
    return (now_ns // 1_000_000) % _WRAP_MS


def attitude_target(q_WB: Quaternion, thrust: float, *, now_ns: int, target: tuple[int, int], frame: Frame) -> Message:
    """The message of one setpoint.

    thrust: share of full thrust, 0 to 1. target: the vehicle's system and component id.

    Raises:
        ValueError: thrust or quaternion are not finite, out of range or not a rotation.
    """
    if not 0.0 <= thrust <= 1.0:  # NaN is not either
        raise ValueError(f"thrust {thrust} is not between 0 and 1")
    x, y, z, w = q_WB
    length_2 = x * x + y * y + z * z + w * w
    if not abs(length_2 - 1.0) <= UNIT_TOLERANCE:
        raise ValueError(f"not a unit quaternion: {q_WB}")
    scale = 1.0 / math.sqrt(length_2)
    q = frames_wire.attitude((x * scale, y * scale, z * scale, w * scale), frame)
    return mavlink.MAVLink_set_attitude_target_message(
        time_boot_ms(now_ns), target[0], target[1], IGNORE_RATES, q, 0.0, 0.0, 0.0, thrust
    )
