"""The simulated MAVLink vehicle on UDP, as PX4's simulation has it, or on TCP, as ArduPilot's has it; poses go out.

UDP: it takes a free port of its own and sends to HOST:PORT, where clients listen, and to whoever talks to it. TCP: it
listens on HOST:PORT. A task brings the vehicle to now every 4 ms on absolute deadlines, so it lives in real time
however busy the machine is, and takes datagrams as they come.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Self

from lcd_flight.model import InputError, LinkContext
from lcd_flight.wire.uri_options import read_options
from sim_bridge.mavlink.bench import Bench
from sim_bridge.mavlink.keys import key_of
from sim_bridge.mavlink.options import MavlinkOptions
from sim_bridge.mavlink.ports import Port, TcpPort, UdpPort

PERIOD_NS = 4_000_000
POSE_NS = 10_000_000
"""Poses at 100 Hz."""


def open_server(address: str, options: Mapping[str, str], context: LinkContext) -> MavlinkServer:
    """The server at `host:port`, or `tcp:host:port`. For the options see `MavlinkOptions`.

    Raises:
        InputError: not an address, an unknown option, or a wrong one.
    """
    kind, _, rest = address.partition(":") if address.startswith("tcp:") else ("udp", "", address)
    host, separator, port = rest.rpartition(":")
    if not (separator and host and port.isdecimal() and int(port) < 2**16):
        raise InputError(f"address {address!r} is not HOST:PORT, e.g. 127.0.0.1:14540")
    chosen = read_options(MavlinkOptions, options, "the simulated MAVLink vehicle")
    return MavlinkServer(kind, host, int(port), chosen, context)


class MavlinkServer:
    """Serves one vehicle between `async with` and its end."""

    def __init__(self, kind: str, host: str, port: int, options: MavlinkOptions, context: LinkContext) -> None:
        self._options = options
        self._clock = context.clock
        self._publish = context.publish_pose
        key = key_of(options.key_file)
        self._bench = Bench(options, context, key, time.time_ns() - context.clock.now_ns())
        self._port: Port = TcpPort(host, port, self._receive) if kind == "tcp" else UdpPort(host, port, self._receive)
        self._name = f"{'PX4' if options.flavour == 'px4' else 'ArduCopter'} on {context.vehicle.name}"

    @property
    def description(self) -> str:
        """What it simulates."""
        return f"{self._name}, system {self._options.system}"

    @property
    def uri(self) -> str:
        """Where clients meet it."""
        return self._port.uri

    async def __aenter__(self) -> Self:
        """Take the port.

        Raises:
            RefusedError: it is not to be had.
        """
        self._bench.vehicle.body.warm_up()
        self._bench.switch_on(self._clock.now_ns())
        await self._port.open()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the port back."""
        await self._port.close()

    async def serve(self, say: Callable[[str], None]) -> None:
        """Live for ever. say: is told what happens to the vehicle, a line at a time."""
        due_ns = pose_ns = self._clock.now_ns()
        while True:
            await self._clock.sleep_until(due_ns)
            now_ns = self._clock.now_ns()
            self._bench.advance_to(now_ns)
            self._send(now_ns)
            for text in self._bench.said():
                say(text)
            if now_ns >= pose_ns:
                self._show(now_ns)
                pose_ns += POSE_NS * (1 + (now_ns - pose_ns) // POSE_NS)
            due_ns += PERIOD_NS * (1 + (now_ns - due_ns) // PERIOD_NS)

    def _show(self, now_ns: int) -> None:
        """Publish the pose, if anybody wants it."""
        frame = None if self._publish is None else self._bench.pose(now_ns)
        if frame is not None and self._publish is not None:
            self._publish(frame)

    def _receive(self, datagram: bytes) -> None:
        now_ns = self._clock.now_ns()
        self._bench.receive(datagram, now_ns)
        self._send(now_ns)

    def _send(self, now_ns: int) -> None:
        for datagram in self._bench.outgoing(now_ns):
            self._port.send(datagram)
