"""Serves a flight that is being watched to Foxglove and its like: the topics of the log, over WebSocket."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from types import TracebackType
from typing import Any, Self

from lcd_flight.model import RefusedError, Tick, TickInputs
from lcd_flight.record import topics
from lcd_flight.record.display import Display, Shown
from lcd_flight.record.live import live_header
from lcd_flight.record.topics import TOPICS, Topic
from lcd_flight.wire import json_records
from lcd_flight.wire.live_frame import LiveFlight, LiveReport

HOST, PORT = "127.0.0.1", 8765
"""Foxglove's own default port; this machine only."""


class FoxgloveServer:
    """A context manager that takes what is received. What stands still comes again with each description."""

    def __init__(self, port: int = PORT) -> None:
        """port: 0 takes a free one (see `port`).

        Raises:
            RefusedError: foxglove-sdk is not installed, or the port is not to be had.
        """
        try:
            import foxglove
        except ImportError as error:
            raise RefusedError("--foxglove needs foxglove-sdk: pip install 'lcd-flight[foxglove]'") from error
        self._context = foxglove.Context()  # kept: channels end with it
        try:
            self._server = foxglove.start_server(name="lcd-flight", host=HOST, port=port, context=self._context)
        except RuntimeError as error:
            raise RefusedError(f"--foxglove {port}: the port is not to be had ({error})") from error
        self.port = int(self._server.port)
        self._channels = {topic.name: _channel(foxglove, topic, self._context) for topic in TOPICS}
        self._display: Display | None = None
        self._now_ns = 0

    def __enter__(self) -> Self:
        """Nothing more to do."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop serving."""
        self._server.stop()

    def take(self, frame: LiveReport | LiveFlight) -> None:
        """Pass one message on; reports that come before the flight's description are left out."""
        if isinstance(frame, LiveFlight):
            self._describe(frame)
        elif self._display is not None:
            inputs, tick = _since_the_last(frame)
            self._now_ns = tick.now_ns
            self._send(topics.TICK_INPUTS, json_records.encode(inputs))
            self._send(topics.TICK, json_records.encode(tick))
            self._show(self._display.tick(inputs, tick))

    def _describe(self, flight: LiveFlight) -> None:
        if self._display is None:
            header = live_header(flight)
            self._display = Display(header.plan, header.vehicle, header.limits)
        if self._now_ns:
            self._show(self._display.surroundings(self._now_ns))

    def _show(self, messages: Iterable[Shown]) -> None:
        for topic, message, _ in messages:
            self._send(topic, message.SerializeToString())

    def _send(self, topic: Topic, data: bytes) -> None:
        self._channels[topic.name].log(data, log_time=self._now_ns)


def _channel(foxglove: Any, topic: Topic, context: Any) -> Any:
    schema = foxglove.Schema(name=topic.schema_name, encoding=topic.schema_encoding, data=topic.schema_data())
    return foxglove.Channel(topic.name, schema=schema, message_encoding=topic.encoding, context=context)


def _since_the_last(report: LiveReport) -> tuple[TickInputs, Tick]:
    """The newest tick, with findings and messages of those that were not sent."""
    tick, inputs = report.tick, report.inputs
    begun = tuple(finding for finding in report.findings if finding not in tick.findings)
    link = inputs.link
    if link.telemetry is not None:
        link = replace(link, telemetry=replace(link.telemetry, messages=report.messages))
    return replace(inputs, link=link), replace(tick, findings=(*tick.findings, *begun))
