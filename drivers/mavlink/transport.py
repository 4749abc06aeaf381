"""Where bytes come from and go to, in the event loop: UDP, TCP, a serial port, or memory in tests. Nothing blocks."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
from collections.abc import Callable
from typing import Any, Protocol, TypeAlias

from drivers.mavlink.options import MavlinkOptions
from lcd_flight.model import RefusedError

Peer: TypeAlias = tuple[str, int]
"""Host and port; the name of the port and 0 for a serial one."""
Receiver: TypeAlias = Callable[[bytes, Peer], None]

DATAGRAM = 2048
DRAIN = 256
"""Datagrams taken at once: a flood must not keep the event loop from its ticks."""
SEND_BUFFER = 4096
"""Of a TCP connection: what waits in the system gets old there."""
EMPTY_READS = 50
"""So many reads in a row that find nothing, although there should be something: the port is gone."""
BACKLOG = 1024
"""Bytes of a stream that may wait to be sent; more is left out, since old setpoints are worth nothing."""


class Transport(Protocol):
    """One way to a vehicle."""

    stream: bool
    """Whether bytes come without borders: a packet may begin in one piece and end in the next."""
    faults: int
    """Packets that could not be sent."""

    async def open(self, receive: Receiver) -> None:
        """Begin to receive.

        Raises:
            RefusedError: it is not to be had, with the reason.
        """
        ...

    def send(self, data: bytes, peer: Peer | None, /) -> bool:
        """Hand one packet over, to the vehicle where it is known; whether it went."""
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
    def port(self) -> int:
        """Where it listens; 0 while closed."""
        return 0 if self._socket is None else int(self._socket.getsockname()[1])

    async def open(self, receive: Receiver) -> None:
        """Bind, and read from now on.

        Raises:
            RefusedError: no such address, or the port is in use.
        """
        address = await _resolved(self._address, socket.SOCK_DGRAM)
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

    def send(self, data: bytes, peer: Peer | None) -> bool:
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
            if self._to is None or address[0] == self._to[0]:  # who was called is heard alone
                self._receive(data, (address[0], address[1]))


class _Stream:
    """Bytes through one file descriptor that does not block."""

    stream = True
    empty_reads = 1
    """So many reads that find nothing are the end."""

    def __init__(self, name: str) -> None:
        self.faults = self._empty = 0
        self.name = name
        self._file: int | None = None
        self._receive: Receiver | None = None
        self._waiting = bytearray()

    def send(self, data: bytes, _peer: Peer | None) -> bool:
        """After what still waits; left out where too much does."""
        if self._file is None or len(self._waiting) + len(data) > BACKLOG:
            self.faults += 1
            return False
        self._waiting += data
        self._flush()
        return True

    def _begin(self, file: int, receive: Receiver) -> None:
        self._file, self._receive = file, receive
        asyncio.get_running_loop().add_reader(file, self._drain)

    def _end(self) -> None:
        if self._file is not None:
            loop = asyncio.get_running_loop()
            loop.remove_reader(self._file)
            loop.remove_writer(self._file)
            self._file = None
        self._waiting.clear()

    def _drain(self) -> None:
        if self._file is None or self._receive is None:
            return
        try:
            data = os.read(self._file, 16 * DATAGRAM)
        except BlockingIOError:
            return
        except OSError:
            data, self._empty = b"", self.empty_reads
        self._empty = 0 if data else self._empty + 1
        if self._empty >= self.empty_reads:  # the other side has closed
            self.faults += 1
            self._end()
        elif data:
            self._receive(data, (self.name, 0))

    def _flush(self) -> None:
        if self._file is None:
            return
        loop = asyncio.get_running_loop()
        try:
            written = os.write(self._file, self._waiting)
        except BlockingIOError:
            written = 0
        except OSError:
            self.faults += 1
            self._end()
            return
        del self._waiting[:written]
        if self._waiting:
            loop.add_writer(self._file, self._flush)
        else:
            loop.remove_writer(self._file)


class Tcp(_Stream):
    """A connection that we open."""

    def __init__(self, host: str, port: int, limit_s: float) -> None:
        super().__init__(f"{host}:{port}")
        self._address, self._limit_s = (host, port), limit_s
        self._socket: socket.socket | None = None

    async def open(self, receive: Receiver) -> None:
        """Connect.

        Raises:
            RefusedError: nobody accepts.
        """
        address = await _resolved(self._address, socket.SOCK_STREAM)
        made = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        made.setblocking(False)
        try:
            await asyncio.wait_for(asyncio.get_running_loop().sock_connect(made, address), self._limit_s)
            made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            made.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        except BaseException as error:
            made.close()
            if isinstance(error, OSError | TimeoutError):
                raise RefusedError(f"nobody accepts a connection at {self.name}: is the autopilot on?") from None
            raise
        self._socket = made
        self._begin(made.fileno(), receive)

    def close(self) -> None:
        """Close the connection."""
        self._end()
        if self._socket is not None:
            self._socket.close()
            self._socket = None


class SerialPort(_Stream):
    """A serial port, for us alone."""

    empty_reads = EMPTY_READS

    def __init__(self, path: str, baud: int) -> None:
        super().__init__(path)
        self._baud = baud
        self._port: Any = None

    async def open(self, receive: Receiver) -> None:
        """Open it exclusively.

        Raises:
            RefusedError: it is not there, not allowed, or held by another program.
        """
        import serial

        try:
            self._port = serial.Serial(self.name, self._baud, timeout=0, write_timeout=0, exclusive=True)
        except (serial.SerialException, OSError, ValueError) as error:
            raise RefusedError(
                f"serial port {self.name} is not to be had ({_reason(error)}): plug it in, join the group dialout, and "
                "close other programs that hold it"
            ) from None
        os.set_blocking(self._port.fileno(), False)
        self._begin(self._port.fileno(), receive)

    def close(self) -> None:
        """Give it back."""
        self._end()
        if self._port is not None:
            with contextlib.suppress(OSError):
                self._port.close()
            self._port = None


async def _resolved(address: Peer, kind: socket.SocketKind) -> Peer:
    host, port = address
    try:
        found = await asyncio.get_running_loop().getaddrinfo(host, port, family=socket.AF_INET, type=kind)
    except OSError as error:
        raise RefusedError(f"{host} is not to be found ({error.strerror})") from None
    return (str(found[0][4][0]), port)


def _reason(error: Exception) -> str:
    number = error.errno if isinstance(error, OSError) else None
    return str(error) if number is None else os.strerror(number)
