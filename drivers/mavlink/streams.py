"""Transports whose bytes come and go without borders: TCP and serial ports.

What was handed to the system cannot be taken back, and comes out after a stall however old it is. So the system is
asked what it still holds before each packet: a setpoint goes only where nothing older than 50 ms waits, and poses and
commands wait within limits (`backlog`).
"""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import os
import socket
import struct
import termios
from typing import Any

from drivers.mavlink.backlog import BACKLOG, Backlog
from drivers.mavlink.peer import DATAGRAM, Peer, Receiver, resolved
from lcd_flight.model import RefusedError

HOLD_S = 0.05
"""Older bytes that the system still holds mean a stall. TCP's delayed acknowledgements take up to 40 ms."""
QUIET_S = 0.1
"""A vehicle at the other end of TCP that says nothing for so long may not read either: it has 64 kB and more to let
setpoints get old in, and its system acknowledges them all the same."""
SEND_BUFFER = 16_384
"""Of a TCP connection, with the system's own overhead of about 1 kB for each packet."""
BITS_PER_BYTE = 10
"""On a serial line, with start and stop bit."""
_HELD = termios.TIOCOUTQ
"""Bytes that a serial port has not sent; as SIOCOUTQ, those that TCP has not seen acknowledged."""
_UNSENT = 0x894B
"""SIOCOUTQNSD (linux/sockios.h): bytes that TCP has not sent even once."""


class _Stream:
    """Bytes through one file descriptor that does not block."""

    stream = True
    called: str | None = None

    def __init__(self, name: str) -> None:
        self.name = name
        self._faults = 0
        self._file: int | None = None
        self._receive: Receiver | None = None
        self._backlog = Backlog()
        self._heard_s = 0.0

    @property
    def faults(self) -> int:
        """Packets that could not be sent, and the end of the connection."""
        return self._faults + self._backlog.dropped

    def send(self, data: bytes, _peer: Peer | None, /) -> bool:
        """After what still waits; left out where too much does."""
        self._flush()
        if self._file is None or len(self._backlog) + self._held(self._file) + len(data) > BACKLOG:
            self._faults += 1
            return False
        self._backlog.add(data, _now_s())
        self._flush()
        return True

    def send_now(self, data: bytes, _peer: Peer | None, /) -> bool:
        """At once, where nothing old is before it; otherwise not at all."""
        self._flush()
        written = self._write(self._file, data) if self._file is not None and self._moves(self._file) else 0
        if written == 0:
            self._faults += 1
            return False
        if written < len(data):
            self._backlog.add(data[written:], _now_s(), begun=True)
            self._flush()
        return True

    def _held(self, file: int) -> int:
        """Bytes that the system still has."""
        return _asked(file, _HELD)

    def _takes(self, _file: int) -> bool:
        """Whether the system should be given more."""
        return True

    def _moves(self, file: int) -> bool:
        """Whether what was sent before has left, or will have left in a moment."""
        waits = len(self._backlog) > 0 or not self._takes(file)
        return not waits and self._backlog.age_s(self._held(file), _now_s()) <= HOLD_S

    def _begin(self, file: int, receive: Receiver) -> None:
        self._file, self._receive, self._heard_s = file, receive, _now_s()
        asyncio.get_running_loop().add_reader(file, self._drain)

    def _end(self) -> None:
        if self._file is not None:
            loop = asyncio.get_running_loop()
            loop.remove_reader(self._file)
            loop.remove_writer(self._file)
            self._file = None
        self._backlog.clear()

    def _fail(self) -> None:
        self._faults += 1
        self._end()

    def _drain(self) -> None:
        if self._file is None or self._receive is None:
            return
        try:
            data = os.read(self._file, 16 * DATAGRAM)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if data:
            self._heard_s = _now_s()
            self._receive(data, (self.name, 0))
        else:  # the other side has closed
            self._fail()

    def _flush(self) -> None:
        """Hand over what waits, as far as it goes."""
        while self._file is not None and (data := self._backlog.next(_now_s())):
            written = self._write(self._file, data) if self._takes(self._file) else 0
            if written == 0:
                break
            self._backlog.take(written)
        if self._file is not None:
            loop = asyncio.get_running_loop()
            if len(self._backlog):
                loop.add_writer(self._file, self._flush)
            else:
                loop.remove_writer(self._file)

    def _write(self, file: int, data: bytes) -> int:
        """How many bytes the system has taken."""
        try:
            written = os.write(file, data)
        except BlockingIOError:
            return 0
        except OSError:
            self._fail()
            return 0
        self._backlog.note(written, _now_s())
        return written


class Tcp(_Stream):
    """A connection that we open."""

    def __init__(self, host: str, port: int, limit_s: float) -> None:
        super().__init__(f"{host}:{port}")
        self._address, self._limit_s = (host, port), limit_s
        self._socket: socket.socket | None = None

    async def open(self, receive: Receiver) -> None:
        """Connect.

        Raises:
            RefusedError: nobody accepts, or this system does not tell what waits in a connection.
        """
        address = await resolved(self._address, socket.SOCK_STREAM)
        made = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        made.setblocking(False)
        try:
            await asyncio.wait_for(asyncio.get_running_loop().sock_connect(made, address), self._limit_s)
            _keep_little(made)
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

    def _takes(self, file: int) -> bool:
        return _asked(file, _UNSENT) == 0

    def _moves(self, file: int) -> bool:
        return _now_s() - self._heard_s <= QUIET_S and super()._moves(file)


class SerialPort(_Stream):
    """A serial port, for us alone."""

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
            _tell_end_from_nothing(self._port.fileno())
        except (serial.SerialException, OSError, ValueError, termios.error) as error:
            raise RefusedError(
                f"serial port {self.name} is not to be had ({_reason(error)}): plug it in, join the group dialout, and "
                "close other programs that hold it"
            ) from None
        self._begin(self._port.fileno(), receive)

    def close(self) -> None:
        """Give it back."""
        self._end()
        if self._port is not None:
            with contextlib.suppress(OSError):
                self._port.close()
            self._port = None

    def _moves(self, file: int) -> bool:
        return super()._moves(file) and self._held(file) <= HOLD_S * self._baud / BITS_PER_BYTE


def _keep_little(made: socket.socket) -> None:
    """Have the system send at once, hold little, and call for more when it has nothing unsent."""
    made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, 1)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
    try:
        fcntl.ioctl(made.fileno(), _UNSENT, bytes(4))
    except OSError:
        raise RefusedError(
            "this system does not tell what waits in a TCP connection, where setpoints would get old: use mavlink+udp"
        ) from None


def _tell_end_from_nothing(file: int) -> None:
    """Have a read of nothing say so; as pyserial opens a port (VMIN 0) it looks like one that was pulled out."""
    settings = termios.tcgetattr(file)
    settings[6][termios.VMIN], settings[6][termios.VTIME] = 1, 0
    termios.tcsetattr(file, termios.TCSANOW, settings)
    os.set_blocking(file, False)


def _asked(file: int, request: int) -> int:
    """Bytes, as the system counts them; more than any limit where it does not answer, as for a port pulled out."""
    try:
        return int(struct.unpack("i", fcntl.ioctl(file, request, bytes(4)))[0])
    except OSError:
        return BACKLOG + 1


def _now_s() -> float:
    return asyncio.get_running_loop().time()


def _reason(error: Exception) -> str:
    number = error.errno if isinstance(error, OSError) else None
    return str(error) if number is None else os.strerror(number)
