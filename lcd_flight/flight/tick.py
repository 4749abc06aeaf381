"""One control step, pure: what is known goes in, what is sent, judged and logged comes out.

In this order: estimate the state, move along the route, judge, let the phase follow, begin what it asks for, steer.
A fault that is seen in a tick decides that tick's setpoint.
"""

from __future__ import annotations

import math

from lcd_flight.flight.contact import FALLEN, HARD_LANDING, LYING, felt, ground_contact
from lcd_flight.flight.estimate import estimate, hover_thrust_N
from lcd_flight.flight.manoeuvres import blind_time_s
from lcd_flight.flight.memory import Contact, Memory, Route
from lcd_flight.flight.phases import LANDING_GRACE_S, OF_COMMAND, OF_SEVERITY, TIME_LIMITS_S, Event, advance
from lcd_flight.flight.route import begun, calmed, moved_on, next_leg, reference_at
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.flight.steering import Steering, saturated, steer
from lcd_flight.model import (
    Command,
    Finding,
    MotorRequest,
    Phase,
    Reference,
    Severity,
    State,
    Tick,
    TickInputs,
    Vector3,
)
from lcd_flight.safety.evidence import PERIOD_NS, SafetyMemory, Scope, gather
from lcd_flight.safety.monitors import TAKEN_OVER, VEHICLE_CRASHED, judge

MAX_STEP_S = 0.05
"""A longer pause moves the plan on by this much only: the vehicle did not fly it either."""

EXPIRED = "phase_expired"

_OF_CODE = {
    EXPIRED: Event.EXPIRED,
    TAKEN_OVER: Event.TAKEN_OVER,
    VEHICLE_CRASHED: Event.CRASHED,
    FALLEN: Event.CRASHED,
    HARD_LANDING: Event.CRASHED,
    LYING: Event.CRASHED,
}
"""Findings that lead to an event of their own, whatever their severity."""

_OPERATOR_STOP = "operator_stop"
_WHILE_ALONE = {_OPERATOR_STOP: Event.STOPPED_ALONE, VEHICLE_CRASHED: Event.CRASHED_ALONE}
"""Findings that count also while the vehicle's own failsafe flies it."""

_ORDERS = {
    Command.LAND: Finding("operator_land", Severity.LAND, "the operator asked to land"),
    Command.DESCEND: Finding("operator_descend", Severity.DESCEND, "the operator asked to descend level"),
    Command.STOP_MOTORS: Finding(_OPERATOR_STOP, Severity.KILL, "the operator stopped the motors"),
}


def tick(inputs: TickInputs, setup: FlightSetup, memory: Memory) -> tuple[Tick, Memory]:
    """Decide one control step. Equal arguments give equal results, to the bit."""
    dt_s = _step_s(inputs, memory)
    state, safety = estimate(inputs, setup, memory, dt_s)
    route = moved_on(memory.route, dt_s)
    reference = reference_at(route)
    contact = felt(memory, setup, state, reference, dt_s)
    route = calmed(route, state, reference, contact.still, dt_s)
    judged, safety = _judged(inputs, setup, memory, safety, state, reference)
    leg_event, on_leg = next_leg(route, setup, memory.phase)
    ground_event, on_ground = ground_contact(contact, memory.phase, state)
    findings = (*judged, *on_leg, *on_ground, *_orders(inputs), *_expiry(inputs, memory))
    events = [*_events(inputs, findings), *(e for e in (leg_event, ground_event) if e is not None)]
    phase = advance(memory.phase, events)
    known = state or memory.state
    if known is not None and (phase is not memory.phase or leg_event is not None):
        route = begun(route, setup, memory.phase, phase, known)
        reference = reference_at(route)
    steering = steer(phase, state, reference, setup, memory, dt_s)
    limited = saturated(steering.setpoint, inputs, setup)
    decided = Tick(
        sequence=inputs.sequence,
        now_ns=inputs.now_ns,
        dt_s=dt_s,
        phase=phase,
        leg=route.leg,
        leg_time_s=route.leg_time_s,
        reference=reference,
        setpoint=steering.setpoint,
        motors=_motors(memory.phase, phase),
        position_error_W=_error(state, reference, setup),
        saturated=limited,
        findings=(*findings, *steering.findings),
    )
    return decided, _remembered(decided, memory, known, route, contact, safety, steering, setup)


def _step_s(inputs: TickInputs, memory: Memory) -> float:
    if memory.now_ns is None:
        return PERIOD_NS * 1e-9
    return min(max((inputs.now_ns - memory.now_ns) * 1e-9, 0.0), MAX_STEP_S)


