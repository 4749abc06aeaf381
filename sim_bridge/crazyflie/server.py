"""The simulated Crazyflie on a UDP port, as cflib's `udp://` driver wants it; poses go out as from a camera system.

One datagram is one packet. Whoever spoke last is the client. A task brings the vehicle to now every 5 ms on absolute
deadlines, so it lives in real time however busy the machine is, and takes datagrams as they come.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any, Self

from lcd_flight.model import InputError, LinkContext, RefusedError
from lcd_flight.wire.uri_options import read_options
from sim_bridge.camera import Camera
from sim_bridge.crazyflie.bench import Bench
from sim_bridge.crazyflie.options import CrazyflieOptions

PERIOD_NS = 5_000_000
POSE_EVERY = 2
"""Periods: poses at 100 Hz."""


def open_server(address: str, options: Mapping[str, str], context: LinkContext) -> CrazyflieServer:
    """The server at `host:port`; port 0 takes a free one. For the options see `CrazyflieOptions`.

    Raises:
        InputError: not an address, an unknown option, or a vehicle that does not fly thrust and attitude setpoints.
    """
    host, separator, port = address.rpartition(":")
    if not (separator and host and port.isdecimal() and int(port) < 2**16):
        raise InputError(f"address {address!r} is not HOST:PORT, e.g. 127.0.0.1:19850")
    return CrazyflieServer(host, int(port), read_options(CrazyflieOptions, options, "the simulated Crazyflie"), context)


class CrazyflieServer:
    """Serves one vehicle between `async with` and its end."""

    def __init__(self, host: str, port: int, options: CrazyflieOptions, context: LinkContext) -> None:
        self._host, self._port = host, port
        self._bench = Bench(options, context)
        self._clock = context.clock
        self._publish = context.publish_pose
        self._camera = Camera(
            context.rigid_body, context.seed, options.noise_mm, options.noise_deg, twist=options.twist
        )
        self._transport: asyncio.DatagramTransport | None = None
        self._client: tuple[str | Any, int] | None = None

    @property
    def description(self) -> str:
        """What it simulates."""
        kind = self._bench.variant
        return f"{kind.device}, firmware {kind.firmware} (protocol {kind.protocol})"

    @property
    def uri(self) -> str:
        """Where clients connect to."""
        return f"udp://{self._host}:{self._port}"

    async def __aenter__(self) -> Self:
        """Take the port.

        Raises:
            RefusedError: it is not to be had.
        """
        loop = asyncio.get_running_loop()
        self._bench.vehicle.body.warm_up()
        self._bench.switch_on(self._clock.now_ns())
        try:
            transport, _ = await loop.create_datagram_endpoint(
                lambda: _Receiver(self._receive), local_addr=(self._host, self._port)
            )
        except OSError as error:
            reason = error.strerror or str(error)
            raise RefusedError(f"{self.uri} is not to be had: {reason}; choose another port with --port") from error
        self._transport = transport
        self._port = transport.get_extra_info("sockname")[1]
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the port back."""
        if self._transport is not None:
            self._transport.close()

    async def serve(self, say: Callable[[str], None]) -> None:
        """Live for ever. say: is told what happens to the vehicle, a line at a time."""
        due_ns, period = self._clock.now_ns(), 0
        while True:
            await self._clock.sleep_until(due_ns)
            now_ns = self._clock.now_ns()
            self._bench.advance_to(now_ns)
            self._send(now_ns)
            for text in self._bench.said():
                say(text)
            if period % POSE_EVERY == 0 and self._publish is not None:
                vehicle = self._bench.vehicle
                self._publish(self._camera.frame(vehicle.body.state, vehicle.state_ns, now_ns))
            passed = 1 + (now_ns - due_ns) // PERIOD_NS
            due_ns += PERIOD_NS * passed
            period += passed

    def _receive(self, datagram: bytes, client: tuple[str | Any, int]) -> None:
        self._client = client
        now_ns = self._clock.now_ns()
        self._bench.receive(datagram, now_ns)
        self._send(now_ns)

    def _send(self, now_ns: int) -> None:
        for datagram in self._bench.outgoing(now_ns):
            if self._client is not None and self._transport is not None:
                self._transport.sendto(datagram, self._client)


class _Receiver(asyncio.DatagramProtocol):
    """Hands datagrams on. Errors are a client that has gone: nothing to be done."""

    def __init__(self, receive: Callable[[bytes, tuple[str | Any, int]], None]) -> None:
        self._receive = receive

    def datagram_received(self, data: bytes, addr: tuple[str | Any, int]) -> None:
        """One datagram."""
        self._receive(data, addr)
