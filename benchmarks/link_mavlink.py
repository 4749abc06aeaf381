"""What the MAVLink link costs a tick, against pymavlink's mavutil and MAVSDK in the same run; how even its stream is.

All sides send to one UDP socket, and what arrives is counted: a call that sends nothing is no peer. A setpoint of ours
is validated, mapped to frame and thrust, encoded, sent and noted for the log; mavutil's and MAVSDK's are encoded and
sent. Attitudes come in bursts of datagrams and are timed from the first one sent until the last is taken in: ours by
the event loop, the session and the picture of the vehicle, mavutil's by `recv_match`, MAVSDK's by a subscription.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import time
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

from benchmarks.mavlink_sides import BURST, CLOCK, HERE, Mavsdk, Mavutil, Ours, Side, Sky, free_port
from benchmarks.timing import SHARES, as_in_flight, paced, row
from drivers.mavlink.transport import Udp
from lcd_flight.flight.rate import RateKeeper
from lcd_flight.flight.realtime import prioritised

ROUNDS = 5
SENDS = 200
"""Of each side in each round."""
BURSTS = 20
"""Likewise."""
STREAM = 300
"""Setpoints at 100 Hz."""
PERIOD_US = 10_000.0
SO_TIMESTAMPNS = 35
"""Linux; Python's socket module does not name it."""
WHATS = {
    "setpoint": "cost of a MAVLink setpoint in the loop",
    "attitude": f"MAVLink attitude, sent and parsed, {BURST} at once",
}


def rows(report: Callable[[str], None]) -> list[dict[str, Any]]:
    """Costs in microseconds."""
    with as_in_flight():
        return asyncio.run(_measured(report))


async def _measured(report: Callable[[str], None]) -> list[dict[str, Any]]:
    sky = Sky()
    with contextlib.closing(sky.socket), contextlib.closing(Ours(Udp(HERE, free_port(), call=False))) as ours:
        await ours.open(sky)
        with contextlib.closing(Mavutil(sky)) as mavutil, contextlib.closing(Mavsdk(sky)) as mavsdk:
            peers: tuple[Side, ...] = (mavutil, mavsdk)
            costs = await _costs(report, sky, (ours, *peers))
        report(f"{STREAM} setpoints at 100 Hz")
        with prioritised():
            off_us = await _stream(ours, sky)
    what = "MAVLink setpoints at 100 Hz, off their 10 ms on arrival"
    table = [
        row(f"{what_of}, {name}", costs[kind]["ours"], costs[kind][peer.name], share, peer.name)
        for kind, what_of in WHATS.items()
        for peer in peers
        for name, share in SHARES
    ]
    return table + [row(f"{what}, {name}", off_us, None, share, None) for name, share in SHARES]


async def _costs(report: Callable[[str], None], sky: Sky, sides: Sequence[Side]) -> dict[str, dict[str, list[float]]]:
    """us, by what and whose; the sides take turns."""
    costs: dict[str, dict[str, list[float]]] = {kind: {side.name: [] for side in sides} for kind in WHATS}
    sky.setpoints()
    for number in range(ROUNDS):
        report(f"MAVLink round {number + 1} of {ROUNDS}, {len(sides) * (SENDS + BURSTS * BURST)} packets")
        turn = number % len(sides)
        in_turn = (*sides[turn:], *sides[:turn])
        for side in in_turn:
            costs["setpoint"][side.name] += _sent(side, sky)
        for side in in_turn * BURSTS:
            costs["attitude"][side.name].append(await _burst(side, sky))
    return costs


def _sent(side: Side, sky: Sky) -> list[float]:
    """us for each setpoint, all of which have arrived."""
    taken_us = paced(side.send, SENDS)
    time.sleep(0.05)
    if sky.setpoints() < SENDS:
        raise RuntimeError(f"{side.name} did not send all its setpoints")
    return taken_us


async def _burst(side: Side, sky: Sky) -> float:
    """us for each of its attitudes."""
    packets = sky.burst(side.port)
    began_ns = time.perf_counter_ns()
    sky.send(packets, side.port)
    taken = await side.taken_in(len(packets))
    taken_us = (time.perf_counter_ns() - began_ns) * 1e-3
    if taken != len(packets):
        raise RuntimeError(f"{side.name} took in {taken} of {len(packets)} attitudes")
    return taken_us / len(packets)


async def _stream(ours: Ours, sky: Sky) -> list[float]:
    """us that the time between two setpoints is off, by the kernel's stamps of their arrival."""
    sky.setpoints()
    sky.socket.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
    keeper = RateKeeper(CLOCK)
    arrivals_us = []
    for _ in range(STREAM):
        await keeper.next()
        ours.send()
        arrivals_us.append(_arrival_us(sky.socket))
    return [abs(after - before - PERIOD_US) for before, after in pairwise(arrivals_us)]


def _arrival_us(one: socket.socket) -> float:
    """When the next datagram arrived, by the kernel."""
    _, extra, _, _ = one.recvmsg(2048, 64)
    stamp = extra[0][2]
    seconds, nanoseconds = (int.from_bytes(stamp[at : at + 8], "little") for at in (0, 8))
    return seconds * 1e6 + nanoseconds * 1e-3
