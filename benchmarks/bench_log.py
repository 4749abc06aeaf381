"""What logging costs a tick: our queue and writer thread against mcap's writer, as it comes, called in the tick.

Both log the same five messages of the same ticks. Ticks are paced and only the call in the tick is timed; the two
take turns, so that both meet the same moods of the machine.
"""

from __future__ import annotations

import gc
import math
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import Writer

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

ROUNDS = 4
TICKS = 750
"""Of each side in each round."""

PERIOD_S = 0.002
"""A flight's is 10 ms; faster here, to be done in seconds."""

SWITCH_INTERVAL_S = 2e-4
"""As the flight loop sets it."""

Pair = tuple[TickInputs, Tick]


def rows(report: Callable[[str], None]) -> list[dict[str, Any]]:
    """The cost of logging one tick, in microseconds."""
    ours_us: list[float] = []
    plain_us: list[float] = []
    with tempfile.TemporaryDirectory() as folder, _as_in_flight():
        for number in range(ROUNDS):
            report(f"round {number + 1} of {ROUNDS}, {2 * TICKS} ticks")
            pairs = [_pair(number * TICKS + sequence) for sequence in range(TICKS)]
            plain = _PlainWriter(Path(folder) / f"plain-{number}.mcap")
            plain_us += _paced(plain.observe, pairs)
            plain.close()
            thread = LogThread(LogWriter(Path(folder) / f"ours-{number}.mcap", _header()))
            ours_us += _paced(thread.observe, pairs)
            thread.close()
            if thread.statistics.written != TICKS:
                raise RuntimeError(f"not every tick was logged: {thread.statistics}")
    shares = {"median": 50.0, "99th percentile": 99.0, "99.9th percentile": 99.9, "largest": 100.0}
    return [_row(name, np.percentile(ours_us, share), np.percentile(plain_us, share)) for name, share in shares.items()]


def _row(name: str, ours_us: float, plain_us: float) -> dict[str, Any]:
    return {
        "what": f"cost in the tick, {name}",
        "unit": "us",
        "ours": round(float(ours_us), 1),
        "peer": round(float(plain_us), 1),
        "peer_name": "mcap writer in the tick",
        "ratio": round(float(plain_us / ours_us), 2),
    }


@contextmanager
def _as_in_flight() -> Iterator[None]:
    """The interpreter as the flight loop sets it up."""
    interval_s = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    gc.disable()
    try:
        yield
    finally:
        sys.setswitchinterval(interval_s)
        gc.enable()


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


class _PlainWriter:
    """The peer: mcap's writer with its own defaults, given the same messages."""

    def __init__(self, path: Path) -> None:
        self._writer = Writer(str(path))
        self._writer.start()
        self._channels = {topic.name: self._register(topic) for topic in topics.TOPICS}

    def observe(self, inputs: TickInputs, tick: Tick) -> None:
        """Encode and write one tick."""
        assert inputs.pose.state is not None
        state, now_ns = inputs.pose.state, tick.now_ns
        for topic, data in (
            (topics.TICK_INPUTS, json_records.encode(inputs)),
            (topics.TICK, json_records.encode(tick)),
            (topics.TRANSFORMS, viewer.transforms(now_ns, state).SerializeToString()),
            (topics.POSE, viewer.vehicle_pose(now_ns, state).SerializeToString()),
            (topics.REFERENCE, viewer.reference_pose(now_ns, tick.reference).SerializeToString()),
        ):
            self._writer.add_message(self._channels[topic.name], now_ns, data, now_ns, tick.sequence)

    def close(self) -> None:
        """Write the index."""
        self._writer.finish()

    def _register(self, topic: topics.Topic) -> int:
        schema = self._writer.register_schema(topic.schema_name, topic.schema_encoding, topic.schema_data())
        return self._writer.register_channel(topic.name, topic.encoding, schema)


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
    telemetry = Telemetry(now_ns, 3.9 + 0.01 * x, True, True, False, state.q_WB, shares)
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
