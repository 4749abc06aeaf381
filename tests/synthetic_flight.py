"""A made-up flight with known answers: every tick lies a stated distance beside its reference."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

import numpy as np

from lcd_flight.model import (
    GRAVITY_M_PER_S2,
    AttitudeThrust,
    Finding,
    FlightPlan,
    Geofence,
    Leg,
    LegKind,
    LinkReport,
    MotorRequest,
    Phase,
    PoseReport,
    RawPose,
    Reference,
    SafetyLimits,
    State,
    Telemetry,
    Tick,
    TickInputs,
    Trajectory,
)
from lcd_flight.model.frames import from_yaw, multiply, normalized
from lcd_flight.model.types import Quaternion, Vector3
from lcd_flight.record import FlightHeader, FlightLog, Prediction
from lcd_flight.record.flight_log import findings_of, series_of
from lcd_flight.worlds import load_vehicle

TICK_NS = 10_000_000
START_NS = 5_000_000_000_000
"""A host that has been up for 5,000 s."""

SOURCE_BEHIND_NS = 4_000_000_000_000
"""How much younger the clock of the pose source is."""

WAYPOINTS = np.array([[0.0, 0.0, 1.0, 0.0], [1.5, 0.5, 1.2, 0.4], [2.5, 2.0, 1.8, 1.5], [1.0, 2.5, 1.0, 2.2]])
SEGMENT_S = 1.5

PREDICTION = Prediction(
    leg=2,
    method="learned",
    relative_snap=1.7,
    cost=-1.2,
    minimum_snap_cost=-0.4,
    segment_errors_m=(0.08, 0.15, 0.09),
    minimum_snap_segment_errors_m=(0.1, 0.6, 0.3),
)

Pair = tuple[TickInputs, Tick]

_PHASES = {
    LegKind.TAKEOFF: Phase.TAKEOFF,
    LegKind.HOLD: Phase.HOLD,
    LegKind.TRAJECTORY: Phase.TRACK,
    LegKind.TRANSFER: Phase.TRACK,
    LegKind.LAND: Phase.LAND,
}


def rest_to_rest(points: Sequence[Sequence[float]], durations_s: Sequence[float]) -> Trajectory:
    """From point to point (x, y, z, yaw), at rest at each."""
    coefficients = np.zeros((4, len(durations_s), 8))
    for segment, duration_s in enumerate(durations_s):
        begin, end = np.array(points[segment]), np.array(points[segment + 1])
        coefficients[:, segment, 0] = begin
        for power, factor in ((4, 35.0), (5, -84.0), (6, 70.0), (7, -20.0)):
            coefficients[:, segment, power] = factor * (end - begin) / duration_s**power
    return Trajectory(np.array(durations_s, dtype=float), coefficients)


@cache
def plan() -> FlightPlan:
    """Up, hold, four waypoints, down."""
    above_end = WAYPOINTS[-1]
    slower = [1.6 * SEGMENT_S, 0.9 * SEGMENT_S, 0.5 * SEGMENT_S]
    trajectory = Leg(
        LegKind.TRAJECTORY,
        rest_to_rest(WAYPOINTS.tolist(), [SEGMENT_S] * 3),
        waypoints=WAYPOINTS,
        settle=True,
        baseline=rest_to_rest(WAYPOINTS.tolist(), slower),
    )
    return FlightPlan(
        (
            Leg(LegKind.TAKEOFF, rest_to_rest([[0.0, 0.0, 0.0, 0.0], WAYPOINTS[0].tolist()], [2.0])),
            Leg(LegKind.HOLD, Trajectory.hover([0.0, 0.0, 1.0], 0.0, 1.0)),
            trajectory,
            Leg(LegKind.LAND, rest_to_rest([above_end.tolist(), [*above_end[:2], 0.0, above_end[3]]], [2.0])),
        )
    )


def header(**changes: object) -> FlightHeader:
    """The flight's description."""
    values: dict[str, object] = {
        "name": "four-waypoint test",
        "mission_text": "version: 1\nname: four-waypoint test\n",
        "plan": plan(),
        "vehicle": load_vehicle("crazyflie"),
        "limits": SafetyLimits(geofence=Geofence((-1.0, -1.0, 0.0), (4.0, 4.0, 3.0))),
        "link": "sim://",
        "seed": 7,
        "started": datetime(2026, 11, 22, 10, 31, 7, tzinfo=UTC),
        "planner": "learned",
        "model_card": {"name": "crazyflie-flight", "hash": "0123abcd"},
        "predicted_max_error_m": 0.25,
        "predictions": (PREDICTION,),
        **changes,
    }
    return FlightHeader(**values)  # type: ignore[arg-type]


