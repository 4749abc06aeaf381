"""Random and mutated packets into the simulated Crazyflie: no exception, no growth of memory, answers that are packets.

`make campaign` sends a million; a test sends a few thousand. Packets are noise, noise behind a sensible header, and
sensible packets with bytes changed, cut off or added; time passes between them, so that it also flies, crashes, locks
and reboots.
"""

from __future__ import annotations

import math
import random
import resource
import struct
import time
from pathlib import Path
from typing import Any

from lcd_flight.worlds import load_vehicle
from sim_bridge.crazyflie.crtp import MAX_PAYLOAD, decode
from sim_bridge.crazyflie.variants import FIRMWARES, PLATFORMS, variant
from sim_bridge.crazyflie.vehicle import SimulatedCrazyflie

COUNT = 1_000_000
EACH = 50_000
"""Packets to one vehicle; then comes the next, of another kind."""
MOST_ANSWERS = 200
"""To one packet and the time after it: a log block of each number every period, and text."""
_SENSIBLE = [
    bytes.fromhex(packet)
    for line in (
        "FF  FD00  FC0001  FFFEF001  FFFE02  FFFE03  DD00  DD01  DD02  DC0101  DC02  4C01  4D000000000010",
        "2C03  2C020300  2D0500  2E070001  2E0D00CDCCCC3D  2E0E0001  2E120002  2F00706D006C6F7756006600  2F01",
        "2F030300  2F040300  2F050300  2F060300  2F070300  2F080300",
        "5C03  5C020100  5D05  5D0601070000020100  5D030101  5D08010200  5D0701070500  5D0401  5D0201",
        "9C0C  9C01  9D0101  9D0100  9D02  9D03  9D04  6D03  6D04",
        "3C0000000000000000000000000000  7C00  7C0B000000000000000000000000409C00  7D0000000000",
        "6C0000803F0000803F0000803F  6D09E7E80330F8F401000000C0  6EE7E80330F8F401",
    )
    for packet in line.split()
]


def crazyflie_fuzz(count: int = COUNT, seed: int = 2026) -> dict[str, Any]:
    """Send `count` packets; says how fast, and the memory of the process after each vehicle."""
    draws = random.Random(seed)  # noqa: S311 - not a secret
    began_s, memory_kB = time.perf_counter(), []
    kinds = [(platform, firmware) for platform in PLATFORMS for firmware in FIRMWARES]
    for first in range(0, count, EACH):
        platform, firmware = kinds[first // EACH % len(kinds)]
        vehicle = SimulatedCrazyflie(load_vehicle("crazyflie-2.1"), variant(platform, firmware), seed=first)
        _fuzz_one(vehicle, min(EACH, count - first), draws)
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


def _fuzz_one(vehicle: SimulatedCrazyflie, count: int, draws: random.Random) -> None:
    """An exception comes out; a wrong answer or a state that is not finite is one."""
    now_ns = 0
    for _ in range(count):
        now_ns += draws.choice((0, 0, 2_000_000, 10_000_000))
        packet = any_packet(draws)
        vehicle.receive(packet, now_ns)
        answers = vehicle.outgoing()
        if len(answers) > MOST_ANSWERS or any(decode(answer) is None for answer in answers):
            raise AssertionError(f"{packet.hex()} was answered by {answers}")
        if not all(map(math.isfinite, (*vehicle.body.state.p_WB, *vehicle.body.state.q_WB))):
            raise AssertionError(f"{packet.hex()} led to {vehicle.body.state}")
        if vehicle.body.broken and draws.random() < 0.01:
            vehicle.body.put_upright()


def any_packet(draws: random.Random) -> bytes:
    """One datagram."""
    kind = draws.randrange(5)
    if kind == 0:
        return draws.randbytes(draws.choice((0, 1, 2, 5, 31, 32, 1500)))
    if kind == 1:
        return bytes((draws.choice((0x2, 0x3, 0x4, 0x5, 0x6, 0x7, 0x8, 0x9, 0xD, 0xF)) << 4 | draws.randrange(16),)) + (
            draws.randbytes(draws.randrange(MAX_PAYLOAD + 1))
        )
    if kind == 2:
        thrust = draws.choice((0, 0, 999, 20_000, 40_000, 60_000, 65_535))
        angles = [draws.choice((0.0, 5.0, -90.0, 1e30, math.nan, math.inf)) * draws.random() for _ in range(3)]
        return b"\x3c" + struct.pack("<fffH", *angles, thrust)
    if kind == 3:
        pose = [draws.choice((0.0, 1.0, -1e30, math.nan)) * draws.random() for _ in range(7)]
        return b"\x6d\x08" + struct.pack("<7f", *pose)
    return _mutated(bytearray(draws.choice(_SENSIBLE)), draws)


def _mutated(packet: bytearray, draws: random.Random) -> bytes:
    """As it is, or with a byte changed, bytes added, or its end cut off."""
    change = draws.randrange(4)
    if change == 1:
        packet[draws.randrange(len(packet))] = draws.randrange(256)
    elif change == 2:
        packet += draws.randbytes(draws.randrange(1, 8))
    elif change == 3:
        del packet[draws.randrange(len(packet)) :]
    return bytes(packet)


def _memory_kB() -> int:
    """Resident size of this process (Linux)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() // 1024
