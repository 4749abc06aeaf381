"""The MAVLink link and a simulated vehicle in virtual time: bytes in memory, motion capture beside them."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass, field, replace

import short_mission
from short_mission import Listener

from drivers.mavlink import options
from drivers.mavlink.link import MavlinkLink
from drivers.mavlink.peer import Peer, Receiver
from lcd_flight import plugins
from lcd_flight.flight import virtual_time
from lcd_flight.flight.loop import FlightLoop
from lcd_flight.flight.operator import Operator
from lcd_flight.flight.result import Story
from lcd_flight.flight.session import FlightOptions, _flown
from lcd_flight.flight.virtual_time import VirtualClock
from lcd_flight.model import (
    AttitudeThrust,
    LinkContext,
    LinkReport,
    Outcome,
    PoseSource,
    State,
    Tick,
    TickInputs,
    Vector3,
    Vehicle,
)
from lcd_flight.model.frames import from_yaw, multiply, rotate
from lcd_flight.wire.mocap_frame import MocapFrame, decode
from sim_bridge.camera import Camera
from sim_bridge.mavlink.options import MavlinkOptions as VehicleOptions
from sim_bridge.mavlink.vehicle import SimulatedMavlink

MS = 1_000_000
CLOCK = VirtualClock()
VEHICLE: Vehicle = short_mission.vehicle()
STEP_NS = 2 * MS
FRAME_STEPS = 5
AGES_S = {"px4": 6.0, "ardupilot": 26.0}
"""How long a vehicle has been on: by then its sensors have settled."""
PEER: Peer = ("127.0.0.1", 14580)

Tampers = Callable[[bytes, bool, int], "list[bytes]"]
"""What becomes of a datagram: itself, nothing, several; True for the way up, to the vehicle; and when."""
_names = itertools.count()


def as_it_is(data: bytes, _up: bool, _now_ns: int) -> list[bytes]:
    return [data]


def kind_of(data: bytes) -> int:
    """Message id of a MAVLink 2 packet."""
    return int.from_bytes(data[7:10], "little")


@dataclass
class Air:
    """`drivers.mavlink.transport.Transport` in memory, with the vehicle at its other end."""

    vehicle: SimulatedMavlink
    stream: bool = False
    faults: int = 0
    called: str | None = None
    tampers: Tampers = as_it_is
    ups: list[tuple[int, bytes]] = field(default_factory=list)
    """Every datagram that was sent to the vehicle, and when."""
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

    def send_now(self, data: bytes, peer: Peer | None, /) -> bool:
        return self.send(data, peer)

    def close(self) -> None:
        self.receive = None

    def deliver(self, data: bytes, peer: Peer = PEER) -> None:
        """Let the link hear something."""
        if self.receive is not None:
            self.receive(data, peer)

    def step(self, now_ns: int) -> None:
        """Let the vehicle live, and the link hear it."""
        self.vehicle.advance_to(now_ns)
        for data in self.vehicle.outgoing():
            for arriving in self.tampers(data, False, now_ns):
                self.deliver(arriving)

    def sent(self, kind: int, since_ns: int = 0) -> list[tuple[int, bytes]]:
        """What the link sent of one kind of message."""
        return [(at_ns, data) for at_ns, data in self.ups if kind_of(data) == kind and at_ns >= since_ns]


@dataclass
class Bench:
    """What a test works with."""

    air: Air
    pose: PoseSource
    context: LinkContext
    flavour: str
    mocap_yaw_rad: float
    shows: bool = True
    """Whether motion capture publishes."""

    @property
    def vehicle(self) -> SimulatedMavlink:
        return self.air.vehicle

    @property
    def state(self) -> State:
        """Where it truly is, in motion capture's frame."""
        true, turn = self.vehicle.body.state, from_yaw(-self.mocap_yaw_rad)
        return replace(
            true,
            p_WB=rotate(turn, true.p_WB),
            v_WB_W=rotate(turn, true.v_WB_W),
            q_WB=multiply(turn, true.q_WB),
        )

    @property
    def height_m(self) -> float:
        return self.vehicle.body.state.p_WB[2]

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
        context = replace(self.context, **changes)  # type: ignore[arg-type]
        return MavlinkLink("mavlink+udp://127.0.0.1:14540", chosen, context, self.air)


