"""Ports: what the house asks of its plug-ins. They come by entry point (`lcd_flight.plugins`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Protocol, Self

from lcd_flight.model.rollout import RolloutLabels
from lcd_flight.model.state import AttitudeThrust, Reference, State
from lcd_flight.model.telemetry import LinkReport, PoseReport, RawPose
from lcd_flight.model.tick import Tick, TickInputs
from lcd_flight.model.trajectory import Trajectories
from lcd_flight.model.types import FloatArray, LinkLossPolicy, Loop, MocapAxes, SeedArray, Vector3
from lcd_flight.model.vehicle import Vehicle


class Clock(Protocol):
    """Monotonic nanoseconds, real or virtual."""

    def now_ns(self) -> int:
        """The time now."""
        ...

    async def sleep_until(self, deadline_ns: int) -> None:
        """Return at the deadline, or at once where it has passed."""
        ...


PoseListener = Callable[[RawPose], None]
"""Who is told of every accepted frame as it arrives, in the event loop."""


@dataclass(frozen=True, slots=True)
class LinkContext:
    """What a link is given besides its URI."""

    vehicle: Vehicle
    clock: Clock
    initial_position_m: Vector3
    initial_yaw_rad: float
    seed: int
    publish_pose: Callable[[bytes], None] | None = None
    """Where a simulated vehicle publishes its pose, as mocap frames (`lcd_flight.wire.mocap_frame`)."""
    rigid_body: str = "vehicle"
    """The name under which it does."""
    listen_poses: Callable[[PoseListener], None] | None = None
    """`PoseSource.listen` of the flight's motion capture, for links that tell their vehicle where it is; None: there
    is no motion capture."""
    on_link_lost: LinkLossPolicy = "vehicle"
    """What the vehicle is to do by itself once it hears nothing any more; set before take-off."""


class Link(Protocol):
    """The way to one vehicle. Connecting is `async with`; send never blocks; the freshest setpoint wins.

    A setpoint older than 50 ms is never sent; from 100 ms without a fresh one the link's stated fallback acts.
    """

    async def __aenter__(self) -> Self:
        """Connect.

        Raises:
            RefusedError: no connection, with the reason and the remedy.
        """
        ...

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop the motors, close; also after an exception."""
        ...

    @property
    def description(self) -> str:
        """What is at the other end, e.g. `firmware sim-1`."""
        ...

    async def arm(self) -> None:
        """Make the vehicle ready to spin its motors.

        Raises:
            RefusedError: the vehicle will not, with its reason.
        """
        ...

    async def disarm(self) -> None:
        """Take readiness away on the ground."""
        ...

    def send(self, setpoint: AttitudeThrust, stamp_ns: int) -> None:
        """Hand over the setpoint of the tick that began at `stamp_ns`."""
        ...

    def stop_motors(self) -> None:
        """Emergency stop, at once; later setpoints are ignored."""
        ...

    def report(self, now_ns: int) -> LinkReport:
        """What is known now."""
        ...


@dataclass(frozen=True, slots=True)
class Inspection:
    """What was found at the other end of a link, without changing anything there."""

    description: str
    facts: tuple[tuple[str, str], ...]
    """What, and how it is, for a person."""
    differences: tuple[str, ...] = ()
    """What flying would change first."""
    problems: tuple[str, ...] = ()
    """What speaks against flying, with the remedy."""


class PoseSource(Protocol):
    """Filtered pose of one rigid body."""

    async def __aenter__(self) -> Self:
        """Start listening.

        Raises:
            RefusedError: the endpoint is not to be had.
        """
        ...

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop listening."""
        ...

    def report(self, now_ns: int) -> PoseReport:
        """Drain what has arrived, and the filtered pose brought forward to `now_ns`."""
        ...

    def listen(self, listener: PoseListener) -> None:
        """Tell `listener` of every accepted frame from now on, as it arrives."""
        ...


@dataclass(frozen=True, slots=True)
class PoseOptions:
    """How a pose source is to be read."""

    axes: MocapAxes = "enu"
    """What the mission says of the source's axes; frames that say otherwise are rejected."""
    use_source_twist: bool = True
    """Whether the source's own twist, where it sends one, is measured beside its pose."""
    max_speed_m_s: float = 10.0
    """A pose further off than this speed allows is a jump."""
    coast_s: float = 0.1
    """How long the filter goes on without a frame."""
    position_noise_m: float = 1e-3
    """Standard deviation of the source's position, each axis."""
    attitude_noise_rad: float = 0.0087
    """Standard deviation of the source's attitude, each axis (0.5 deg)."""


class PosePublisher(Protocol):
    """Where mocap frames (`lcd_flight.wire.mocap_frame`) go out. Never blocks."""

    def __call__(self, data: bytes) -> None:
        """Publish one encoded frame."""
        ...

    def close(self) -> None:
        """Give the endpoint back."""
        ...


class ControlLaw(Protocol):
    """From state and reference to a setpoint; the integral (m/s^2, world) goes in and comes out. Pure."""

    def __call__(
        self, state: State, reference: Reference, vehicle: Vehicle, integral: Vector3, dt_s: float
    ) -> tuple[AttitudeThrust, Vector3]:
        """One control step; a result that is not finite, or an arithmetic error, counts as none."""
        ...


class Observer(Protocol):
    """Who listens to the flight. Bounded and never blocking."""

    def observe(self, inputs: TickInputs, tick: Tick) -> None:
        """Take note of one tick."""
        ...

    def close(self) -> None:
        """The flight is over: keep what is held."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class RolloutOptions:
    """How a batch is flown, beside vehicle and plans."""

    loop: Loop = "paper"
    controller: str = "geometric"
    nominal: Vehicle | None = None
    """What the controller believes it flies; None: the vehicle itself."""
    start_aligned: bool = True
    """Whether it starts with the yaw of the first waypoint (else yaw 0)."""
    pose_gap_ticks: FloatArray | None = None
    """(N, 2) first tick and length of a gap in the pose, which the controller bridges by coasting; None: no gaps."""
    threads: int = 0
    """0: all cores."""


class Simulator(Protocol):
    """Batched closed-loop rollouts: the same function for data, polish, evaluation and rehearsal."""

    def rollout(
        self, plans: Trajectories, vehicle: Vehicle, seeds: SeedArray, options: RolloutOptions
    ) -> RolloutLabels:
        """Fly every plan once: plans (N), seeds (N,). The result depends on each row's inputs alone."""
        ...
