"""The setpoint of a tick: the control law, what is sent where it fails, and the gate. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from lcd_flight.flight.manoeuvres import blind_setpoint
from lcd_flight.flight.memory import Memory
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.model import AttitudeThrust, Finding, Phase, Reference, Severity, State, TickInputs, Vector3
from lcd_flight.model.frames import from_yaw, yaw_of
from lcd_flight.safety.gate import gate

REPEATS = 3
"""For so many ticks at most the last good setpoint stands in for one that is not finite."""
MOTOR_LIMIT_SHARE = 0.999


@dataclass(frozen=True, slots=True)
class Steering:
    """What is sent, and what the next tick must know of how it came about."""

    setpoint: AttitudeThrust | None = None
    integral: Vector3 = (0.0, 0.0, 0.0)
    invalid_commands: int = 0
    findings: tuple[Finding, ...] = ()


def steer(
    phase: Phase, state: State | None, reference: Reference | None, setup: FlightSetup, memory: Memory, dt_s: float
) -> Steering:
    """The setpoint of this tick, behind the gate; none where motors are not to turn."""
    known = state or memory.state
    yaw_rad = 0.0 if known is None else yaw_of(known.q_WB)
    level = blind_setpoint(setup.vehicle, memory.hover_N or setup.vehicle.weight_N, yaw_rad)
    if phase is Phase.ARMED:
        return Steering(AttitudeThrust(0.0, from_yaw(yaw_rad)))
    if not phase.airborne:
        return Steering()
    if phase is Phase.DESCEND_BLIND or state is None or reference is None:
        return Steering(level)
    wanted = _commanded(state, reference, setup, memory, dt_s)
    if wanted is None:
        return _stand_in(level, memory)
    setpoint, findings = gate(wanted[0], setup.gate, level)
    return Steering(setpoint, wanted[1], 0, findings)


def saturated(setpoint: AttitudeThrust | None, inputs: TickInputs, setup: FlightSetup) -> bool:
    """Whether the thrust asked for, or a motor by the vehicle's report, is at its upper limit."""
    if setpoint is None:
        return False
    telemetry = inputs.link.telemetry
    shares = () if telemetry is None or telemetry.motor_shares is None else telemetry.motor_shares
    return setpoint.thrust_N >= setup.gate.thrust_N or any(share >= MOTOR_LIMIT_SHARE for share in shares)


def _commanded(
    state: State, reference: Reference, setup: FlightSetup, memory: Memory, dt_s: float
) -> tuple[AttitudeThrust, Vector3] | None:
    """What the law asks for; None where that is not finite, or it failed on numbers."""
    try:
        setpoint, integral = setup.law(state, reference, setup.vehicle, memory.integral, dt_s)
    except (ArithmeticError, ValueError):
        return None
    finite = setpoint.is_finite() and all(abs(i) < float("inf") for i in integral)
    return (setpoint, integral) if finite else None


def _stand_in(level: AttitudeThrust, memory: Memory) -> Steering:
    count = memory.invalid_commands + 1
    last = memory.setpoint if count <= REPEATS else None
    text = f"the control law's result was not finite: {'last good setpoint repeated' if last else 'level descent sent'}"
    finding = Finding("controller_invalid", Severity.WARN, text, float(count), float(REPEATS))
    return Steering(last or level, memory.integral, count, (finding,))
