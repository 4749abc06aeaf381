"""What is flown next: legs in order, waits to settle, touchdown, and the manoeuvre of each abnormal phase. Pure."""

from __future__ import annotations

import math
from dataclasses import replace

from lcd_flight.flight.manoeuvres import go_to, land_from, stop
from lcd_flight.flight.phases import OF_LEG, Event
from lcd_flight.flight.setup import FlightSetup, Memory, Route
from lcd_flight.model import Finding, Leg, Phase, Reference, Severity, State, Vector3
from lcd_flight.model.frames import tilt_of

SMOOTHING_S = 0.2
"""Time constant of the velocity that settling and touchdown are judged by."""
STILL_SPEED = 0.1
"""m/s"""
CALM_ERROR_M = 0.1
SETTLED_S = 0.5
"""Calm for so long is settled."""
SETTLE_LIMIT_S = 5.0
"""A leg that has not settled by then is left with a warning."""
TOUCHDOWN_S = 0.3
"""Standing for so long on too little thrust to hover is touchdown."""
TOUCHDOWN_THRUST_SHARE = 0.8
"""Of the thrust at which this flight hovers: in the air it would be 0.6 m/s fast after the time above."""
HARD_LANDING_SPEED = 2.0
"""m/s: a vehicle that came down faster of late has crashed."""
MOVING_SPEED = 0.3
"""m/s: what lies on the ground is slower."""
SINK_FADE = 1.5
"""m/s^2, how fast the memory of a high sink speed fades in the air."""
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

ON_THE_WAY = frozenset({Phase.TAKEOFF, Phase.HOLD, Phase.TRACK})
GOING_DOWN = frozenset({Phase.LAND, Phase.LAND_NOW, Phase.DESCEND_BLIND})


def moved_on(memory: Memory, setup: FlightSetup, state: State | None, dt_s: float) -> tuple[Route, Reference | None]:
    """The route one step later, and where the vehicle should be now; None where nothing is followed."""
    route = memory.route
    time_s = route.path_time_s + dt_s
    reference = None if route.path is None else route.path.reference(time_s)
    v_smooth_W = _smoothed(route.v_smooth_W, state, dt_s)
    still = state is not None and math.hypot(*v_smooth_W) < STILL_SPEED
    near = state is not None and reference is not None and math.dist(state.p_WB, reference.p_W) < CALM_ERROR_M
    moved = Route(
        leg=route.leg,
        leg_time_s=route.leg_time_s + dt_s if route.on_leg else route.leg_time_s,
        path=route.path,
        path_time_s=time_s,
        on_leg=route.on_leg,
        calm_s=route.calm_s + dt_s if still and near else 0.0,
        grounded_s=route.grounded_s + dt_s if still and _is_carried(memory, setup, state) else 0.0,
        stuck_s=route.stuck_s + dt_s if still and _is_left_behind(setup, state, reference) else 0.0,
        sink_speed=_sink_speed(route, setup, state, dt_s),
        v_smooth_W=v_smooth_W,
    )
    return moved, reference


def _is_carried(memory: Memory, setup: FlightSetup, state: State | None) -> bool:
    """Whether something else than thrust must carry a vehicle that stands still."""
    if memory.setpoint is None or state is None:
        return False
    if memory.phase is Phase.DESCEND_BLIND:
        return _is_near_ground(setup, state)
    return memory.setpoint.thrust_N < TOUCHDOWN_THRUST_SHARE * (memory.hover_N or setup.vehicle.weight_N)


def _is_left_behind(setup: FlightSetup, state: State | None, reference: Reference | None) -> bool:
    """Whether a vehicle that stands still stands on the ground, well below where it should be."""
    if state is None or reference is None or not _is_near_ground(setup, state):
        return False
    return reference.p_W[2] - state.p_WB[2] > STUCK_BELOW_M


def next_leg(route: Route, setup: FlightSetup, phase: Phase) -> tuple[Event | None, tuple[Finding, ...]]:
    """How the next leg begins, once the path is flown and, where that is asked for, the vehicle has settled."""
    if phase not in ON_THE_WAY or route.path is None:
        return None, ()
    over_s = route.path_time_s - route.path.duration_s
    if over_s < 0.0:
        return None, ()
    findings: tuple[Finding, ...] = ()
    if _settles(route, setup) and route.calm_s < SETTLED_S:
        if over_s < SETTLE_LIMIT_S:
            return None, ()
        text = f"not settled after {SETTLE_LIMIT_S:g} s at the end of leg {route.leg}; going on"
        findings = (Finding("not_settled", Severity.WARN, text, over_s, SETTLE_LIMIT_S),)
    following = _leg(setup, route.leg + 1)
    return Event.LAND if following is None else OF_LEG[following.kind], findings