Offset = Callable[[float], Vector3]
"""Position minus reference in m, over the time of the flight in s."""


def beside(distance_m: float) -> Offset:
    """Always as far from the reference, in a turning direction."""
    return lambda t: (distance_m * math.cos(t), distance_m * math.sin(t), 0.0)


def flight(offset: Offset | None = None, *, end: Sequence[Phase] = (Phase.LANDED,)) -> list[Pair]:
    """All ticks from pre-flight to those of the phases in `end`; 10 cm beside the reference where nothing is given."""
    away = offset or beside(0.1)
    steps: list[tuple[Phase, int, float, Reference | None]] = [(Phase.PREFLIGHT, -1, 0.0, None)] * 10
    steps += [(Phase.ARMED, -1, 0.0, None)] * 10
    for number, leg in enumerate(plan().legs):
        for tick in range(round(leg.duration_s * 100)):
            steps.append((_PHASES[leg.kind], number, tick / 100, leg.trajectory.reference(tick / 100)))
    steps += [(phase, len(plan().legs) - 1, plan().legs[-1].duration_s, None) for phase in end]
    return [_pair(sequence, *step, away(sequence / 100)) for sequence, step in enumerate(steps)]


def with_finding(pairs: list[Pair], first: int, last: int, finding: Finding) -> list[Pair]:
    """The same flight with a finding from one tick to another, both included."""
    return [(i, replace(t, findings=(*t.findings, finding)) if first <= t.sequence <= last else t) for i, t in pairs]


def log_of(pairs: list[Pair], **changes: object) -> FlightLog:
    """What reading the log of these ticks gives, without a file."""
    return FlightLog(
        path=Path("synthetic.mcap"),
        header=header(**changes),
        series=series_of(pairs),
        findings=findings_of([tick for _, tick in pairs]),
        complete=True,
    )


def _pair(sequence: int, phase: Phase, leg: int, leg_time_s: float, reference: Reference | None, away: Vector3) -> Pair:
    now_ns = START_NS + sequence * TICK_NS + 130_000
    state = _state(reference, away)
    setpoint = None
    if reference is not None:
        thrust_N = load_vehicle("crazyflie").mass_kg * math.hypot(*_specific_force(reference))
        setpoint = AttitudeThrust(thrust_N, state.q_WB)
    tick = Tick(
        sequence=sequence,
        now_ns=now_ns,
        dt_s=0.01,
        phase=phase,
        leg=leg,
        leg_time_s=leg_time_s,
        reference=reference,
        setpoint=setpoint,
        motors=MotorRequest.DISARM if phase is Phase.LANDED else MotorRequest.NONE,
        position_error_W=None if reference is None else away,
        saturated=phase is Phase.TRACK and sequence % 50 == 0,
    )
    return _inputs(sequence, now_ns, state), tick


def _inputs(sequence: int, now_ns: int, state: State) -> TickInputs:
    arrival_ns = now_ns - 3_000_000
    raw = RawPose(sequence, arrival_ns - SOURCE_BEHIND_NS, arrival_ns, state.p_WB, state.q_WB)
    telemetry = Telemetry(
        stamp_ns=arrival_ns,
        battery_V=4.1 - 1e-4 * sequence,
        armed=True,
        airborne=True,
        crashed=False,
        motor_shares=(0.5, 0.52, 0.48, 0.5),
        messages=("ready",) if sequence == 0 else (),
    )
    return TickInputs(
        sequence=sequence,
        now_ns=now_ns,
        deadline_ns=START_NS + sequence * TICK_NS,
        missed=0,
        pose=PoseReport(state, 3_000_000, raw, rate_hz=100.0, received=sequence + 1),
        link=LinkReport(True, 4_000_000, sent=sequence, received=sequence, telemetry=telemetry),
    )


def _state(reference: Reference | None, away: Vector3) -> State:
    if reference is None:
        return State((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    x, y, z = reference.p_W
    return State(
        p_WB=(x + away[0], y + away[1], z + away[2]),
        v_WB_W=reference.v_W,
        q_WB=_attitude(reference),
        w_WB_B=(0.0, 0.0, reference.yaw_rate),
    )


def _specific_force(reference: Reference) -> Vector3:
    ax, ay, az = reference.a_W
    return (ax, ay, az + GRAVITY_M_PER_S2)


def _attitude(reference: Reference) -> Quaternion:
    """Body z along the specific force, after turning to the heading."""
    fx, fy, fz = _specific_force(reference)
    tilt = normalized((-fy, fx, 0.0, fz + math.hypot(fx, fy, fz)))
    return multiply(tilt, from_yaw(reference.yaw_rad))
