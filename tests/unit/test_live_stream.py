"""The live stream: ten reports a second, at once what is new, nothing lost between reports, nobody waited for."""

from __future__ import annotations

import math
import socket
from dataclasses import replace
from itertools import pairwise
from typing import cast

import pytest
import synthetic_flight
import zmq
from synthetic_flight import Pair

from lcd_flight.cli import options
from lcd_flight.model import Finding, InputError, Phase, RefusedError, Severity, State
from lcd_flight.monitor.source import LiveSource
from lcd_flight.observers import LivePublisher, LiveStream
from lcd_flight.observers import live as live_module
from lcd_flight.record.live import live_flight, live_header
from lcd_flight.wire import live_frame
from lcd_flight.wire.live_frame import LiveFlight, LiveReport, decode, encode

PAIRS = synthetic_flight.flight()
FLIGHT = encode(live_flight(synthetic_flight.header()))
GAP = Finding("pose_gap", Severity.WARN, "pose gap 42 ms (limit 300 ms)", 0.042, 0.3)


class Taken:
    """A publisher that keeps what is published."""

    def __init__(self) -> None:
        self.frames: list[LiveReport | LiveFlight] = []
        self.closed = 0

    def __call__(self, data: bytes) -> None:
        self.frames.append(decode(data))

    def close(self) -> None:
        self.closed += 1

    @property
    def reports(self) -> list[LiveReport]:
        return [frame for frame in self.frames if isinstance(frame, LiveReport)]


def published(pairs: list[Pair]) -> Taken:
    taken = Taken()
    stream = LiveStream(taken, FLIGHT)
    for inputs, tick in pairs:
        stream.observe(inputs, tick)
    stream.close()
    return taken


def free_endpoint() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp://127.0.0.1:{probe.getsockname()[1]}"


# What is published


def test_ten_reports_a_second_each_a_whole_tick() -> None:
    hold = [pair for pair in PAIRS if pair[1].phase is Phase.HOLD]
    reports = published(hold).reports
    assert len(reports) == len(hold) / 10
    assert [(r.inputs, r.tick) for r in reports] == hold[::10]
    assert [r.ticks for r in reports] == [1] + [10] * (len(reports) - 1)


def test_every_change_of_phase_is_published_at_once() -> None:
    changes = [t.sequence for (_, before), (_, t) in pairwise(PAIRS) if before.phase is not t.phase]
    assert set(changes) <= {report.tick.sequence for report in published(PAIRS).reports}


def test_a_finding_is_published_at_once_and_once() -> None:
    reports = published(synthetic_flight.with_finding(PAIRS, 303, 330, GAP)).reports
    assert [(r.tick.sequence, r.findings) for r in reports if r.findings] == [(303, (GAP,))]


def test_what_happened_between_reports_is_not_lost() -> None:
    pairs = PAIRS[200:221]
    telemetry = pairs[4][0].link.telemetry
    assert telemetry is not None
    talking = replace(pairs[4][0].link, telemetry=replace(telemetry, messages=("low on power",)))
    pairs[4] = (replace(pairs[4][0], link=talking, deadline_ns=pairs[4][0].now_ns - 7_000_000), pairs[4][1])
    pairs[5] = (replace(pairs[5][0], missed=3), pairs[5][1])
    report = published(pairs).reports[1]
    assert report.messages == ("low on power",)
    assert (report.max_lateness_ns, report.missed, report.ticks) == (7_000_000, 3, 10)
    assert published(pairs).reports[2].messages == ()


def test_the_largest_error_begins_anew_with_each_take_off() -> None:
    far = [(i, replace(t, position_error_W=(3.0, 4.0, 0.0))) for i, t in PAIRS if t.phase is Phase.HOLD]
    again = [pair for pair in PAIRS if pair[1].phase is Phase.TAKEOFF]
    reports = published([*far, *PAIRS[-1:], *again]).reports
    assert max(r.max_error_m for r in reports) == 5.0
    assert reports[-1].max_error_m == pytest.approx(0.1)


