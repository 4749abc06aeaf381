"""The MAVLink link and a simulated vehicle in virtual time: bytes between them in memory, motion capture beside them."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass, field, replace

from drivers.mavlink import options
from drivers.mavlink.link import MavlinkLink
from drivers.mavlink.transport import Peer, Receiver
from lcd_flight import plugins
from lcd_flight.flight import virtual_time
from lcd_flight.flight.virtual_time import VirtualClock
from lcd_flight.model import AttitudeThrust, LinkContext, LinkReport, PoseSource, Quaternion, RawPose, Vector3, Vehicle
from lcd_flight.model.frames import from_yaw
from lcd_flight.worlds import load_vehicle
from sim_bridge.camera import Camera
from sim_bridge.mavlink.options import MavlinkOptions as VehicleOptions
from sim_bridge.mavlink.vehicle import SimulatedMavlink

MS = 1_000_000
CLOCK = VirtualClock()
VEHICLE: Vehicle = load_vehicle("hummingbird")
START_M: Vector3 = (0.5, -0.3, 0.0)
START_YAW_RAD = 0.4
STEP_NS = 2 * MS
FRAME_STEPS = 5
PEER: Peer = ("127.0.0.1", 14580)

Tampers = Callable[[bytes, bool, int], "list[bytes]"]
"""What becomes of a datagram: itself, nothing, several; True for the way up, to the vehicle; at a time."""
_names = itertools.count()


def _as_it_is(data: bytes, _up: bool, _now_ns: int) -> list[bytes]:
    return [data]


@dataclass
class Air:
    """`drivers.mavlink.transport.Transport` in memory, with the vehicle at its other end."""

    vehicle: SimulatedMavlink
    stream: bool = False
    faults: int = 0
    tampers: Tampers = _as_it_is
    ups: list[tuple[int, bytes]] = field(default_factory=list)
    """Every datagram that was sent to the vehicle, and when."""
    peer: Peer = PEER
    receive: Receiver | None = None

    async def open(self, receive: Receiver) -> None:
        self.receive = receive

    def send(self, data: bytes, _peer: Peer | None, /) -> bool:
        if self.receive is None:
            return False
        now_ns = CLOCK.now_ns()
        self.ups.append((now_ns, data))
        for arriving in self.tampers(data, True, now_ns):
            self.vehicle.receive(arriving, now_ns)
        return True

    def close(self) -> None:
        self.receive = None

    def deliver(self, data: bytes, peer: Peer | None = None) -> None:
        """Let the link hear something."""
        if self.receive is not None:
            self.receive(data, peer or self.peer)

    def step(self, now_ns: int) -> None:
        """Let the vehicle live, and the link hear it."""
        self.vehicle.advance_to(now_ns)
        for data in self.vehicle.outgoing():
            for arriving in self.tampers(data, False, now_ns):
                self.deliver(arriving)


@dataclass
class Bench:
    """What a test works with."""

    air: Air
    pose: PoseSource
    context: LinkContext
    flavour: str
    shows: bool = True
    """Whether motion capture publishes."""
    seen: RawPose | None = None

    @property
    def vehicle(self) -> SimulatedMavlink:
        return self.air.vehicle

    @property
    def p_WB(self) -> Vector3:
        """Where it truly is."""
        return self.vehicle.body.state.p_WB

    @property
    def mode(self) -> int:
        """Of the autopilot."""
        return self.vehicle.firmware.pilot.mode

    @property
    def armed(self) -> bool:
        return self.vehicle.firmware.pilot.armed

    def link(self, given: str = "", **changes: object) -> MavlinkLink:
        """The link to it; `given` as in a URI."""
        pairs = dict(pair.split("=", 1) for pair in given.split("&") if pair)
        chosen = options.read("mavlink+udp", "127.0.0.1:14540", {"autopilot": self.flavour, **pairs})
        return MavlinkLink("mavlink+udp://127.0.0.1:14540", chosen, replace(self.context, **changes), self.air)


@contextlib.asynccontextmanager
async def bench(flavour: str = "px4", *, tampers: Tampers = _as_it_is, **given: object) -> AsyncIterator[Bench]:
    """A vehicle that was switched on a minute ago; options as the simulated vehicle has them."""
    wanted = VehicleOptions(**{"flavour": flavour, "boot_s": 0.0, **given})  # type: ignore[arg-type]
    vehicle = SimulatedMavlink(VEHICLE, wanted, position_m=START_M, yaw_rad=START_YAW_RAD, seed=3)
    vehicle.switch_on(CLOCK.now_ns())
    air = Air(vehicle, tampers=tampers)
    endpoint = f"loopback://mavlink-{next(_names)}"
    publisher = plugins.pose_publisher(endpoint)
    camera = Camera("body", 3, 0.3, 0.1, twist=False)
    try:
        async with plugins.pose_source(endpoint, "body", CLOCK) as pose:
            context = LinkContext(VEHICLE, CLOCK, START_M, START_YAW_RAD, seed=3, listen_poses=pose.listen)
            made = Bench(air, pose, context, flavour)

            async def live() -> None:
                for step in itertools.count():
                    now_ns = CLOCK.now_ns()
                    air.step(now_ns)
                    if step % FRAME_STEPS == 0 and made.shows:
                        publisher(camera.frame(vehicle.body.state, now_ns, now_ns))
                    await CLOCK.sleep_until(now_ns + STEP_NS)

            living = asyncio.create_task(live())
            try:
                yield made
            finally:
                if living.done():
                    living.result()  # raises what ended it
                living.cancel()
                await asyncio.gather(living, return_exceptions=True)
    finally:
        publisher.close()


def run(main: Callable[[], Awaitable[None]]) -> None:
    """Run a test in virtual time."""

    async def whole() -> None:
        await main()
        assert asyncio.all_tasks() == {asyncio.current_task()}, "a task was left"

    virtual_time.run(whole())


async def wait_s(seconds: float) -> None:
    await CLOCK.sleep_until(CLOCK.now_ns() + round(seconds * 1e9))


def level(share_of_weight: float, yaw_rad: float = START_YAW_RAD) -> AttitudeThrust:
    return AttitudeThrust(share_of_weight * VEHICLE.weight_N, from_yaw(yaw_rad))


def tilted(q_WB: Quaternion, share_of_weight: float = 1.0) -> AttitudeThrust:
    return AttitudeThrust(share_of_weight * VEHICLE.weight_N, q_WB)


async def stream(link: MavlinkLink, setpoint: AttitudeThrust, seconds: float) -> LinkReport:
    """What a healthy loop does: asks for a report and sends a setpoint every 10 ms; returns the last report."""
    for _ in range(round(seconds * 100)):
        report = link.report(CLOCK.now_ns())
        link.send(setpoint, CLOCK.now_ns())
        await wait_s(0.01)
    return report