@contextlib.asynccontextmanager
async def bench(
    flavour: str = "px4",
    *,
    tampers: Tampers = as_it_is,
    key: bytes | None = None,
    mocap_yaw_rad: float = 0.0,
    start_m: Vector3 = (0.0, 0.0, 0.0),
    yaw_rad: float = 0.0,
    age_s: float | None = None,
    airframe: Vehicle = VEHICLE,
    published: list[MocapFrame] | None = None,
    **given: object,
) -> AsyncIterator[Bench]:
    """A vehicle that was switched on a while ago; other options as the simulated vehicle has them.

    start_m, yaw_rad: in the true world, from which motion capture's is turned by `mocap_yaw_rad`. published: every
    frame is added to it.
    """
    wanted = VehicleOptions(**{"flavour": flavour, **given})  # type: ignore[arg-type]
    vehicle = SimulatedMavlink(airframe, wanted, position_m=start_m, yaw_rad=yaw_rad, seed=3, key=key)
    vehicle.switch_on(CLOCK.now_ns())
    air = Air(vehicle, tampers=tampers)
    endpoint = f"loopback://mavlink-{next(_names)}"
    publisher = plugins.pose_publisher(endpoint)
    camera = Camera("body", 3, 0.3, 0.1, twist=False)
    try:
        async with plugins.pose_source(endpoint, "body", CLOCK) as pose:
            context = LinkContext(airframe, CLOCK, start_m, yaw_rad, seed=3, listen_poses=pose.listen)
            made = Bench(air, pose, context, flavour, mocap_yaw_rad)
            await wait_s(AGES_S[flavour] if age_s is None else age_s)

            async def live() -> None:
                for step in itertools.count():
                    now_ns = CLOCK.now_ns()
                    air.step(now_ns)
                    if step % FRAME_STEPS == 0 and made.shows:
                        data = camera.frame(made.state, now_ns, now_ns)
                        publisher(data)
                        if published is not None:
                            published.append(decode(data))
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


def level(share_of_weight: float, yaw_rad: float = 0.0) -> AttitudeThrust:
    return AttitudeThrust(share_of_weight * VEHICLE.weight_N, from_yaw(yaw_rad))


async def stream(link: MavlinkLink, setpoint: AttitudeThrust, seconds: float) -> LinkReport:
    """What a healthy loop does: asks for a report and sends a setpoint every 10 ms; returns the last report."""
    for _ in range(round(seconds * 100)):
        report = link.report(CLOCK.now_ns())
        link.send(setpoint, CLOCK.now_ns())
        await wait_s(0.01)
    return report


@dataclass
class Flown:
    """How a flight went."""

    outcome: Outcome
    reason: str
    listener: Listener
    notes: tuple[str, ...] = ()

    @property
    def told(self) -> str:
        """All that the vehicle and its link said."""
        reports = (inputs.link.telemetry for inputs, _ in self.listener.flight)
        return "\n".join(text for telemetry in reports if telemetry is not None for text in telemetry.messages)

    def first(self, code: str) -> TickInputs:
        """The inputs of the tick that had a finding first."""
        return next(i for i, t in self.listener.flight if any(f.code == code for f in t.findings))


async def flight(
    made: Bench,
    given: str = "",
    act: Callable[[TickInputs, Tick], None] = lambda _inputs, _tick: None,
    operator: Operator | None = None,
) -> Flown:
    """The short mission, flown as a session does; `act` may do something at each tick."""
    operator = operator or Operator()
    setup, story, listener = short_mission.setup(), Story(), Listener(act)
    async with made.link(given) as link:
        loop = FlightLoop(setup, CLOCK, link, made.pose, operator, [story, listener])
        direction = await _flown(loop, link, CLOCK, setup, FlightOptions(operator=operator), None)
    notes = tuple(loop.notes)
    return Flown(direction.outcome or story.outcome, direction.reason or story.reason, listener, notes)
