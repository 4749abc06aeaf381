"""MAVLink 2 from its specification, without pymavlink: packets by hand, for golden bytes.

Sources: mavlink.io, "Packet Serialization" and "Message Signing"; the message definitions of common.xml. A header of
ten bytes, fields by size of their type, extensions last, zeros at the end left out, CRC-16/MCRF4XX with CRC_EXTRA,
which is a checksum of the definition itself.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Mapping
from dataclasses import dataclass

DEFINITIONS = {
    "HEARTBEAT": "u8 type, u8 autopilot, u8 base_mode, u32 custom_mode, u8 system_status, u8 mavlink_version",
    "PARAM_VALUE": "char[16] param_id, float param_value, u8 param_type, u16 param_count, u16 param_index",
    "ATTITUDE_QUATERNION": "u32 time_boot_ms, float q1, float q2, float q3, float q4, float rollspeed, "
    "float pitchspeed, float yawspeed; float[4] repr_offset_q",
    "LOCAL_POSITION_NED": "u32 time_boot_ms, float x, float y, float z, float vx, float vy, float vz",
    "COMMAND_LONG": "u8 target_system, u8 target_component, u16 command, u8 confirmation, float param1, float param2, "
    "float param3, float param4, float param5, float param6, float param7",
    "COMMAND_ACK": "u16 command, u8 result; u8 progress, i32 result_param2, u8 target_system, u8 target_component",
    "SET_ATTITUDE_TARGET": "u32 time_boot_ms, u8 target_system, u8 target_component, u8 type_mask, float[4] q, "
    "float body_roll_rate, float body_pitch_rate, float body_yaw_rate, float thrust; float[3] thrust_body",
    "TIMESYNC": "i64 tc1, i64 ts1; u8 target_system, u8 target_component",
    "ODOMETRY": "u64 time_usec, u8 frame_id, u8 child_frame_id, float x, float y, float z, float[4] q, float vx, "
    "float vy, float vz, float rollspeed, float pitchspeed, float yawspeed, float[21] pose_covariance, "
    "float[21] velocity_covariance; u8 reset_counter, u8 estimator_type, i8 quality",
}
"""In the order of common.xml; after the semicolon, extensions."""
NUMBERS_AND_EXTRAS = {
    "HEARTBEAT": (0, 50),
    "PARAM_VALUE": (22, 220),
    "ATTITUDE_QUATERNION": (31, 246),
    "LOCAL_POSITION_NED": (32, 185),
    "COMMAND_LONG": (76, 152),
    "COMMAND_ACK": (77, 143),
    "SET_ATTITUDE_TARGET": (82, 49),
    "TIMESYNC": (111, 34),
    "ODOMETRY": (331, 91),
}
"""As the generated C headers publish them."""
TYPES = {
    "u8": ("uint8_t", "B"),
    "i8": ("int8_t", "b"),
    "char": ("char", "s"),
    "u16": ("uint16_t", "H"),
    "u32": ("uint32_t", "I"),
    "i32": ("int32_t", "i"),
    "i64": ("int64_t", "q"),
    "u64": ("uint64_t", "Q"),
    "float": ("float", "f"),
}


@dataclass(frozen=True)
class Field:
    name: str
    kind: str
    number: int
    """Of elements; 0: not an array."""

    @property
    def layout(self) -> str:
        return f"{self.number or ''}{TYPES[self.kind][1]}"

    @property
    def size(self) -> int:
        return struct.calcsize(f"<{TYPES[self.kind][1]}")


def parsed(text: str) -> list[Field]:
    words = [pair.split() for pair in text.split(",") if pair.strip()]
    return [Field(name, kind.partition("[")[0], int(kind.partition("[")[2].rstrip("]") or 0)) for kind, name in words]


def fields_of(name: str) -> tuple[list[Field], list[Field]]:
    """In the order of the wire: the largest type first, otherwise as defined; and the extensions, as defined."""
    own, _, extensions = DEFINITIONS[name].partition(";")
    return sorted(parsed(own), key=lambda one: -one.size), parsed(extensions)


def crc(data: bytes) -> int:
    """CRC-16/MCRF4XX: polynomial 0x1021 reflected, begun with all ones, bit by bit."""
    register = 0xFFFF
    for byte in data:
        register ^= byte
        for _ in range(8):
            register = register >> 1 ^ (0x8408 if register & 1 else 0)
    return register


def crc_extra(name: str) -> int:
    """The definition's checksum: name and, in the order of the wire, types, names and array lengths."""
    told = f"{name} ".encode()
    for one in fields_of(name)[0]:
        told += f"{TYPES[one.kind][0]} {one.name} ".encode() + (bytes((one.number,)) if one.number else b"")
    whole = crc(told)
    return whole & 0xFF ^ whole >> 8


def packet(name: str, values: Mapping[str, object], seq: int, source: tuple[int, int], flags: int = 0) -> bytes:
    """One unsigned MAVLink 2 packet; what has no value is 0."""
    own, extensions = fields_of(name)
    payload = b""
    for one in (*own, *extensions):
        value = values.get(one.name, (0,) * max(one.number, 1))
        payload += struct.pack(f"<{one.layout}", *(value if isinstance(value, tuple) else (value,)))
    payload = payload.rstrip(b"\0") or b"\0"
    number, _ = NUMBERS_AND_EXTRAS[name]
    head = struct.pack("<BBBBBBB", 0xFD, len(payload), flags, 0, seq, *source) + number.to_bytes(3, "little")
    told = head + payload
    return told + crc(told[1:] + bytes((crc_extra(name),))).to_bytes(2, "little")


def signed(data: bytes, key: bytes, link_id: int, stamp: int) -> bytes:
    """With the first six bytes of sha256 over the key and everything before them."""
    told = data + bytes((link_id,)) + stamp.to_bytes(6, "little")
    return told + hashlib.sha256(key + told).digest()[:6]