def test_the_description_is_repeated_each_second_and_comes_first() -> None:
    frames = published(PAIRS[:500]).frames
    places = [number for number, frame in enumerate(frames) if isinstance(frame, LiveFlight)]
    assert places[0] == 0
    assert len(places) == 5
    header = live_header(cast(LiveFlight, frames[0]))
    assert header.predictions == (synthetic_flight.PREDICTION,)
    assert [leg.kind for leg in header.plan.legs] == [leg.kind for leg in synthetic_flight.plan().legs]


def test_numbers_that_are_not_finite_are_published_too() -> None:
    inputs, tick = PAIRS[300]
    assert inputs.pose.state is not None
    lost = State((math.nan, math.inf, 0.0), *(getattr(inputs.pose.state, n) for n in ("v_WB_W", "q_WB", "w_WB_B")))
    (report,) = published([(replace(inputs, pose=replace(inputs.pose, state=lost)), tick)]).reports
    assert report.inputs.pose.state is not None
    assert math.isnan(report.inputs.pose.state.p_WB[0])
    assert report.inputs.pose.state.p_WB[1] == math.inf


def test_a_description_of_another_form_is_refused() -> None:
    with pytest.raises(ValueError, match="the flight's description is not as this version writes it"):
        live_header(LiveFlight({}, {}))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"mocap/cf1\0{}", "this is no live stream of a flight"),
        (b"live/7/tick\0{}", "the flight sends version 7 of the live stream, this reads 1"),
        (b'live/1/tick\0{"inputs": 1}', "a live report is not as this version writes it"),
        (b"live/1/flight\0nonsense", "a live report is not as this version writes it"),
        (b"", "this is no live stream"),
    ],
)
def test_what_is_no_report(data: bytes, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        decode(data)


def test_the_command_line_knows_the_endpoint() -> None:
    assert options.LIVE_ENDPOINT == live_module.ENDPOINT


# Over ZeroMQ


def test_a_watcher_that_comes_late_gets_all_it_needs() -> None:
    endpoint = free_endpoint()
    stream = LiveStream(LivePublisher(endpoint), FLIGHT)
    try:
        for inputs, tick in PAIRS[:100]:
            stream.observe(inputs, tick)
        with LiveSource(endpoint) as source:
            frames: list[LiveReport | LiveFlight] = []
            for inputs, tick in PAIRS[100:]:
                stream.observe(inputs, tick)
                frame = source.receive(0.02 if not frames else 0.0)
                frames += [] if frame is None else [frame]
            assert {type(frame) for frame in frames} == {LiveReport, LiveFlight}
    finally:
        stream.close()


def test_a_watcher_that_does_not_read_is_not_waited_for() -> None:
    """Its reports are dropped: here a hundred times what the queue holds."""
    endpoint, count = free_endpoint(), 100 * live_module._SEND_QUEUE
    publisher = LivePublisher(endpoint)
    context = zmq.Context()
    stuck = context.socket(zmq.SUB)
    try:
        stuck.setsockopt(zmq.RCVHWM, 1)
        stuck.setsockopt(zmq.SUBSCRIBE, b"")
        stuck.connect(endpoint)
        while not stuck.poll(10):
            publisher(FLIGHT)
        for _ in range(count):
            publisher(FLIGHT)
        received = 0
        while stuck.poll(50):
            stuck.recv()
            received += 1
        assert received < count
    finally:
        context.destroy(linger=0)
        publisher.close()
        publisher.close()


def test_an_endpoint_in_use_is_refused() -> None:
    publisher = LivePublisher(free := free_endpoint())
    try:
        with pytest.raises(RefusedError, match=f"no live view at {free}: Address already in use; --live"):
            LivePublisher(free)
    finally:
        publisher.close()


def test_what_is_no_endpoint() -> None:
    with pytest.raises(InputError, match=r"'here': Invalid argument; expected e\.g\. tcp://"), LiveSource("here"):
        pass


def test_another_publisher_is_named() -> None:
    publisher = LivePublisher(endpoint := free_endpoint())
    try:
        with LiveSource(endpoint) as source:
            while not source._socket.poll(10):
                publisher(live_frame.TOPIC + b"2/tick\0{}")
            with pytest.raises(InputError, match=f"{endpoint}: the flight sends version 2"):
                source.receive(0.0)
    finally:
        publisher.close()
