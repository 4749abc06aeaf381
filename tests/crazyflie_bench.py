"""A simulated Crazyflie on UDP in this event loop, its motion capture, and a path to it that loses what it should."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import threading
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import cast

from drivers.crazyflie import estimator
from lcd_flight import plugins
from lcd_flight.flight.clock import RealClock
from lcd_flight.flight.realtime import prioritised
from lcd_flight.model import AttitudeThrust, Link, LinkContext, LinkReport, PoseSource, Vehicle
from lcd_flight.model.frames import from_yaw
from lcd_flight.plugins.entry_points import load
from lcd_flight.wire.mocap_frame import MocapFrame, decode
from lcd_flight.worlds import load_vehicle

CLOCK = RealClock()
VEHICLE: Vehicle = load_vehicle("crazyflie-2.1")
START_M = (1.0, -2.0, 0.0)
START_YAW_RAD = 0.5

Loses = Callable[[bytes, bool], bool]
"""Whether a datagram is lost; True for the way up, to the vehicle."""

_names = itertools.count()


class Path(asyncio.DatagramProtocol):
    """Passes datagrams on between one client and the vehicle, except those that are lost."""

    def __init__(self, vehicle: tuple[str, int], loses: Loses) -> None:
        self.loses = loses
        self.seen: list[tuple[bytes, bool]] = []
        """Every datagram that was sent, and whether upwards."""
        self._vehicle = vehicle
        self._client: tuple[str, int] | None = None
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.DatagramTransport, transport)

    def datagram_received(self, data: bytes, address: tuple[str, int]) -> None:
        up = address != self._vehicle
        if up:
            self._client = address
        self.seen.append((data, up))
        to = self._vehicle if up else self._client
        if to is not None and self._transport is not None and not self.loses(data, up):
            self._transport.sendto(data, to)

    def sent_up(self, header: int) -> list[bytes]:
        """What the client sent with a header."""
        return [data for data, up in self.seen if up and data[0] == header]

    @property
    def uri(self) -> str:
        """Where the client finds it."""
        assert self._transport is not None
        host, port = self._transport.get_extra_info("sockname")[:2]
        return f"udp://{host}:{port}"


@dataclass
class Bench:
    """What a test works with."""

    path: Path
    pose: PoseSource
    context: LinkContext
    frames: list[MocapFrame]
    """Every pose that was published."""
    story: list[str]
    """What the simulated vehicle tells of itself."""
    stop_serving: Callable[[], None]
    """The vehicle's process dies: nothing is answered, no pose published."""
    threads: set[threading.Thread] = field(default_factory=lambda: set(threading.enumerate()))

    def link(self, options: str = "", **changes: object) -> Link:
        """The link to it."""
        return plugins.open_link(self.path.uri + options, replace(self.context, **changes))

    def left_over(self) -> set[threading.Thread]:
        """Threads that were not there at first; the executors of the event loop do not count."""
        new = set(threading.enumerate()) - self.threads
        return {thread for thread in new if not thread.name.startswith("asyncio_")}


@contextlib.contextmanager
def hurried() -> Iterator[None]:
    """An estimate that has been right for a moment will do: connecting takes half as long."""
    before = estimator.SETTLED_NS, estimator.RESET_S
    estimator.SETTLED_NS, estimator.RESET_S = 50_000_000, 0.02
    try:
        yield
    finally:
        estimator.SETTLED_NS, estimator.RESET_S = before


@contextlib.asynccontextmanager
async def bench(loses: Loses | None = None, **options: object) -> AsyncIterator[Bench]:
    """A vehicle that has been switched on; options as the simulated Crazyflie has them."""
    # Two sides of a radio in one process: a machine that stops them both for half a second has not lost a link.
    with hurried(), prioritised():
        async with _bench(loses, options) as made:
            yield made


@contextlib.asynccontextmanager
async def _bench(loses: Loses | None, options: Mapping[str, object]) -> AsyncIterator[Bench]:
    frames: list[MocapFrame] = []
    story: list[str] = []
    endpoint = f"loopback://crazyflie-{next(_names)}"
    publisher = plugins.pose_publisher(endpoint)

    def publish(data: bytes) -> None:
        frames.append(decode(data))
        publisher(data)

    context = LinkContext(VEHICLE, CLOCK, START_M, START_YAW_RAD, seed=3, publish_pose=publish, rigid_body="cf1")
    given: Mapping[str, str] = {name: str(value) for name, value in options.items()}
    server = load("vehicle_servers", "crazyflie", "simulated vehicle")("127.0.0.1:0", given, context)
    loop = asyncio.get_running_loop()
    try:
        async with server, plugins.pose_source(endpoint, "cf1", CLOCK) as pose:
            serving = asyncio.create_task(server.serve(story.append))
            host, _, port = server.uri.removeprefix("udp://").rpartition(":")
            transport, path = await loop.create_datagram_endpoint(
                lambda: Path((host, int(port)), loses or (lambda _data, _up: False)), local_addr=("127.0.0.1", 0)
            )

            def stop_serving() -> None:
                serving.cancel()
                path.loses = lambda _data, _up: True

            try:
                yield Bench(path, pose, replace(context, listen_poses=pose.listen), frames, story, stop_serving)
            finally:
                serving.cancel()
                transport.close()
                await asyncio.gather(serving, return_exceptions=True)
    finally:
        publisher.close()


async def wait_ms(milliseconds: float) -> None:
    """Let real time pass."""
    await CLOCK.sleep_until(CLOCK.now_ns() + round(milliseconds * 1e6))


def level(share_of_weight: float) -> AttitudeThrust:
    """Level, at the heading it stands with."""
    return AttitudeThrust(share_of_weight * VEHICLE.weight_N, from_yaw(START_YAW_RAD))


async def stream(link: Link, setpoint: AttitudeThrust, seconds: float) -> LinkReport:
    """What a healthy loop does: asks for a report and sends a setpoint every 10 ms; returns the last report."""
    for _ in range(round(seconds * 100)):
        report = link.report(CLOCK.now_ns())
        link.send(setpoint, CLOCK.now_ns())
        await wait_ms(10)
    return report
