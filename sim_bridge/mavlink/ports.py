"""UDP and TCP ports: bytes in and out, nobody else's business. What is kept of clients is bounded."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from typing import Any, Protocol, cast

from lcd_flight.model import RefusedError
from sim_bridge.mavlink.framing import split

MOST_CLIENTS = 4
"""Each gets everything."""
MOST_UNSENT = 100_000
"""Bytes that wait for a slow client; beyond, packets are lost."""
Receive = Callable[[bytes], None]
Address = tuple[str, int]


class Port(Protocol):
    """Where clients meet the vehicle."""

    @property
    def uri(self) -> str:
        """Its place."""
        ...

    async def open(self) -> None:
        """Take it.

        Raises:
            RefusedError: it is not to be had.
        """
        ...

    async def close(self) -> None:
        """Give it back."""
        ...

    def send(self, datagram: bytes) -> None:
        """To all clients."""
        ...


class UdpPort:
    """A port of its own, from which it sends to HOST:PORT and to whoever talks to it; port 0: to the latter alone."""

    def __init__(self, host: str, port: int, receive: Receive) -> None:
        self._host, self._port, self._receive = host, port, receive
        self._transport: asyncio.DatagramTransport | None = None
        self._listener: Address | None = None
        self._talkers: dict[Address, None] = {}

    @property
    def uri(self) -> str:
        """Where it sends to; without that, where it is."""
        if self._port or self._transport is None:
            return f"udp://{self._host}:{self._port}"
        return f"udp://{self._host}:{self._transport.get_extra_info('sockname')[1]}"

    async def open(self) -> None:
        """Take a free port.

        Raises:
            RefusedError: none is to be had, or there is no such host.
        """
        loop = asyncio.get_running_loop()
        try:
            found = await loop.getaddrinfo(self._host, self._port, family=socket.AF_INET, type=socket.SOCK_DGRAM)
            there = (str(found[0][4][0]), self._port)
            here = "127.0.0.1" if there[0].startswith("127.") else "0.0.0.0"  # noqa: S104 - remote clients answer
            transport, _ = await loop.create_datagram_endpoint(lambda: _Datagrams(self._hear), local_addr=(here, 0))
        except OSError as error:
            raise RefusedError(f"{self.uri} cannot be sent to: {error.strerror or error}") from error
        self._transport = transport
        self._listener = there if self._port else None

    async def close(self) -> None:
        """Give it back."""
        if self._transport is not None:
            self._transport.close()

    def send(self, datagram: bytes) -> None:
        """To all clients."""
        if self._transport is not None:
            for client in (self._listener, *self._talkers):
                if client is not None:
                    self._transport.sendto(datagram, client)

    def _hear(self, datagram: bytes, client: Address) -> None:
        """The talker that came first makes room."""
        if client != self._listener and client not in self._talkers:
            if len(self._talkers) >= MOST_CLIENTS:
                del self._talkers[next(iter(self._talkers))]
            self._talkers[client] = None
        self._receive(datagram)


class TcpPort:
    """Listens; packets are cut out of the stream."""

    def __init__(self, host: str, port: int, receive: Receive) -> None:
        self._host, self._port, self._receive = host, port, receive
        self._server: asyncio.Server | None = None
        self._clients: list[asyncio.Transport] = []

    @property
    def uri(self) -> str:
        """Where it listens."""
        return f"tcp://{self._host}:{self._port}"

    async def open(self) -> None:
        """Listen.

        Raises:
            RefusedError: the port is not to be had.
        """
        loop = asyncio.get_running_loop()
        try:
            self._server = await loop.create_server(lambda: _Stream(self), self._host, self._port)
        except OSError as error:
            reason = error.strerror or str(error)
            raise RefusedError(f"{self.uri} is not to be had: {reason}; choose another port with --port") from error
        self._port = self._server.sockets[0].getsockname()[1]

    async def close(self) -> None:
        """Give it back."""
        for client in list(self._clients):
            client.abort()
        if self._server is not None:
            self._server.close()
            await self._server.wait_closed()

    def send(self, datagram: bytes) -> None:
        """To all clients; a slow one loses some."""
        for client in self._clients:
            if client.get_write_buffer_size() < MOST_UNSENT:
                client.write(datagram)

    def join(self, client: asyncio.Transport) -> None:
        """A client has connected; too many of them, and it is put off."""
        if len(self._clients) >= MOST_CLIENTS:
            client.abort()
        else:
            self._clients.append(client)

    def leave(self, client: asyncio.Transport) -> None:
        """It has gone."""
        if client in self._clients:
            self._clients.remove(client)

    def hear(self, packet: bytes) -> None:
        """A whole packet."""
        self._receive(packet)


class _Datagrams(asyncio.DatagramProtocol):
    """Hands datagrams on. Errors are a client that has gone: nothing to be done."""

    def __init__(self, receive: Callable[[bytes, Any], None]) -> None:
        self._receive = receive

    def datagram_received(self, data: bytes, addr: Any) -> None:
        """One datagram."""
        self._receive(data, addr)


class _Stream(asyncio.Protocol):
    """One connection: what is left of a packet waits for the rest."""

    def __init__(self, port: TcpPort) -> None:
        self._port = port
        self._rest = b""
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client connects."""
        self._transport = cast(asyncio.Transport, transport)
        self._port.join(self._transport)

    def connection_lost(self, _: Exception | None) -> None:
        """It has gone."""
        if self._transport is not None:
            self._port.leave(self._transport)

    def data_received(self, data: bytes) -> None:
        """Some bytes."""
        packets, self._rest = split(self._rest + data)
        for packet in packets:
            self._port.hear(packet)
