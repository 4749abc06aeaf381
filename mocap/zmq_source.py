"""Reads mocap frames from ZeroMQ: SUB, connected, drained by the event loop.

The socket's descriptor is edge-triggered: it reports that something has changed, not that something is there. So
everything is taken when it reports, once after registering, and once at every report to the flight. CONFLATE is not
used: it would keep one message over all bodies and hide what was dropped; the filter takes the newest by sequence and
counts the others.
"""

from __future__ import annotations

import asyncio
from types import TracebackType
from typing import Self

import zmq

from lcd_flight.model import Clock, PoseListener, PoseOptions, PoseReport
from mocap.endpoints import checked, refusal
from mocap.ingest import Ingestor

_RECONNECT_MS = 20
_RECEIVE_QUEUE = 1000
"""Frames that may wait in ZeroMQ; it drops the newest of more, so this outlasts any stall the flight survives."""
_DRAIN_LIMIT = 200
"""Frames taken at once: a flood may cost the loop a few milliseconds, never the tick."""


def open_source(endpoint: str, rigid_body: str, clock: Clock, options: PoseOptions) -> ZmqSource:
    """What listens at `endpoint`, e.g. `tcp://127.0.0.1:5555`, for one rigid body.

    Raises:
        InputError: not an endpoint, or not a name for a rigid body.
    """
    return ZmqSource(checked(endpoint), Ingestor(rigid_body, clock, options))


class ZmqSource:
    """`lcd_flight.model.PoseSource`. A publisher that is not there yet is waited for, at no cost."""

    def __init__(self, endpoint: str, ingestor: Ingestor) -> None:
        self._endpoint = endpoint
        self._ingestor = ingestor
        self._context: zmq.Context[zmq.Socket[bytes]] | None = None
        self._socket: zmq.Socket[bytes] | None = None

    async def __aenter__(self) -> Self:
        """Start listening.

        Raises:
            RefusedError: not an endpoint that can be listened to.
        """
        self._context = zmq.Context()
        socket = self._context.socket(zmq.SUB)
        socket.setsockopt(zmq.RCVHWM, _RECEIVE_QUEUE)
        socket.setsockopt(zmq.RECONNECT_IVL, _RECONNECT_MS)
        socket.setsockopt(zmq.SUBSCRIBE, self._ingestor.topic)
        try:
            socket.connect(self._endpoint)
        except zmq.ZMQError as error:
            self._context.destroy(linger=0)
            raise refusal(self._endpoint, error) from error
        self._socket = socket
        asyncio.get_running_loop().add_reader(socket.fileno(), self._drain)
        self._drain()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop listening."""
        if self._socket is not None and self._context is not None:
            asyncio.get_running_loop().remove_reader(self._socket.fileno())
            self._context.destroy(linger=0)
            self._socket = None

    def report(self, now_ns: int) -> PoseReport:
        """Drain what has arrived, and the filtered pose brought forward to `now_ns`."""
        self._drain()
        return self._ingestor.report(now_ns)

    def listen(self, listener: PoseListener) -> None:
        """Tell `listener` of every accepted frame from now on, as it arrives."""
        self._ingestor.listen(listener)

    def _drain(self) -> None:
        """Take all that has arrived; of a flood, a part now and the next at the following report."""
        if self._socket is None:
            return
        for _ in range(_DRAIN_LIMIT):
            try:
                data = self._socket.recv(zmq.NOBLOCK)
            except zmq.Again:
                return
            self._ingestor.receive(data)
