"""A pose source of one's own: mocap frames as datagrams, `udp://HOST:PORT`. Gate, clocks and filter are the house's."""

from __future__ import annotations

import asyncio
import socket
from contextlib import suppress
from typing import Self

from lcd_flight.model import Clock, InputError, PoseListener, PoseOptions, PoseReport, RefusedError
from mocap.ingest import Ingestor


def open_source(endpoint: str, rigid_body: str, clock: Clock, options: PoseOptions) -> UdpSource:
    """What listens at `udp://HOST:PORT`.

    Raises:
        InputError: not an endpoint, or not a name for a rigid body.
    """
    host, _, port = endpoint.removeprefix("udp://").rpartition(":")
    if not host or not port.isdigit():
        raise InputError(f"motion_capture.endpoint {endpoint}: write udp://HOST:PORT")
    return UdpSource((host, int(port)), Ingestor(rigid_body, clock, options))


class UdpSource:
    """`lcd_flight.model.PoseSource`."""

    def __init__(self, address: tuple[str, int], ingestor: Ingestor) -> None:
        self._address, self._ingestor = address, ingestor
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    async def __aenter__(self) -> Self:
        """Start listening.

        Raises:
            RefusedError: the port is not to be had.
        """
        self._socket.setblocking(False)
        try:
            self._socket.bind(self._address)
        except OSError as error:
            self._socket.close()
            raise RefusedError(f"cannot listen at {self._address}: {error.strerror}; choose another port") from error
        asyncio.get_running_loop().add_reader(self._socket, self._drain)
        return self

    async def __aexit__(self, *_error: object) -> None:
        """Stop listening."""
        asyncio.get_running_loop().remove_reader(self._socket)
        self._socket.close()

    def report(self, now_ns: int) -> PoseReport:
        """The filtered pose brought forward to `now_ns`."""
        return self._ingestor.report(now_ns)

    def listen(self, listener: PoseListener) -> None:
        """Tell `listener` of every accepted frame from now on, as it arrives."""
        self._ingestor.listen(listener)

    def _drain(self) -> None:
        """As soon as frames arrive, so that they are stamped then."""
        with suppress(BlockingIOError):
            while True:
                self._ingestor.receive(self._socket.recv(4096))
