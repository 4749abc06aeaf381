"""A bench for the tick: a point mass that does what it is told, healthy inputs, and a place to put faults in."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from lcd_flight.flight.memory import Memory
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.flight.tick import tick
from lcd_flight.model import (
    GRAVITY_M_PER_S2,
    AttitudeThrust,
    Command,
    FlightPlan,
    Geofence,
    Leg,
    LegKind,
    LinkReport,
    Phase,
    PoseReport,
    RawPose,
    SafetyLimits,
    State,
    Telemetry,
    Tick,
    TickInputs,
    Trajectory,
    Vector3,
)
from lcd_flight.model.frames import IDENTITY, body_z_axis
from lcd_flight.planning.minimum_snap import minimum_snap
from lcd_flight.worlds import load_vehicle

TICK_NS = 10_000_000
START_NS = 3_000_000_000
WAYPOINTS = np.array([[0.0, 0.0, 1.0, 0.0], [1.0, 0.5, 1.2, 0.3], [0.5, 1.0, 0.9, 0.6]])
LIMITS = SafetyLimits(geofence=Geofence((-2.0, -2.0, 0.0), (3.0, 3.0, 3.0)))
ORDERS: Mapping[int, tuple[Command, ...]] = {
    0: (Command.CHECK,),
    1: (Command.CHECKED,),
    2: (Command.ARM,),
    3: (Command.TAKEOFF,),
}
TAKEOFF_TICK = 3

Fault = Callable[[int, TickInputs], TickInputs]
Flight = list[tuple[TickInputs, Tick]]


def straight(a: Sequence[float], b: Sequence[float], duration_s: float) -> Trajectory:
    """Rest to rest; x, y, z, yaw."""
    return minimum_snap(np.array([a, b], dtype=float), np.array([duration_s]))


def plan() -> FlightPlan:
    """Up, wait, three waypoints, down: 9 s."""
    first, last = WAYPOINTS[0], WAYPOINTS[-1]
    ground = last * (1.0, 1.0, 0.0, 1.0)
    return FlightPlan(
        (
            Leg(LegKind.TAKEOFF, straight([0.0, 0.0, 0.0, 0.0], first.tolist(), 2.0)),
            Leg(LegKind.HOLD, Trajectory.hover(first[:3].tolist(), 0.0, 0.5)),
            Leg(LegKind.TRANSFER, Trajectory.hover(first[:3].tolist(), 0.0, 1.0), settle=True),
            Leg(LegKind.TRAJECTORY, minimum_snap(WAYPOINTS, np.array([1.5, 1.5])), waypoints=WAYPOINTS),
            Leg(LegKind.TRANSFER, Trajectory.hover(last[:3].tolist(), float(last[3]), 0.5), settle=True),
            Leg(LegKind.LAND, straight(last.tolist(), ground.tolist(), 2.0)),
        )
    )


@cache
def setup() -> FlightSetup:
    """The plan, a Crazyflie, the default limits."""
    return FlightSetup.of(plan(), load_vehicle("crazyflie"), LIMITS)


def healthy(sequence: int, state: State, now_ns: int, commands: tuple[Command, ...] = ()) -> TickInputs:
    """What a tick is given when nothing is wrong."""
    raw = RawPose(sequence, now_ns - 5_000_000, now_ns - 3_000_000, state.p_WB, state.q_WB)
    return TickInputs(
        sequence=sequence,
        now_ns=now_ns,
        deadline_ns=now_ns,
        missed=0,
        pose=PoseReport(state=state, age_ns=3_000_000, raw=raw, rate_hz=100.0, received=sequence + 200),
        link=LinkReport(
            connected=True,
            age_ns=4_000_000,
            telemetry=Telemetry(stamp_ns=now_ns, battery_V=4.0, armed=True, crashed=False, motor_shares=(0.5,) * 4),
        ),
        commands=commands,
    )


def without_pose(inputs: TickInputs, gap_ns: int) -> TickInputs:
    """The same inputs, `gap_ns` after the newest frame."""
    return replace(inputs, pose=replace(inputs.pose, state=None, age_ns=3_000_000 + gap_ns))


def with_link(inputs: TickInputs, **changes: object) -> TickInputs:
    """The same inputs with another link report."""
    return replace(inputs, link=replace(inputs.link, **changes))


def with_telemetry(inputs: TickInputs, **changes: object) -> TickInputs:
    """The same inputs with other telemetry."""
    assert inputs.link.telemetry is not None
    return with_link(inputs, telemetry=replace(inputs.link.telemetry, **changes))


@dataclass
class PointMass:
    """Attitude and thrust as told, at once; the ground is at z = 0."""

    mass_kg: float
    p_W: Vector3 = (0.0, 0.0, 0.0)
    v_W: Vector3 = (0.0, 0.0, 0.0)

    @property
    def state(self) -> State:
        """Level: where the thrust points does not matter to the tests."""
        return State(self.p_W, self.v_W, IDENTITY, (0.0, 0.0, 0.0))

    def advance(self, setpoint: AttitudeThrust | None) -> None:
        """One tick further."""
        specific = 0.0 if setpoint is None else setpoint.thrust_N / self.mass_kg
        axis = (0.0, 0.0, 1.0) if setpoint is None else body_z_axis(setpoint.q_WB)
        a_W = [specific * component for component in axis]
        a_W[2] -= GRAVITY_M_PER_S2
        v_W = [v + a * 0.01 for v, a in zip(self.v_W, a_W, strict=True)]
        p_W = [p + v * 0.01 for p, v in zip(self.p_W, v_W, strict=True)]
        if p_W[2] <= 0.0:
            p_W[2], v_W = 0.0, [0.0, 0.0, max(v_W[2], 0.0)]
        self.p_W, self.v_W = (p_W[0], p_W[1], p_W[2]), (v_W[0], v_W[1], v_W[2])


def fly(
    flown: FlightSetup | None = None,
    fault: Fault = lambda _tick, inputs: inputs,
    orders: Mapping[int, tuple[Command, ...]] | None = None,
    ticks: int = 3000,
    linger: int = 5,
    mass_share: float = 1.0,
) -> Flight:
    """Fly until it is over and `linger` ticks more. Faults and orders are given ticks since take-off.

    mass_share: real mass over the mass that is believed.
    """
    flown = flown or setup()
    vehicle, memory, flight = PointMass(mass_share * flown.vehicle.mass_kg), Memory(), Flight()
    for sequence in range(ticks):
        after = sequence - TAKEOFF_TICK
        commands = (*ORDERS.get(sequence, ()), *(orders or {}).get(after, ()))
        inputs = healthy(sequence, vehicle.state, START_NS + sequence * TICK_NS, commands)
        inputs = fault(after, inputs) if after > 0 else inputs
        decided, memory = tick(inputs, flown, memory)
        flight.append((inputs, decided))
        vehicle.advance(decided.setpoint)
        if decided.phase.over:
            linger -= 1
            if linger < 0:
                break
    return flight


def phases(flight: Flight) -> list[Phase]:
    """The phases in order, each once for as long as it lasts."""
    found: list[Phase] = []
    for _, decided in flight:
        if not found or found[-1] is not decided.phase:
            found.append(decided.phase)
    return found


def first(flight: Flight, phase: Phase) -> int:
    """Ticks since take-off at which a phase begins."""
    return next(i for i, (_, decided) in enumerate(flight) if decided.phase is phase) - TAKEOFF_TICK


def codes(flight: Flight) -> set[str]:
    """Of all findings."""
    return {finding.code for _, decided in flight for finding in decided.findings}


def height_m(inputs: TickInputs) -> float:
    """Of the vehicle; NaN without pose."""
    return math.nan if inputs.pose.state is None else inputs.pose.state.p_WB[2]
