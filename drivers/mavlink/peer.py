"""Who is at the other end, as a transport names it."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from typing import TypeAlias

from lcd_flight.model import RefusedError

Peer: TypeAlias = tuple[str, int]
"""Host and port; the name of the port and 0 for a serial one."""
Receiver: TypeAlias = Callable[[bytes, Peer], None]

DATAGRAM = 2048


async def resolved(address: Peer, kind: socket.SocketKind) -> Peer:
    """The IPv4 address of a host.

    Raises:
        RefusedError: there is no such host.
    """
    host, port = address
    try:
        found = await asyncio.get_running_loop().getaddrinfo(host, port, family=socket.AF_INET, type=kind)
    except OSError as error:
        raise RefusedError(f"{host} is not to be found ({error.strerror})") from None
    return (str(found[0][4][0]), port)