def _judged(
    inputs: TickInputs,
    setup: FlightSetup,
    memory: Memory,
    safety: SafetyMemory,
    state: State | None,
    reference: Reference | None,
) -> tuple[tuple[Finding, ...], SafetyMemory]:
    """What the monitors find, in the phase that the tick before left behind."""
    error_W = _error(state, reference, setup)
    evidence, safety = gather(
        inputs,
        safety,
        scope=_scope(memory.phase),
        state=state,
        position_error_m=None if error_W is None else math.hypot(*error_W),
        saturated=memory.saturated and not (memory.route.on_leg and setup.foreseen_saturation[memory.route.leg]),
        invalid_commands=memory.invalid_commands,
    )
    return judge(setup.monitors, evidence, safety)


def _scope(phase: Phase) -> Scope:
    if phase.airborne:
        return Scope.AIRBORNE
    return Scope.ARMED if phase is Phase.ARMED else Scope.ALWAYS


def _orders(inputs: TickInputs) -> tuple[Finding, ...]:
    """What the operator asks for; to a pilot who flies nothing is sent, and the operator is told why."""
    asked = tuple(_ORDERS[command] for command in inputs.commands if command in _ORDERS)
    if not inputs.link.flown_by_pilot:
        return asked
    return tuple(Finding(f.code, Severity.WARN, f"not sent ({inputs.link.taken_over}): {f.message}") for f in asked)


def _expiry(inputs: TickInputs, memory: Memory) -> tuple[Finding, ...]:
    """A finding once the phase has lasted as long as it may."""
    limit_s, lasted_s = memory.limit_s, (inputs.now_ns - memory.phase_since_ns) * 1e-9
    if limit_s is None or lasted_s <= limit_s:
        return ()
    return (Finding(EXPIRED, Severity.WARN, f"{memory.phase} has lasted {limit_s:.1f} s", lasted_s, limit_s),)


def _time_limit_s(phase: Phase, route: Route, setup: FlightSetup, state: State | None) -> float | None:
    """How long a phase that begins now may last; None: for ever."""
    if phase in (Phase.LAND, Phase.LAND_NOW) and route.path is not None:
        return route.path.duration_s + LANDING_GRACE_S
    if phase is Phase.DESCEND_BLIND and state is not None:
        return blind_time_s(setup.vehicle, state.p_WB[2] - setup.ground_z_m, state.v_WB_W[2])
    return TIME_LIMITS_S.get(phase)


def _events(inputs: TickInputs, findings: tuple[Finding, ...]) -> list[Event]:
    """What commands and findings ask for."""
    events = [OF_COMMAND[command] for command in inputs.commands if command in OF_COMMAND]
    for finding in findings:
        if finding.code in _OF_CODE:
            events.append(_OF_CODE[finding.code])
        elif finding.severity in OF_SEVERITY:
            events.append(OF_SEVERITY[finding.severity])
        if inputs.link.flown_by_pilot is False and finding.code in _WHILE_ALONE:
            events.append(_WHILE_ALONE[finding.code])
    return events


def _motors(before: Phase, phase: Phase) -> MotorRequest:
    """What the link is asked for: a stop is repeated for as long as it holds, the rest is asked for once."""
    if phase is Phase.KILL or (phase is Phase.CRASHED and before.airborne):
        return MotorRequest.STOP
    if phase is before:
        return MotorRequest.NONE
    if phase is Phase.ARMED:
        return MotorRequest.ARM
    on_ground = phase in (Phase.LANDED, Phase.IDLE, Phase.CRASHED)
    return MotorRequest.DISARM if on_ground and (before.airborne or before is Phase.ARMED) else MotorRequest.NONE


def _error(state: State | None, reference: Reference | None, setup: FlightSetup) -> Vector3 | None:
    """Position minus reference in m; a reference that presses down to below the ground counts as on it."""
    if state is None or reference is None:
        return None
    (x, y, z), (rx, ry, rz) = state.p_WB, reference.p_W
    return (x - rx, y - ry, z - max(rz, setup.lowest_planned_z_m))


def _remembered(
    decided: Tick,
    memory: Memory,
    state: State | None,
    route: Route,
    contact: Contact,
    safety: SafetyMemory,
    steering: Steering,
    setup: FlightSetup,
) -> Memory:
    entered = decided.phase is not memory.phase
    return Memory(
        phase=decided.phase,
        phase_since_ns=decided.now_ns if entered else memory.phase_since_ns,
        now_ns=decided.now_ns,
        state=state,
        setpoint=decided.setpoint,
        integral=steering.integral,
        invalid_commands=steering.invalid_commands,
        saturated=decided.saturated,
        hover_N=hover_thrust_N(memory, decided.setpoint, state, decided.reference, setup.vehicle, decided.dt_s),
        limit_s=_time_limit_s(decided.phase, route, setup, state) if entered else memory.limit_s,
        route=route,
        contact=contact,
        safety=safety,
    )
