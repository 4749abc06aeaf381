"""What may be wrong with a ZeroMQ endpoint, said so that a user can put it right."""

from __future__ import annotations

import errno
import os

import zmq

from lcd_flight.model import InputError, RefusedError

_MAX_PORT = 65535


def checked(endpoint: str) -> str:
    """The endpoint itself. ZeroMQ takes a port number modulo 65536 without a word; here it is refused.

    Raises:
        InputError: not `tcp://HOST:PORT` with a port of 0 to 65535; other kinds are left to ZeroMQ.
    """
    if endpoint.startswith("tcp://"):
        port = endpoint.rpartition(":")[2]
        if not (port == "*" or (port.isascii() and port.isdigit() and int(port) <= _MAX_PORT)):
            raise InputError(f"motion capture endpoint {endpoint}: the port must be a number from 0 to {_MAX_PORT}")
    return endpoint


def refusal(endpoint: str, error: zmq.ZMQError) -> RefusedError:
    """Why an endpoint is not to be had, and what to do."""
    where = f"motion capture endpoint {endpoint}"
    match error.errno:
        case errno.EADDRINUSE:
            text = f"{where} is in use: stop the program that has it, or set motion_capture.endpoint to a free port"
        case errno.EADDRNOTAVAIL | errno.ENODEV:
            text = f"{where} is not an address of this machine: set motion_capture.endpoint to one of its own"
        case errno.EACCES:
            text = f"{where} needs more rights than this user has: choose a port above 1023, or another file"
        case _:
            text = (
                f"{where} cannot be opened ({os.strerror(error.errno or 0)}): write it as tcp://HOST:PORT or ipc://FILE"
            )
    return RefusedError(text)
