"""Where bytes come from and go to, in the event loop: UDP here, TCP and serial ports in `streams`. Nothing blocks."""

from __future__ import annotations

import asyncio
import socket
from typing import Protocol

from drivers.mavlink.options import MavlinkOptions
from drivers.mavlink.peer import DATAGRAM, Peer, Receiver, resolved
from drivers.mavlink.streams import SerialPort, Tcp
from lcd_flight.model import RefusedError

DRAIN = 256
"""Datagrams taken at once: a flood must not keep the event loop from its ticks."""


class Transport(Protocol):
    """One way to a vehicle."""

    stream: bool
    """Whether bytes come without borders: a packet may begin in one piece and end in the next."""

    @property
    def called(self) -> str | None:
        """The only host that may be the vehicle, since it is called; None where the vehicle speaks first."""
        ...

    @property
    def faults(self) -> int:
        """Packets that could not be sent."""
        ...

    async def open(self, receive: Receiver) -> None:
        """Begin to receive.

        Raises:
            RefusedError: it is not to be had, with the reason.
        """
        ...

    def send(self, data: bytes, peer: Peer | None, /) -> bool:
        """Hand one packet over, to the vehicle where it is known; whether it went, or may wait for a moment."""
        ...

    def send_now(self, data: bytes, peer: Peer | None, /) -> bool:
        """The same at once or not at all: what is worth nothing later never waits behind what is older."""
        ...

    def close(self) -> None:
        """Give everything back; may be called at any time."""
        ...


def transport_to(scheme: str, address: str, options: MavlinkOptions) -> Transport:
    """What carries bytes to an address that has been read (`options.read`)."""
    if scheme == "mavlink+serial":
        return SerialPort(address, options.baud)
    host, _, port = address.rpartition(":")
    if scheme == "mavlink+tcp":
        return Tcp(host, int(port), options.connect_s)
    return Udp(host, int(port), call=options.role == "call")


class Udp:
    """A socket of our own: bound to `address`, or, where we call, sending to it first."""

    stream = False

    def __init__(self, host: str, port: int, *, call: bool) -> None:
        self.faults = 0
        self._address, self._call = (host, port), call
        self._socket: socket.socket | None = None
        self._receive: Receiver | None = None
        self._to: Peer | None = None

    @property
    def called(self) -> str | None:
        """The host that is called, once it is known."""
        return None if self._to is None else self._to[0]

    @property
    def port(self) -> int:
        """Where it listens; 0 while closed."""
        return 0 if self._socket is None else int(self._socket.getsockname()[1])

    async def open(self, receive: Receiver) -> None:
        """Bind, and read from now on.

        Raises:
            RefusedError: no such address, or the port is in use.
        """
        address = await resolved(self._address, socket.SOCK_DGRAM)
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            made.setblocking(False)
            made.bind(("", 0) if self._call else address)
        except OSError as error:
            made.close()
            host, port = self._address
            raise RefusedError(
                f"UDP port {port} of {host} is not to be had ({error.strerror}): close what else listens there"
            ) from None
        self._socket, self._receive = made, receive
        self._to = address if self._call else None
        asyncio.get_running_loop().add_reader(made.fileno(), self._drain)

    def send(self, data: bytes, peer: Peer | None, /) -> bool:
        """To the vehicle, or to whom we call; nowhere while nobody has been heard."""
        to = peer or self._to
        if self._socket is None or to is None:
            return False
        try:
            self._socket.sendto(data, to)
        except OSError:
            self.faults += 1
            return False
        return True

    def send_now(self, data: bytes, peer: Peer | None, /) -> bool:
        """As `send`: a datagram never waits."""
        return self.send(data, peer)

    def close(self) -> None:
        """Close the socket."""
        if self._socket is not None:
            asyncio.get_running_loop().remove_reader(self._socket.fileno())
            self._socket.close()
            self._socket = None

    def _drain(self) -> None:
        for _ in range(DRAIN):
            if self._socket is None or self._receive is None:
                return
            try:
                data, address = self._socket.recvfrom(DATAGRAM)
            except BlockingIOError:
                return
            except OSError:  # the other side has refused an earlier packet
                self.faults += 1
                continue
            self._receive(data, (address[0], address[1]))
