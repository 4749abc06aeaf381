"""The small services: link echo and source, platform and versions, memories, supervisor. Pure: packets to packets.

Source: crazyflie-firmware 2026.08, src/modules/src/crtpservice.c, platformservice.c, mem.c and crtp_supervisor.c.
"""

from __future__ import annotations

import errno
import struct

from sim_bridge.crazyflie.crtp import MAX_PAYLOAD, Packet
from sim_bridge.crazyflie.supervisor import Supervisor
from sim_bridge.crazyflie.variants import Variant

_ECHO, _SOURCE, _NULL = 0, 1, 3
_SOURCE_TEXT = b"Bitcraze Crazyflie"
_PLATFORM_COMMAND, _VERSION = 0, 1
_ARM, _RECOVER = 1, 2
_PROTOCOL, _FIRMWARE, _DEVICE = 0, 1, 2
_INFO, _COMMAND = 0, 1
_INFO_BITS, _INFO_FIELD = 11, 0x0C
SUPERVISOR_ARM, SUPERVISOR_RECOVER, SUPERVISOR_STOP, SUPERVISOR_WATCHDOG = 1, 2, 3, 4
_ANSWER = 0x80
FIRST_PROTOCOL_WITH_SUPERVISOR = 12


def link(packet: Packet) -> list[Packet]:
    """Echo, a known text, or, to a null packet, the sign of life that a scan waits for."""
    if packet.channel in (_ECHO, _NULL):
        return [packet]
    if packet.channel == _SOURCE:
        return [packet.answer(_SOURCE_TEXT.ljust(MAX_PAYLOAD, b"\0"))]
    return []


def platform(packet: Packet, variant: Variant, supervisor: Supervisor) -> list[Packet]:
    """Versions; and arming and recovery as firmware had them before the supervisor's own port."""
    if not packet.payload:
        return []
    command = packet.payload[0]
    if packet.channel == _PLATFORM_COMMAND:
        if command == _ARM and len(packet.payload) > 1:
            supervisor.request_arming(bool(packet.payload[1]))
        elif command == _RECOVER:
            supervisor.request_recovery()
        return [packet]
    if packet.channel == _VERSION:
        said = {
            _PROTOCOL: struct.pack("<I", variant.protocol),
            _FIRMWARE: variant.firmware.encode(),
            _DEVICE: variant.device.encode(),
        }.get(command)
        return [] if said is None else [packet.answer(packet.payload[:1] + said)]
    return []


def memory(packet: Packet) -> list[Packet]:
    """There are no memories."""
    if packet.channel == 0 and packet.payload[:1] == b"\1":
        return [packet.answer(b"\1\0")]
    if packet.channel in (1, 2) and len(packet.payload) >= 5:
        return [packet.answer(packet.payload[:5] + bytes((errno.ENOENT,)))]
    return []


def supervision(packet: Packet, variant: Variant, supervisor: Supervisor, now_ms: int) -> list[Packet]:
    """State and commands on the supervisor's port; older firmware does not know it and is silent."""
    if variant.protocol < FIRST_PROTOCOL_WITH_SUPERVISOR or not packet.payload:
        return []
    command = packet.payload[0]
    if packet.channel == _INFO:
        return _information(packet, command, supervisor.info)
    if packet.channel != _COMMAND:
        return []
    if command == SUPERVISOR_STOP:
        supervisor.stop_emergency()
    elif command == SUPERVISOR_WATCHDOG:
        supervisor.feed_watchdog(now_ms)
    elif command == SUPERVISOR_RECOVER:
        done = supervisor.request_recovery()
        return [packet.answer(bytes((_ANSWER | command, done, not supervisor.crashed)))]
    elif command == SUPERVISOR_ARM and len(packet.payload) > 1:
        done = supervisor.request_arming(bool(packet.payload[1]))
        return [packet.answer(bytes((_ANSWER | command, done, supervisor.armed)))]
    return []


def _information(packet: Packet, command: int, info: int) -> list[Packet]:
    if command == _INFO_FIELD:
        return [packet.answer(bytes((_ANSWER | command,)) + struct.pack("<H", info))]
    if 1 <= command <= _INFO_BITS:
        return [packet.answer(bytes((_ANSWER | command, info >> (command - 1) & 1)))]
    return []