def ground_contact(route: Route, phase: Phase, state: State | None) -> tuple[Event | None, tuple[Finding, ...]]:
    """What a vehicle that stands means: touchdown where it was to land, else that it fell or never lifted off."""
    if state is None or not phase.airborne:
        return None, ()
    if route.stuck_s >= STUCK_S:
        if phase is Phase.TAKEOFF:
            return Event.LAND, (Finding("no_lift_off", Severity.LAND, "does not lift off"),)
        return Event.CRASHED, (Finding(FALLEN, Severity.KILL, "is on the ground although it should fly"),)
    if phase in GOING_DOWN and route.grounded_s >= TOUCHDOWN_S:
        damage = _damage(route, state)
        return Event.CRASHED if damage else Event.TOUCHDOWN, damage
    return None, ()


def _damage(route: Route, state: State) -> tuple[Finding, ...]:
    """Why a vehicle that stands has not landed but crashed; nothing where it has landed."""
    tilt_rad = tilt_of(state.q_WB)
    if route.sink_speed > HARD_LANDING_SPEED:
        text = f"hit the ground at {route.sink_speed:.1f} m/s"
        return (Finding(HARD_LANDING, Severity.KILL, text, route.sink_speed, HARD_LANDING_SPEED),)
    if tilt_rad > LYING_RAD:
        text = f"lies on the ground, tilted by {math.degrees(tilt_rad):.0f} deg"
        return (Finding(LYING, Severity.KILL, text, tilt_rad, LYING_RAD),)
    return ()


def begun(route: Route, setup: FlightSetup, before: Phase, phase: Phase, state: State) -> Route:
    """The route as a phase is entered, or as the next leg begins; call it only then."""
    if before in (Phase.ARMED, *ON_THE_WAY) and phase in (Phase.LAND, *ON_THE_WAY):
        return _leg_begun(route, setup)
    if phase is Phase.BRAKE_HOLD:
        return replace(route, path=stop(state, setup.ground_z_m), path_time_s=0.0, on_leg=False)
    if phase is Phase.LAND_NOW:
        return replace(route, path=land_from(state, setup.lowest_z_m), path_time_s=0.0, on_leg=False)
    if phase is Phase.HOLD:
        return _way_back(route, setup, state)
    return replace(route, path=None, path_time_s=0.0, on_leg=False)


def _leg_begun(route: Route, setup: FlightSetup) -> Route:
    """The next leg from its start; time flown beyond a leg that needed no settling counts for the next."""
    waited = route.path is None or _settles(route, setup)
    begin_s = 0.0 if waited or route.path is None else route.path_time_s - route.path.duration_s
    leg = route.leg + 1
    return replace(
        route, leg=leg, leg_time_s=begin_s, path=setup.paths[leg], path_time_s=begin_s, on_leg=True, calm_s=0.0
    )


def _way_back(route: Route, setup: FlightSetup, state: State) -> Route:
    """To where the interrupted leg begins (a take-off: ends), so that it can be flown again from rest."""
    leg = max(route.leg - 1, 0)
    ended = setup.plan.legs[leg].trajectory
    path = go_to(state, ended.waypoints()[-1])
    return replace(route, leg=leg, leg_time_s=ended.duration_s, path=path, path_time_s=0.0, on_leg=False, calm_s=0.0)


def _settles(route: Route, setup: FlightSetup) -> bool:
    leg = _leg(setup, route.leg)
    return not route.on_leg or leg is None or leg.settle


def _leg(setup: FlightSetup, index: int) -> Leg | None:
    return setup.plan.legs[index] if 0 <= index < len(setup.plan.legs) else None


def _sink_speed(route: Route, setup: FlightSetup, state: State | None, dt_s: float) -> float:
    """The highest of late; it does not fade in a vehicle that lies on the ground, so that a fall is remembered."""
    if state is None:
        return route.sink_speed
    lies = _is_near_ground(setup, state) and math.hypot(*state.v_WB_W) < MOVING_SPEED
    return max(-state.v_WB_W[2], route.sink_speed - (0.0 if lies else SINK_FADE * dt_s), 0.0)


def _is_near_ground(setup: FlightSetup, state: State) -> bool:
    return state.p_WB[2] - setup.ground_z_m < NEAR_GROUND_M


def _smoothed(v_W: Vector3, state: State | None, dt_s: float) -> Vector3:
    if state is None:
        return v_W
    share = dt_s / (SMOOTHING_S + dt_s)
    x, y, z = (old + share * (new - old) for old, new in zip(v_W, state.v_WB_W, strict=True))
    return (x, y, z)
