"""What logging a tick costs the loop: ours, mcap's writer called in the tick, and foxglove-sdk's.

All log the same five messages of the same ticks. Ticks are paced and only the call in the tick is timed, with the
priorities and the settings of a flight; the three take turns, so that all meet the same moods of the machine. Once with
the cores idle but for that, once with a busy process on each.
"""

from __future__ import annotations

import math
import multiprocessing
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol

import foxglove
import numpy as np
from mcap.writer import Writer

from lcd_flight.flight.realtime import realtime
from lcd_flight.model import (
    AttitudeThrust,
    FlightPlan,
    Geofence,
    Leg,
    LegKind,
    LinkReport,
    MotorRequest,
    Phase,
    PoseReport,
    RawPose,
    SafetyLimits,
    State,
    Telemetry,
    Tick,
    TickInputs,
    Trajectory,
)
from lcd_flight.observers import LogThread
from lcd_flight.record import FlightHeader, LogWriter, topics, viewer
from lcd_flight.wire import json_records
from lcd_flight.worlds import load_vehicle

ROUNDS = 20
TICKS = 3000
"""Of each writer in each round: 60,000 in all, idle and loaded."""

PERIOD_S = 0.001
"""A flight's is 10 ms; faster here, to be done in minutes. Our thread then has a tenth of its time."""

SHARES = {"median": 50.0, "99th percentile": 99.0, "99.9th percentile": 99.9, "largest": 100.0}

Pair = tuple[TickInputs, Tick]


class Log(Protocol):
    """One of the three."""

    def observe(self, inputs: TickInputs, tick: Tick) -> None:
        """Log one tick."""
        ...

    def close(self) -> None:
        """End the file."""
        ...


def rows(report: Callable[[str], None]) -> list[dict[str, Any]]:
    """The cost of logging one tick, in microseconds."""
    idle = _measured(report, "idle")
    with _busy():
        loaded = _measured(report, "loaded")
    return [
        _row(f"{load}, {name}", peer, np.percentile(costs["ours"], share), np.percentile(costs[peer], share))
        for load, costs in (("idle", idle), ("loaded", loaded))
        for name, share in SHARES.items()
        for peer in costs
        if peer != "ours"
    ]


def _measured(report: Callable[[str], None], load: str) -> dict[str, list[float]]:
    """Microseconds of each call, by writer."""
    costs: dict[str, list[float]] = {name: [] for name in _WRITERS}
    with tempfile.TemporaryDirectory() as folder, realtime() as notes:
        for note in notes:
            report(note)
        for number in range(ROUNDS):
            report(f"{load}, round {number + 1} of {ROUNDS}: {TICKS} ticks of each writer")
            pairs = [_pair(number * TICKS + sequence) for sequence in range(TICKS)]
            for name, begin in _WRITERS.items():
                path = Path(folder) / f"{name}.mcap"
                log = begin(path)
                costs[name] += _paced(log.observe, pairs)
                log.close()
                path.unlink()
    return costs


def _row(name: str, peer: str, ours_us: float, peer_us: float) -> dict[str, Any]:
    return {
        "what": f"cost in the tick, {name}",
        "unit": "us",
        "ours": round(float(ours_us), 1),
        "peer": round(float(peer_us), 1),
        "peer_name": peer,
        "ratio": round(float(peer_us / ours_us), 2),
    }


@contextmanager
def _busy() -> Iterator[None]:
    """As many processes that only compute as there are cores."""
    processes = [multiprocessing.Process(target=_compute, daemon=True) for _ in range(multiprocessing.cpu_count())]
    for process in processes:
        process.start()
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.join()


def _compute() -> None:
    while True:
        sum(range(10_000))


def _paced(observe: Callable[[TickInputs, Tick], None], pairs: list[Pair]) -> list[float]:
    """Microseconds of each call, one call a period."""
    costs = []
    deadline_s = time.perf_counter()
    for inputs, tick in pairs:
        deadline_s += PERIOD_S
        time.sleep(max(0.0, deadline_s - time.perf_counter()))
        begin_ns = time.perf_counter_ns()
        observe(inputs, tick)
        costs.append((time.perf_counter_ns() - begin_ns) / 1e3)
    return costs


class _Ours(LogThread):
    """As a flight has it; every tick must have been written."""

    def __init__(self, path: Path) -> None:
        super().__init__(LogWriter(path, _header()))

    def close(self) -> None:
        """Write all, and see that it was all."""
        super().close()
        if self.statistics.dropped or self.statistics.error:
            raise RuntimeError(f"not every tick was logged: {self.statistics}")


