"""A pose source and its publisher within one process, without sockets: for virtual time, where order must be certain.

Endpoints are names, `loopback://NAME`. As with ZeroMQ, either side may come first, and what nobody listens to is gone.
"""

from __future__ import annotations

from types import TracebackType
from typing import Self

from lcd_flight.model import Clock, PoseListener, PoseOptions, PoseReport, RefusedError
from mocap.ingest import Ingestor

_listeners: dict[str, list[Ingestor]] = {}
_published: set[str] = set()


def open_source(endpoint: str, rigid_body: str, clock: Clock, options: PoseOptions) -> LoopbackSource:
    """What listens at `endpoint` for one rigid body.

    Raises:
        InputError: not a name for a rigid body.
    """
    return LoopbackSource(endpoint, Ingestor(rigid_body, clock, options))


def open_publisher(endpoint: str) -> LoopbackPublisher:
    """What publishes at `endpoint`.

    Raises:
        RefusedError: another publisher has it.
    """
    return LoopbackPublisher(endpoint)


class LoopbackSource:
    """`lcd_flight.model.PoseSource`: a frame is in the filter before the publisher's call returns."""

    def __init__(self, endpoint: str, ingestor: Ingestor) -> None:
        self._endpoint = endpoint
        self._ingestor = ingestor

    async def __aenter__(self) -> Self:
        """Start listening."""
        _listeners.setdefault(self._endpoint, []).append(self._ingestor)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop listening."""
        _listeners[self._endpoint].remove(self._ingestor)

    def report(self, now_ns: int) -> PoseReport:
        """The filtered pose brought forward to `now_ns`."""
        return self._ingestor.report(now_ns)

    def listen(self, listener: PoseListener) -> None:
        """Tell `listener` of every accepted frame from now on, as it arrives."""
        self._ingestor.listen(listener)


class LoopbackPublisher:
    """`lcd_flight.model.PosePublisher`."""

    def __init__(self, endpoint: str) -> None:
        if endpoint in _published:
            raise RefusedError(f"motion capture endpoint {endpoint} is in use: choose another name")
        _published.add(endpoint)
        self._endpoint = endpoint

    def __call__(self, data: bytes) -> None:
        """Hand one frame to all who listen for its body."""
        for listener in _listeners.get(self._endpoint, ()):
            if data.startswith(listener.topic):
                listener.receive(data)

    def close(self) -> None:
        """Give the endpoint back."""
        _published.discard(self._endpoint)
