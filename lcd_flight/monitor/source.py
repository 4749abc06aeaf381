"""Receives the live stream of a flight."""

from __future__ import annotations

from types import TracebackType
from typing import Self

import zmq

from lcd_flight.model import InputError
from lcd_flight.wire.live_frame import TOPIC, LiveFlight, LiveReport, decode

_RECONNECT_MS = 100


class LiveSource:
    """A context manager. A flight that has not begun is waited for; one after another may be watched."""

    def __init__(self, endpoint: str) -> None:
        self._endpoint = endpoint
        self._context = zmq.Context()

    def __enter__(self) -> Self:
        """Connect.

        Raises:
            InputError: not an endpoint.
        """
        self._socket = self._context.socket(zmq.SUB)
        self._socket.setsockopt(zmq.SUBSCRIBE, TOPIC)
        self._socket.setsockopt(zmq.RECONNECT_IVL, _RECONNECT_MS)
        try:
            self._socket.connect(self._endpoint)
        except zmq.ZMQError as error:
            self._context.destroy(linger=0)
            reason = zmq.strerror(error.errno or 0)
            raise InputError(f"{self._endpoint!r}: {reason}; expected e.g. tcp://127.0.0.1:5565") from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Disconnect."""
        self._context.destroy(linger=0)

    def receive(self, wait_s: float) -> LiveReport | LiveFlight | None:
        """The next message, in order; None where none comes within `wait_s`.

        Raises:
            InputError: who publishes there is no flight, or one of another version.
        """
        if not self._socket.poll(round(wait_s * 1e3)):
            return None
        try:
            return decode(self._socket.recv())
        except ValueError as error:
            raise InputError(f"{self._endpoint}: {error}") from error
