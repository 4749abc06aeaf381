"""The packets that this link sends, byte for byte: degrees, u16 thrust, float32, the firmware's signs.

A packet is its header (port << 4 | 0x0C | channel) and its payload, at most 30 bytes. Source: crazyflie-firmware
2026.08, src/modules/src/crtp_commander_rpyt.c, crtp_commander_generic.c, crtp_localization_service.c; cflib 0.1.34.
"""

from __future__ import annotations

import math
import struct

from lcd_flight.model import AttitudeThrust, Quaternion, Vector3
from lcd_flight.model.frames import body_z_axis, seen_from_heading, yaw_of

SUPERVISOR_PROTOCOL = 12
"""From this CRTP protocol on, arming and the emergency stop have a port of their own."""

STOP = bytes([0x7C, 0x00])
"""Generic setpoint `stop`: motors off. Silence after it locks the vehicle; `NOTIFY_STOP` after it does not."""
NOTIFY_STOP = bytes([0x7D, 0x00]) + struct.pack("<I", 0)
"""No more setpoints will come; in the air this cuts the motors within 0.1 s."""

_RPYT = struct.Struct("<BfffH")
_RPYT_HEADER = 0x3C
_EXTPOSE = struct.Struct("<BB7f")
_EXTPOSE_HEAD = (0x6D, 0x08)


def rpyt(roll_deg: float, pitch_deg: float, yaw_deg: float, thrust: int) -> bytes:
    """The legacy setpoint, with absolute yaw (`flightmode.stabModeYaw` 1).

    roll_deg: right side down. pitch_deg: nose down; the firmware's pitch is nose up. yaw_deg: counter-clockwise.
    thrust: u16. The first one with thrust 0 unlocks; before it thrust is ignored.
    """
    return _RPYT.pack(_RPYT_HEADER, roll_deg, -pitch_deg, yaw_deg, thrust)


UNLOCK = rpyt(0.0, 0.0, 0.0, 0)


def roll_pitch_yaw_deg(q_WD: Quaternion, nose_W: Vector3) -> tuple[float, float, float]:
    """Roll (right side down), pitch (nose down) and absolute yaw in deg for the attitude q_WD.

    nose_W: where the vehicle's nose points now. The firmware corrects the three angles apart, so that roll and pitch
    are those of the thrust axis as seen from the heading that the vehicle has (`seen_from_heading`).
    """
    axis_W = body_z_axis(q_WD)
    forward, left = seen_from_heading(axis_W, nose_W)
    roll = math.atan2(-left, math.hypot(forward, axis_W[2]))
    return math.degrees(roll), math.degrees(math.atan2(forward, axis_W[2])), math.degrees(yaw_of(q_WD))


def setpoint(wanted: AttitudeThrust, nose_W: Vector3, thrust: int) -> bytes:
    """The packet of one setpoint; `thrust` is its thrust in counts."""
    return rpyt(*roll_pitch_yaw_deg(wanted.q_WB, nose_W), thrust)


def extpose(p_WB: Vector3, q_WB: Quaternion) -> bytes:
    """A pose from motion capture, for the onboard estimator: m, xyzw."""
    return _EXTPOSE.pack(*_EXTPOSE_HEAD, *p_WB, *q_WB)


def arming(arm: bool, protocol: int) -> bytes:
    """The request to arm or disarm."""
    return bytes([0x9D if protocol >= SUPERVISOR_PROTOCOL else 0xDC, 0x01, arm])


def emergency_watchdog(protocol: int) -> bytes:
    """Feeds the emergency stop's watchdog: off until the first one, then wanted every second."""
    return bytes([0x9D if protocol >= SUPERVISOR_PROTOCOL else 0x6D, 0x04])
