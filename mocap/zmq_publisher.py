"""Publishes mocap frames on ZeroMQ: PUB, bound."""

from __future__ import annotations

import zmq

from mocap.endpoints import checked, refusal

_SEND_QUEUE = 100
"""Frames kept for a slow subscriber: a second's worth; older poses are of no use to anybody."""


def open_publisher(endpoint: str) -> ZmqPublisher:
    """Bind `endpoint`, e.g. `tcp://127.0.0.1:5555`; port 0 takes a free one (see `ZmqPublisher.endpoint`).

    Raises:
        InputError: not an endpoint.
        RefusedError: the endpoint is not to be had, with the reason and the remedy.
    """
    return ZmqPublisher(checked(endpoint))


class ZmqPublisher:
    """`lcd_flight.model.PosePublisher`."""

    def __init__(self, endpoint: str) -> None:
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.PUB)
        self._socket.setsockopt(zmq.SNDHWM, _SEND_QUEUE)
        self._socket.setsockopt(zmq.LINGER, 0)
        try:
            self._socket.bind(endpoint)
        except zmq.ZMQError as error:
            self.close()
            raise refusal(endpoint, error) from error
        self.endpoint = self._socket.getsockopt_string(zmq.LAST_ENDPOINT)
        """What was bound, with the port that was found."""

    def __call__(self, data: bytes) -> None:
        """Publish one frame; PUB drops for subscribers that do not keep up, and never waits."""
        self._socket.send(data, zmq.NOBLOCK)

    def close(self) -> None:
        """Give the endpoint back."""
        self._context.destroy(linger=0)
