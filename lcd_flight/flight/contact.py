"""Whether the vehicle stands on the ground: touchdown, a fall, a take-off that does not happen. Pure."""

from __future__ import annotations

import math

from lcd_flight.flight.memory import Contact, Memory
from lcd_flight.flight.phases import Event
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.model import Finding, Phase, Reference, Severity, State, Vector3
from lcd_flight.model.frames import tilt_of

SMOOTHING_S = 0.2
"""Time constant of the velocity that standing still is judged by."""
STILL_SPEED = 0.1
"""m/s"""
TOUCHDOWN_S = 0.3
"""Standing for so long on too little thrust to hover is touchdown."""
TOUCHDOWN_THRUST_SHARE = 0.8
"""Of the thrust at which this flight hovers: in the air it would be 0.6 m/s fast after the time above."""
HARD_LANDING_SPEED = 2.0
"""m/s: a vehicle that the ground has stopped from more has crashed."""
HARDEST_BRAKING = 20.0
"""m/s^2 upwards that thrust can give at most; what stops a fall faster is the ground."""
LYING_RAD = math.radians(45.0)
"""A vehicle at rest that is tilted more has crashed."""
NEAR_GROUND_M = 0.1
"""Height above the ground below which a vehicle that stands still stands on it."""
STUCK_BELOW_M = 0.2
"""Below its reference: so far a vehicle that stands on the ground should have flown."""
STUCK_S = 0.2

FALLEN = "fallen"
HARD_LANDING = "hard_landing"
LYING = "lies_tilted"

_GOING_DOWN = frozenset({Phase.LAND, Phase.LAND_NOW, Phase.DESCEND_BLIND})


def felt(memory: Memory, setup: FlightSetup, state: State | None, reference: Reference | None, dt_s: float) -> Contact:
    """What is known of it one step later; without a state it keeps still about it."""
    before = memory.contact
    fading = max(before.sink_speed - HARDEST_BRAKING * dt_s, 0.0)
    if state is None:
        return Contact(v_smooth_W=before.v_smooth_W, sink_speed=fading, impact_speed=before.impact_speed)
    v_smooth_W = _smoothed(before.v_smooth_W, state, dt_s)
    still = math.hypot(*v_smooth_W) < STILL_SPEED
    near = state.p_WB[2] - setup.ground_z_m < NEAR_GROUND_M
    sinking = max(-state.v_WB_W[2], 0.0)
    behind = reference is not None and reference.p_W[2] - state.p_WB[2] > STUCK_BELOW_M
    return Contact(
        v_smooth_W=v_smooth_W,
        still=still,
        grounded_s=before.grounded_s + dt_s if still and _is_carried(memory, setup, near) else 0.0,
        stuck_s=before.stuck_s + dt_s if still and near and behind else 0.0,
        sink_speed=max(sinking, fading),
        impact_speed=max(before.impact_speed, fading - sinking) if near else before.impact_speed,
    )


def _is_carried(memory: Memory, setup: FlightSetup, near_ground: bool) -> bool:
    """Whether something else than thrust must carry a vehicle that stands still."""
    if memory.setpoint is None:
        return False
    if memory.phase is Phase.DESCEND_BLIND:  # thrust is constant there and tells nothing
        return near_ground
    return memory.setpoint.thrust_N < TOUCHDOWN_THRUST_SHARE * (memory.hover_N or setup.vehicle.weight_N)


def _smoothed(v_W: Vector3, state: State, dt_s: float) -> Vector3:
    share = dt_s / (SMOOTHING_S + dt_s)
    x, y, z = (old + share * (new - old) for old, new in zip(v_W, state.v_WB_W, strict=True))
    return (x, y, z)


def ground_contact(contact: Contact, phase: Phase, state: State | None) -> tuple[Event | None, tuple[Finding, ...]]:
    """What a vehicle that stands means: touchdown where it was to land, else that it fell or never lifted off."""
    if state is None or not phase.airborne:
        return None, ()
    if contact.stuck_s >= STUCK_S:
        if phase is Phase.TAKEOFF:
            return Event.LAND, (Finding("no_lift_off", Severity.LAND, "does not lift off"),)
        return Event.CRASHED, (Finding(FALLEN, Severity.KILL, "is on the ground although it should fly"),)
    if phase in _GOING_DOWN and contact.grounded_s >= TOUCHDOWN_S:
        damage = _damage(contact, state)
        return Event.CRASHED if damage else Event.TOUCHDOWN, damage
    return None, ()


def _damage(contact: Contact, state: State) -> tuple[Finding, ...]:
    """Why a vehicle that stands has not landed but crashed; nothing where it has landed."""
    tilt_rad = tilt_of(state.q_WB)
    if contact.impact_speed > HARD_LANDING_SPEED:
        text = f"hit the ground at {contact.impact_speed:.1f} m/s"
        return (Finding(HARD_LANDING, Severity.KILL, text, contact.impact_speed, HARD_LANDING_SPEED),)
    if tilt_rad > LYING_RAD:
        text = f"lies on the ground, tilted by {math.degrees(tilt_rad):.0f} deg"
        return (Finding(LYING, Severity.KILL, text, tilt_rad, LYING_RAD),)
    return ()
