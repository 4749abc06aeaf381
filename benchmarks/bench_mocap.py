"""Motion capture: cost of a frame, and how long it takes from another process into the flight's event loop.

Latency is one-way over TCP on the loopback interface at 100 Hz, measured with the one monotonic clock of this machine.
Ours is the pose source of the flight; the peer is the asyncio socket of pyzmq, received and decoded the same way. Both
run in turns of a second within the same minute, so that a busy machine disturbs both alike.
"""

from __future__ import annotations

import asyncio
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import zmq
import zmq.asyncio

from lcd_flight.flight.clock import RealClock
from lcd_flight.model import PoseOptions
from lcd_flight.wire.mocap_frame import MocapFrame, decode, encode, topic
from mocap.ingest import Ingestor
from mocap.pose_filter import FilterState, PoseFilter
from mocap.zmq_source import ZmqSource

Row = dict[str, Any]
TURNS = 5
TURN_S = 1.0
BODY = "bench"

_PUBLISHER = """
import sys, time
from lcd_flight.wire.mocap_frame import MocapFrame, encode
from mocap.zmq_publisher import open_publisher
publish = open_publisher("tcp://127.0.0.1:0")
print(publish.endpoint, flush=True)
n = 0
due = time.monotonic()
while True:
    now = time.monotonic_ns()
    publish(encode(MocapFrame(body="bench", sequence=n, frame_number=n, source_time_ns=now, send_time_ns=now,
        clock_id="host", position=(0.0, 0.0, 1.0 + 1e-6 * n), quaternion=(0.0, 0.0, 0.0, 1.0))))
    n += 1
    due += 0.01
    time.sleep(max(0.0, due - time.monotonic()))
"""


def rows(report: Callable[[str], None]) -> list[Row]:
    """All rows; `report` is told what is being measured."""
    report("mocap: cost of a frame")
    found = _costs()
    report(f"mocap: latency over TCP, {2 * TURNS} turns of {TURN_S:g} s")
    ours, peer = _latencies_us()
    for name, pick in (("median", statistics.median), ("p99", _p99)):
        found.append(_row(f"one-way latency over tcp, {name}", "us", pick(ours), pick(peer), "zmq.asyncio"))
    return found


def _costs() -> list[Row]:
    frame = _frame(0, 0)
    data, text = encode(frame), json.dumps(_as_json(frame))
    return [
        _row(
            "encode a frame",
            "us",
            _time_us(lambda: encode(frame)),
            _time_us(lambda: json.dumps(_as_json(frame))),
            "json",
        ),
        _row("decode a frame", "us", _time_us(lambda: decode(data)), _time_us(lambda: json.loads(text)), "json"),
        _row("filter a frame (gate, Kalman, report)", "us", _filter_us(with_twist=False), None, None),
        _row("filter a frame with the source's twist", "us", _filter_us(with_twist=True), None, None),
    ]


def _filter_us(*, with_twist: bool, count: int = 3000) -> float:
    """Cost of one step and one report."""
    pose_filter = PoseFilter(PoseOptions())
    frames = [_frame(n, 10_000_000 * n, with_twist=with_twist) for n in range(count)]

    def fly() -> None:
        state = FilterState()
        for frame in frames:
            state = pose_filter.step(state, frame, frame.source_time_ns)
            pose_filter.report(state, frame.source_time_ns + 3_000_000)

    return _time_us(fly, count=1) / count


def _latencies_us() -> tuple[list[float], list[float]]:
    """Latencies of ours and of the peer, in turns, from one publisher in a process of its own."""
    publisher = subprocess.Popen([sys.executable, "-c", _PUBLISHER], stdout=subprocess.PIPE, text=True)
    try:
        assert publisher.stdout is not None
        endpoint = publisher.stdout.readline().strip()
        ours: list[float] = []
        peer: list[float] = []
        for _ in range(TURNS):
            ours += asyncio.run(_our_turn(endpoint))
            peer += asyncio.run(_peer_turn(endpoint))
        return ours, peer
    finally:
        publisher.kill()
        publisher.wait()


class _Stopwatch(Ingestor):
    """Notes when each frame has been taken in, beside taking it in."""

    def __init__(self) -> None:
        super().__init__(BODY, RealClock(), PoseOptions())
        self.latencies_us: list[float] = []

    def receive(self, data: bytes) -> None:
        now_ns = time.monotonic_ns()
        super().receive(data)
        self.latencies_us.append((now_ns - decode(data).send_time_ns) * 1e-3)


async def _our_turn(endpoint: str) -> list[float]:
    stopwatch = _Stopwatch()
    async with ZmqSource(endpoint, stopwatch):
        await asyncio.sleep(TURN_S)
    return stopwatch.latencies_us


async def _peer_turn(endpoint: str) -> list[float]:
    found: list[float] = []
    context = zmq.asyncio.Context()
    socket = context.socket(zmq.SUB)
    socket.setsockopt(zmq.SUBSCRIBE, topic(BODY))
    socket.connect(endpoint)

    async def receive() -> None:
        while True:
            data = await socket.recv()
            now_ns = time.monotonic_ns()
            found.append((now_ns - decode(data).send_time_ns) * 1e-3)

    task = asyncio.create_task(receive())
    await asyncio.sleep(TURN_S)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    context.destroy(linger=0)
    return found


def _frame(n: int, stamp_ns: int, *, with_twist: bool = False) -> MocapFrame:
    return MocapFrame(
        body=BODY,
        sequence=n,
        frame_number=n,
        source_time_ns=stamp_ns,
        send_time_ns=stamp_ns,
        clock_id="host",
        position=(0.001 * n, 0.0, 1.0),
        quaternion=(0.0, 0.0, 0.0, 1.0),
        velocity=(0.1, 0.0, 0.0) if with_twist else None,
        body_rates=(0.0, 0.0, 0.0) if with_twist else None,
    )


def _as_json(frame: MocapFrame) -> dict[str, Any]:
    return {name: getattr(frame, name) for name in MocapFrame.__struct_fields__}


def _time_us(call: Callable[[], object], count: int = 20_000, repeats: int = 5) -> float:
    """Processor time, best mean of a few repeats: what the call costs when nothing disturbs it."""
    best = float("inf")
    for _ in range(repeats):
        began = time.process_time()
        for _ in range(count):
            call()
        best = min(best, time.process_time() - began)
    return best / count * 1e6


def _p99(values: list[float]) -> float:
    return sorted(values)[int(0.99 * len(values))]


def _row(what: str, unit: str, ours: float, peer: float | None, peer_name: str | None) -> Row:
    """A row of the table; ratio above 1: ours is better."""
    ratio = None if peer is None else peer / ours
    return {"what": what, "unit": unit, "ours": ours, "peer": peer, "peer_name": peer_name, "ratio": ratio}
