"""Publishes a flight while it goes on, for watchers in processes of their own: ten reports a second over ZeroMQ.

A report costs a tick the encoding of that tick; nine of ten ticks cost the counting alone. PUB never waits: a watcher
that does not keep up loses reports, and the flight does not know.
"""

from __future__ import annotations

import math
from typing import Protocol

import zmq

from lcd_flight.model import Finding, Phase, RefusedError, Tick, TickInputs
from lcd_flight.wire.live_frame import LiveReport, encode

ENDPOINT = "tcp://127.0.0.1:5565"
"""Where a flight is published unless it is told otherwise; this machine only."""

REPORT_NS = 100_000_000
DESCRIBE_NS = 1_000_000_000

_SEND_QUEUE = 50
"""Reports kept for a slow watcher: five seconds."""
_LINGER_MS = 200
"""For the last report; more is no watcher worth waiting for."""


class Publisher(Protocol):
    """Where reports go out. Never waits."""

    def __call__(self, data: bytes) -> None:
        """Publish one message part."""
        ...

    def close(self) -> None:
        """Give the endpoint back."""
        ...


class LiveStream:
    """The observer that publishes: each 100 ms, and at once where the phase changes or a finding begins."""

    def __init__(self, publish: Publisher, flight: bytes) -> None:
        """flight: its description, encoded (`lcd_flight.wire.live_frame`); repeated each second."""
        self._publish, self._flight = publish, flight
        self._described_ns = self._reported_ns = -DESCRIBE_NS
        self._before: Tick | None = None
        self._reset()
        self._max_error_m = 0.0

    def observe(self, inputs: TickInputs, tick: Tick) -> None:
        """Take note of one tick."""
        self._count(inputs, tick)
        turned = self._before is None or tick.phase is not self._before.phase or bool(self._findings)
        self._before = tick
        if turned or tick.now_ns - self._reported_ns >= REPORT_NS:
            self._report(inputs, tick)

    def close(self) -> None:
        """Publish no more."""
        self._publish.close()

    def _reset(self) -> None:
        self._ticks = self._missed = self._max_lateness_ns = 0
        self._findings: list[Finding] = []
        self._messages: list[str] = []

    def _count(self, inputs: TickInputs, tick: Tick) -> None:
        self._ticks += 1
        self._missed += inputs.missed
        self._max_lateness_ns = max(self._max_lateness_ns, inputs.now_ns - inputs.deadline_ns)
        if tick.phase is Phase.TAKEOFF and (self._before is None or not self._before.phase.airborne):
            self._max_error_m = 0.0
        if tick.position_error_W is not None and tick.phase.airborne:
            self._max_error_m = max(self._max_error_m, math.hypot(*tick.position_error_W))
        if tick.findings:
            known = set() if self._before is None else {finding.code for finding in self._before.findings}
            self._findings += [finding for finding in tick.findings if finding.code not in known]
        if inputs.link.telemetry is not None:
            self._messages += inputs.link.telemetry.messages

    def _report(self, inputs: TickInputs, tick: Tick) -> None:
        if tick.now_ns - self._described_ns >= DESCRIBE_NS:
            self._publish(self._flight)
            self._described_ns = tick.now_ns
        report = LiveReport(
            inputs=inputs,
            tick=tick,
            ticks=self._ticks,
            missed=self._missed,
            max_lateness_ns=self._max_lateness_ns,
            max_error_m=self._max_error_m,
            findings=tuple(self._findings),
            messages=tuple(self._messages),
        )
        self._publish(encode(report))
        self._reported_ns = tick.now_ns
        self._reset()


class LivePublisher:
    """`Publisher` on ZeroMQ: PUB, bound."""

    def __init__(self, endpoint: str = ENDPOINT) -> None:
        """Bind, e.g. `tcp://127.0.0.1:5565`.

        Raises:
            RefusedError: the endpoint is not to be had.
        """
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.PUB)
        self._socket.setsockopt(zmq.SNDHWM, _SEND_QUEUE)
        self._socket.setsockopt(zmq.LINGER, _LINGER_MS)
        try:
            self._socket.bind(endpoint)
        except zmq.ZMQError as error:
            self.close()
            reason = zmq.strerror(error.errno or 0)
            raise RefusedError(f"no live view at {endpoint}: {reason}; --live chooses another place") from error

    def __call__(self, data: bytes) -> None:
        """Publish one message part."""
        self._socket.send(data, zmq.NOBLOCK)

    def close(self) -> None:
        """Give the endpoint back. May be called again."""
        self._context.destroy()
