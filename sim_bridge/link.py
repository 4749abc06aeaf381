"""The simulated link, `sim://`: one vehicle on the multirotor model, which publishes its pose as a camera system would.

A task brings the vehicle to now at 100 Hz on absolute deadlines, publishes pose and twist, and takes telemetry. A
setpoint applies from its arrival. A wake-up that comes late goes on by what has really passed, so the vehicle lives in
real time however busy the machine is; in virtual time everything is deterministic.

Fallback, from 100 ms without a fresh setpoint, as on a Crazyflie: level, slightly below hover thrust.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from dataclasses import replace
from types import TracebackType
from typing import Annotated, Self

import msgspec

from lcd_flight.model import AttitudeThrust, InputError, LinkContext, LinkReport, RefusedError, Telemetry
from lcd_flight.wire.uri_options import read_options
from sim_bridge.camera import Camera
from sim_bridge.vehicle import SimulatedVehicle, warm_up

PERIOD_NS = 10_000_000
"""Of pose and telemetry: 100 Hz."""
PHASE_NS = 6_000_000
"""From connecting to the first pose: a camera system does not know of the flight's ticks. Half a period would be the
average; this is the next whole period of the onboard controller, so that poses are published when they are true."""
MAX_AGE_NS = 50_000_000
"""A setpoint older than this is refused."""

_NS_PER_S = 1e9
_NS_PER_MS = 1e6


class SimOptions(msgspec.Struct, frozen=True):
    """Options of `sim://`. Times of faults count from arming; None: the fault does not happen."""

    noise_mm: Annotated[float, msgspec.Meta(ge=0.001, le=1000.0)] = 0.3
    """Standard deviation of the published position, each axis. Never zero: a camera without noise looks frozen."""
    noise_deg: Annotated[float, msgspec.Meta(ge=0.0, le=90.0)] = 0.1
    """Of the published attitude, each axis."""
    twist: bool = True
    """Whether velocity and body rates are published beside the pose."""
    battery_V: Annotated[float, msgspec.Meta(ge=0.0, le=100.0)] | None = None
    """Voltage to start with; None: a full battery."""
    pose_gap_s: Annotated[float, msgspec.Meta(ge=0.0, le=1e6)] | None = None
    """When a gap in the published poses begins."""
    pose_gap_ms: Annotated[float, msgspec.Meta(ge=0.0, le=1e9)] = 200.0
    """How long it lasts."""
    die_s: Annotated[float, msgspec.Meta(ge=0.0, le=1e6)] | None = None
    """When the vehicle loses its power: motors stop and nothing is heard of it any more."""


def open_link(address: str, options: Mapping[str, str], context: LinkContext) -> SimulatedLink:
    """The link behind `sim://?options`; see `SimOptions`.

    Raises:
        InputError: an address, an unknown option, or a vehicle that does not fly thrust and attitude setpoints.
    """
    if address:
        raise InputError(f"sim:// takes no address, but was given {address!r}")
    if context.vehicle.onboard is None:
        raise InputError(f"vehicle {context.vehicle.name} has no onboard controller, which sim:// needs to fly it")
    return SimulatedLink(read_options(SimOptions, options, "sim://"), context)


class SimulatedLink:
    """`lcd_flight.model.Link` to a simulated vehicle."""

    description = "firmware sim-1"

    def __init__(self, options: SimOptions, context: LinkContext) -> None:
        self._options = options
        self._context = context
        self._clock = context.clock
        self._publish = context.publish_pose
        self._camera = Camera(
            context.rigid_body, context.seed, options.noise_mm, options.noise_deg, twist=options.twist
        )
        self._vehicle = SimulatedVehicle(context, options.battery_V)
        self._task: asyncio.Task[None] | None = None
        self._open = False
        self._armed_ns: int | None = None
        self._newest_stamp_ns = 0
        self._telemetry: Telemetry | None = None
        self._sent = self._received = self._stale = 0

    async def __aenter__(self) -> Self:
        """Switch the vehicle on."""
        warm_up(self._context)
        now_ns = self._clock.now_ns()
        self._vehicle.switch_on(now_ns)
        self._open = True
        self._hear(now_ns)
        self._task = asyncio.create_task(self._live(now_ns + PHASE_NS))
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop the motors and switch the vehicle off; an error of the simulation itself comes out here."""
        self.stop_motors()
        self._open = False
        if self._task is not None:
            self._task.cancel()
            (outcome,) = await asyncio.gather(self._task, return_exceptions=True)
            if isinstance(outcome, Exception):
                raise outcome

    async def arm(self) -> None:
        """Make the vehicle take setpoints.

        Raises:
            RefusedError: not connected, or locked after a stop or a crash.
        """
        if not self._open:
            raise RefusedError("the simulated vehicle will not arm: the link is not open")
        self._armed_ns = self._clock.now_ns()
        self._vehicle.arm(self._armed_ns)
        if self._options.die_s is not None:
            self._vehicle.die_at(self._armed_ns + round(self._options.die_s * _NS_PER_S))

    async def disarm(self) -> None:
        """Stop the motors; the vehicle may be armed again."""
        if self._open:
            self._vehicle.disarm(self._clock.now_ns())

    def send(self, setpoint: AttitudeThrust, stamp_ns: int) -> None:
        """Hand over the setpoint of the tick that began at `stamp_ns`; the newest wins, an unfit one is refused."""
        if not self._open:
            return
        now_ns = self._clock.now_ns()
        fresh = now_ns - stamp_ns <= MAX_AGE_NS and stamp_ns >= self._newest_stamp_ns
        if not (fresh and setpoint.is_finite()):
            self._stale += 1
            return
        self._newest_stamp_ns = stamp_ns
        self._sent += 1
        self._vehicle.take(setpoint, now_ns)

    def stop_motors(self) -> None:
        """Emergency stop, latched: later setpoints are ignored and arming is refused."""
        if self._open:
            self._vehicle.lock(self._clock.now_ns(), "its motors were stopped")

    def report(self, now_ns: int) -> LinkReport:
        """What is known now."""
        telemetry = self._telemetry
        if telemetry is not None:
            self._telemetry = replace(telemetry, messages=())
        return LinkReport(
            connected=self._open and self._task is not None and not self._task.done(),
            age_ns=None if telemetry is None else now_ns - telemetry.stamp_ns,
            sent=self._sent,
            received=self._received,
            stale=self._stale,
            fallback_active=self._vehicle.fallback_active,
            telemetry=telemetry,
        )

    async def _live(self, due_ns: int) -> None:
        """Advance, publish and listen for ever; periods that were slept through are skipped."""
        while True:
            await self._clock.sleep_until(due_ns)
            now_ns = self._clock.now_ns()
            self._vehicle.advance_to(now_ns)
            frame = self._camera.frame(self._vehicle.state, self._vehicle.state_ns, now_ns)
            if self._publish is not None and not self._in_pose_gap(now_ns):
                self._publish(frame)
            if self._vehicle.alive:
                self._hear(now_ns)
            due_ns += PERIOD_NS * (1 + (now_ns - due_ns) // PERIOD_NS)

    def _hear(self, now_ns: int) -> None:
        """One packet from the vehicle; text waits until it is reported."""
        new = self._vehicle.telemetry(now_ns)
        waiting = () if self._telemetry is None else self._telemetry.messages
        self._telemetry = replace(new, messages=(*waiting, *new.messages))
        self._received += 1

    def _in_pose_gap(self, now_ns: int) -> bool:
        """Whether frames are being lost on purpose."""
        begins_s = self._options.pose_gap_s
        if begins_s is None or self._armed_ns is None:
            return False
        since_ns = now_ns - self._armed_ns - begins_s * _NS_PER_S
        return 0.0 <= since_ns < self._options.pose_gap_ms * _NS_PER_MS
