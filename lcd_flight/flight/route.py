"""What is flown next: the legs in order, waits to settle, and the manoeuvre of each abnormal phase. Pure."""

from __future__ import annotations

import math
from dataclasses import replace

from lcd_flight.flight.manoeuvres import go_to, land_from, stop
from lcd_flight.flight.memory import Route
from lcd_flight.flight.phases import OF_LEG, Event
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.model import Finding, Leg, Phase, Reference, Severity, State

CALM_ERROR_M = 0.1
SETTLED_S = 0.5
"""Standing still for so long, no further than that from the reference, is settled."""
SETTLE_LIMIT_S = 5.0
"""A leg that has not settled by then is left with a warning."""

ON_THE_WAY = frozenset({Phase.TAKEOFF, Phase.HOLD, Phase.TRACK})


def reference_at(route: Route) -> Reference | None:
    """Where the vehicle should be; None where nothing is followed."""
    return None if route.path is None else route.path.reference(route.path_time_s)


def moved_on(route: Route, dt_s: float) -> Route:
    """One step further along."""
    leg_time_s = route.leg_time_s + dt_s if route.on_leg else route.leg_time_s
    return replace(route, leg_time_s=leg_time_s, path_time_s=route.path_time_s + dt_s)


def calmed(route: Route, state: State | None, reference: Reference | None, still: bool, dt_s: float) -> Route:
    """With the time noted for which a vehicle that stands still has done so at its reference."""
    near = state is not None and reference is not None and math.dist(state.p_WB, reference.p_W) < CALM_ERROR_M
    return replace(route, calm_s=route.calm_s + dt_s if still and near else 0.0)


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