def _messages(inputs: TickInputs, tick: Tick) -> Iterator[tuple[topics.Topic, bytes]]:
    """What is logged of a tick."""
    assert inputs.pose.state is not None
    assert tick.reference is not None
    state, now_ns = inputs.pose.state, tick.now_ns
    yield topics.TICK_INPUTS, json_records.encode(inputs)
    yield topics.TICK, json_records.encode(tick)
    yield topics.TRANSFORMS, viewer.transforms(now_ns, state).SerializeToString()
    yield topics.POSE, viewer.vehicle_pose(now_ns, state).SerializeToString()
    yield topics.REFERENCE, viewer.reference_pose(now_ns, tick.reference).SerializeToString()


class _PlainWriter:
    """mcap's writer with its own defaults."""

    def __init__(self, path: Path) -> None:
        self._writer = Writer(str(path))
        self._writer.start()
        self._channels = {topic.name: self._register(topic) for topic in topics.TOPICS}

    def observe(self, inputs: TickInputs, tick: Tick) -> None:
        """Encode and write one tick."""
        for topic, data in _messages(inputs, tick):
            self._writer.add_message(self._channels[topic.name], tick.now_ns, data, tick.now_ns, tick.sequence)

    def close(self) -> None:
        """Write the index."""
        self._writer.finish()

    def _register(self, topic: topics.Topic) -> int:
        schema = self._writer.register_schema(topic.schema_name, topic.schema_encoding, topic.schema_data())
        return self._writer.register_channel(topic.name, topic.encoding, schema)


class _FoxgloveWriter:
    """foxglove-sdk's writer with its own defaults."""

    def __init__(self, path: Path) -> None:
        self._context = foxglove.Context()
        self._writer = foxglove.open_mcap(path, context=self._context)
        self._channels = {topic.name: self._channel(topic) for topic in topics.TOPICS}

    def observe(self, inputs: TickInputs, tick: Tick) -> None:
        """Encode and write one tick."""
        for topic, data in _messages(inputs, tick):
            self._channels[topic.name].log(data, log_time=tick.now_ns)

    def close(self) -> None:
        """Write the index."""
        self._writer.close()

    def _channel(self, topic: topics.Topic) -> foxglove.Channel:
        schema = foxglove.Schema(name=topic.schema_name, encoding=topic.schema_encoding, data=topic.schema_data())
        return foxglove.Channel(topic.name, schema=schema, message_encoding=topic.encoding, context=self._context)


_WRITERS: dict[str, Callable[[Path], Log]] = {
    "ours": _Ours,
    "mcap writer in the tick": _PlainWriter,
    "foxglove-sdk": _FoxgloveWriter,
}

_HOVER = Trajectory.hover([0.0, 0.0, 1.0], 0.0, 10.0)


def _header() -> FlightHeader:
    return FlightHeader(
        name="bench",
        mission_text="",
        plan=FlightPlan((Leg(LegKind.HOLD, _HOVER),)),
        vehicle=load_vehicle("crazyflie"),
        limits=SafetyLimits(geofence=Geofence((-3.0, -3.0, 0.0), (3.0, 3.0, 3.0))),
        link="sim://",
        seed=0,
        started=datetime.now(UTC),
        planner="none",
    )


def _pair(sequence: int) -> Pair:
    """A tick with every field filled, no two alike."""
    angle = 0.01 * sequence
    x, y = math.cos(angle), math.sin(angle)
    now_ns = 10_000_000 * (sequence + 1)
    state = State((x, y, 1.0 + 0.1 * x), (-y, x, -0.1 * y), (0.1 * x, 0.1 * y, 0.0, 0.99), (0.01 * x, 0.02 * y, x * y))
    raw = RawPose(sequence, now_ns, now_ns, state.p_WB, state.q_WB, state.v_WB_W, state.w_WB_B)
    shares = (0.5 + 0.01 * x, 0.5 - 0.01 * x, 0.5 + 0.01 * y, 0.5 - 0.01 * y)
    telemetry = Telemetry(
        stamp_ns=now_ns,
        battery_V=3.9 + 0.01 * x,
        armed=True,
        airborne=True,
        crashed=False,
        q_WB=state.q_WB,
        motor_shares=shares,
    )
    inputs = TickInputs(
        sequence,
        now_ns + 120_000,
        now_ns,
        0,
        PoseReport(state, 3_000_000, raw, 100.0, sequence),
        LinkReport(True, 4_000_000, sequence, sequence, telemetry=telemetry),
    )
    tick = Tick(
        sequence=sequence,
        now_ns=now_ns + 120_000,
        dt_s=0.01 + 1e-5 * x,
        phase=Phase.TRACK,
        leg=0,
        leg_time_s=angle,
        reference=_HOVER.reference(angle),
        setpoint=AttitudeThrust(0.3 + 0.01 * x, state.q_WB),
        motors=MotorRequest.NONE,
        position_error_W=(0.01 * x, 0.01 * y, 0.001 * x * y),
        saturated=False,
    )
    return inputs, tick
