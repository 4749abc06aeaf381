"""Random and mutated packets into the simulated MAVLink vehicle: no exception, no growth of memory, sound answers.

`make campaign` sends a million; a test sends a few thousand. Packets are noise, sensible packets with bytes changed,
cut off or added, and packets of every message of the dialect with a valid checksum around a random payload; some are
signed. Time passes between them, so that the vehicle also arms, flies, crashes and reboots.
"""

from __future__ import annotations

import math
import random
import re
import resource
import struct
import time
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import common

from lcd_flight.worlds import load_vehicle
from sim_bridge.mavlink.framing import split
from sim_bridge.mavlink.options import MavlinkOptions
from sim_bridge.mavlink.signing import signed
from sim_bridge.mavlink.vehicle import SimulatedMavlink

COUNT = 1_000_000
EACH = 50_000
"""Packets to one vehicle; then comes the next, of another kind."""
MOST_ANSWERS = 100
"""To one datagram and the time after it."""
KEY = b"k" * 32
_MESSAGES = tuple(common.mavlink_map)
_LIKELY = (75, 76, 11, 20, 21, 23, 82, 111, 102, 331, 48, 256)
"""What the vehicle does something about."""
_NUMBERS = (0.0, 0.0, 1.0, 1.0, 1.0, -1.0, 0.5, 0.7, 4.0, 6.0, 20.0, 1e30, -1e30, math.nan, math.inf, 21196.0, 193.0)
_COMMANDS = (400, 400, 400, 176, 176, 511, 512, 510, 246, 21, 22, 20, 185, 520)
_LIKELY_BY_CODE = {
    "f": tuple(struct.pack("<f", number) for number in _NUMBERS),
    "H": tuple(struct.pack("<H", number) for number in _COMMANDS),
    "B": tuple(bytes((number,)) for number in (1, 1, 1, 1, 0, 7, 7, 12, 20, 2, 128)),
    "I": tuple(struct.pack("<I", number) for number in (0, 4, 9, 20, 6 << 16, 4 << 16 | 6 << 24)),
}
_NAMES = (b"GUID_OPTIONS", b"COM_OF_LOSS_T", b"EKF2_EV_CTRL", b"", b"\xff" * 16, b"NO_SUCH")
_NO_COVARIANCE = [0.0] * 21
_FLYING = (
    *[common.MAVLink_set_attitude_target_message(0, 1, 1, 7, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0, 0.55)] * 6,
    common.MAVLink_set_attitude_target_message(0, 1, 1, 7, [0.96, 0.28, 0.0, 0.0], 0.0, 0.0, 0.0, 0.9),
    common.MAVLink_command_long_message(1, 1, 400, 0, 1.0, 21196.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    common.MAVLink_command_long_message(1, 1, 176, 0, 1.0, 6.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    common.MAVLink_set_mode_message(1, 1, 20),
    common.MAVLink_set_gps_global_origin_message(1, 473977420, 85455940, 488000),
    common.MAVLink_odometry_message(
        0, 20, 12, 0.1, 0.0, -0.5, [1.0, 0.0, 0.0, 0.0], *(0.0,) * 6, _NO_COVARIANCE, _NO_COVARIANCE, 0, 2, 100
    ),
)
"""What gets it into the air, so that it is fuzzed there too."""


def mavlink_fuzz(count: int = COUNT, seed: int = 2026) -> dict[str, Any]:
    """Send `count` packets; says how fast, and the memory of the process after each vehicle."""
    draws = random.Random(seed)  # noqa: S311 - not a secret
    began_s, memory_kB = time.perf_counter(), []
    for number, first in enumerate(range(0, count, EACH)):
        vehicle = fuzzed_vehicle(number)
        fuzz_one(vehicle, min(EACH, count - first), draws)
        memory_kB.append(_memory_kB())
        if count > EACH:
            print(f"{min(first + EACH, count):,}/{count:,} packets")  # noqa: T201
    return {
        "packets": count,
        "seed": seed,
        "exceptions": 0,
        "memory_kB": memory_kB,
        "packets_per_s": round(count / (time.perf_counter() - began_s)),
    }


def fuzzed_vehicle(number: int) -> SimulatedMavlink:
    """Both flavours by turns; every third has a key, of which half believe unsigned packets too."""
    options = MavlinkOptions(
        flavour=("px4", "ardupilot")[number % 2],  # type: ignore[arg-type]
        boot_s=0.0,
        own_mocap=number % 4 < 2,
        unsigned=number % 6 < 3,
    )
    key = KEY if number % 3 == 0 else None
    return SimulatedMavlink(load_vehicle("hummingbird"), options, seed=number, key=key)


def fuzz_one(vehicle: SimulatedMavlink, count: int, draws: random.Random) -> None:
    """An exception comes out; a wrong answer or a state that is not finite is one."""
    now_ns = 0
    for _ in range(count):
        now_ns += draws.choice((0, 0, 4_000_000, 12_000_000))
        packet = any_packet(draws, vehicle.ticks)
        vehicle.receive(packet, now_ns)
        answers = vehicle.outgoing()
        if len(answers) > MOST_ANSWERS or any(split(answer) != ([answer], b"") for answer in answers):
            raise AssertionError(f"{packet.hex()} was answered by {answers}")
        estimate, state = vehicle.firmware.pilot.estimator, vehicle.body.state
        numbers = (*state.p_WB, *state.q_WB, *estimate.position, *estimate.velocity, *estimate.attitude)
        if not all(map(math.isfinite, numbers)):
            raise AssertionError(f"{packet.hex()} led to {numbers}")
        if vehicle.body.broken and draws.random() < 0.01:
            vehicle.body.put_upright()


def any_packet(draws: random.Random, ticks: int) -> bytes:
    """One datagram."""
    kind = draws.randrange(7)
    if kind == 0:
        return draws.randbytes(draws.choice((0, 1, 2, 3, 12, 280, 1500)))
    if kind == 1:
        return bytes((draws.choice((0xFD, 0xFE)),)) + draws.randbytes(draws.randrange(300))
    if kind == 2:
        return _mutated(bytearray(_sensible(draws, ticks)), draws)
    if kind == 3:
        return _finished(draws.choice(_FLYING), draws, ticks)
    if kind == 4:
        message = common.mavlink_map[draws.choice(_MESSAGES)]
        return packed(message, draws.randbytes(draws.randrange(1, 256)), draws, ticks)
    return _sensible(draws, ticks)


def _sensible(draws: random.Random, ticks: int) -> bytes:
    """A message that the vehicle does something about, with likely numbers."""
    message = common.mavlink_map[draws.choice(_LIKELY)]
    return packed(message, _payload(message.unpacker.format, draws), draws, ticks)


def _payload(layout: str, draws: random.Random) -> bytes:
    """Likely numbers for a `struct` layout; its last bytes hold the target ids or a name in most messages."""
    parts = []
    for count, code in re.findall(r"(\d*)([a-zA-Z])", layout):
        if code == "s":
            parts.append(struct.pack(f"{count}s", draws.choice(_NAMES)))
            continue
        size = struct.calcsize(f"<{code}")
        for _ in range(int(count or 1)):
            likely = _LIKELY_BY_CODE.get(code, ())
            parts.append(draws.choice(likely) if likely and draws.random() < 0.9 else draws.randbytes(size))
    return b"".join(parts)


def _finished(message: Any, draws: random.Random, ticks: int) -> bytes:
    """A whole message from a client; its numbers are right."""
    message.pack(common.MAVLink(None))
    return packed(message, message.get_payload(), draws, ticks)


def packed(message: Any, payload: bytes, draws: random.Random, ticks: int) -> bytes:
    """A MAVLink 1 or 2 packet with a valid checksum; some are signed, rightly or not."""
    number, system = message.id, draws.choice((255, 255, draws.randrange(256)))
    if draws.random() < 0.1 and number < 256:
        head = bytes((0xFE, len(payload), draws.randrange(256), system, 190, number))
        return head + payload + _checksum(head[1:] + payload, message.crc_extra)
    flags = draws.choice((0, 0, 0, 1))
    head = bytes((0xFD, len(payload), flags, 0, draws.randrange(256), system, 190)) + number.to_bytes(3, "little")
    packet = head + payload + _checksum(head[1:] + payload, message.crc_extra)
    if not flags:
        return packet
    return signed(
        packet, draws.choice((KEY, KEY, draws.randbytes(32))), draws.randrange(256), ticks + draws.randrange(9)
    )


def _checksum(data: bytes, extra: int) -> bytes:
    crc = common.x25crc(data)
    crc.accumulate(bytes((extra,)))
    told: int = crc.crc
    return told.to_bytes(2, "little")


def _mutated(packet: bytearray, draws: random.Random) -> bytes:
    """With a byte changed, bytes added, or its end cut off; or twice."""
    change = draws.randrange(4)
    if change == 0:
        packet *= 2
    elif change == 1:
        packet[draws.randrange(len(packet))] = draws.randrange(256)
    elif change == 2:
        packet += draws.randbytes(draws.randrange(1, 8))
    else:
        del packet[draws.randrange(len(packet)) :]
    return bytes(packet)


def _memory_kB() -> int:
    """Resident size of this process (Linux)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() // 1024
