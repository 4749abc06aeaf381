"""What one key alone cannot show: keys that contradict each other, and geometry.

Each check is a generator of (key, text) over a `Draft`; a part that could not be read is left to its own message.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from typing import TypeAlias

from lcd_flight.mission.actions import ITEM_KINDS, Land, Takeoff, Waypoint
from lcd_flight.mission.draft import Draft
from lcd_flight.mission.problems import Key
from lcd_flight.mission.sections import Battery, GeofenceKeys, MotionCapture, Planner, Rehearse, Safety, VehicleKeys
from lcd_flight.model import Vector3
from lcd_flight.planning.times import SAME_POINT

Found: TypeAlias = Iterator[tuple[Key, str]]
Check: TypeAlias = Callable[[Draft], Found]

PEAK_TO_MEAN_SPEED = 35 / 16
"""Of the minimum-snap way between two points from rest to rest: 35 t^4 - 84 t^5 + 70 t^6 - 20 t^7 at t = 1/2."""


def contradictions(draft: Draft, checks: Iterable[Check]) -> Found:
    """Everything that the checks find."""
    for check in checks:
        yield from check(draft)


def battery_order(draft: Draft) -> Found:
    """critical < warning < takeoff."""
    battery = draft.part(Battery, "vehicle", "battery")
    if battery is None:
        return
    names = ("voltage_critical", "voltage_warning", "voltage_takeoff")
    for lower, upper in pairwise(names):
        low, high = getattr(battery, f"{lower}_V"), getattr(battery, f"{upper}_V")
        if low >= high:
            yield ("vehicle", "battery", lower), f"{low:g} V is not below {upper} {high:g} V; lower it or raise {upper}"


def endpoint_port(draft: Draft) -> Found:
    """A tcp endpoint has a port."""
    mocap = draft.part(MotionCapture, "motion_capture")
    if mocap is None or not mocap.endpoint.startswith("tcp://"):
        return
    port = mocap.endpoint.rpartition(":")[2]
    if not (port.isascii() and port.isdigit() and 1 <= int(port) <= 65_535):
        found = f"{mocap.endpoint} has no port from 1 to 65535"
        yield ("motion_capture", "endpoint"), f"{found}; write tcp://HOST:PORT"


def fence_order(draft: Draft) -> Found:
    """min < max on every axis."""
    fence = draft.part(GeofenceKeys, "safety", "geofence")
    for axis, low, high in zip(range(3), fence.min_m, fence.max_m, strict=True) if fence else ():
        if low >= high:
            yield (
                ("safety", "geofence", "min", axis),
                f"{low:g} is not below the geofence's max {high:g} m; swap them or move one",
            )


def error_order(draft: Draft) -> Found:
    """A rehearsal may not allow what the flight lands for."""
    safety = draft.part(Safety, "safety")
    if safety and safety.max_predicted_error_m > safety.max_position_error_m:
        yield (
            ("safety", "max_predicted_error"),
            f"{safety.max_predicted_error_m:g} is above max_position_error {safety.max_position_error_m:g} m, at which "
            "the flight lands; lower it or raise max_position_error",
        )


def faults_once(draft: Draft) -> Found:
    """No fault is named twice."""
    rehearse = draft.part(Rehearse, "rehearse")
    faults = rehearse.faults if rehearse else ()
    for index, fault in enumerate(faults):
        if fault in faults[:index]:
            yield ("rehearse", "faults", index), f"{fault} is named twice; keep one of them"


def plan_order(draft: Draft) -> Found:
    """Take-off first and once, landing last and once."""
    kinds = draft.item_kinds()
    if not kinds:
        return
    for kind, place, index in (("takeoff", "first", 0), ("land", "last", len(kinds) - 1)):
        if kind not in kinds:
            yield ("plan",), f"has no {kind}; add `- {kind}: {ITEM_KINDS[kind]}` as its {place} item"
        for found, other in enumerate(kinds):
            if other == kind and found != index:
                yield (
                    ("plan", found, kind),
                    f"is item {found + 1} of {len(kinds)}; {kind} must be the {place} item, once",
                )


def inside_fence(draft: Draft) -> Found:
    """Every point that the mission names lies in the geofence."""
    fence = draft.part(GeofenceKeys, "safety", "geofence")
    if fence is None or any(low >= high for low, high in zip(fence.min_m, fence.max_m, strict=True)):
        return
    for key, what, axis, value in _coordinates(draft):
        low, high = fence.min_m[axis], fence.max_m[axis]
        up, down = ("raise", "lower") if axis == 2 else ("move", "move")
        if value > high:
            yield key, f"{value:g} is above the geofence's {high:g} m; {down} {what} or raise safety.geofence.max"
        if value < low:
            yield key, f"{value:g} is below the geofence's {low:g} m; {up} {what} or lower safety.geofence.min"


def _coordinates(draft: Draft) -> Iterator[tuple[Key, str, int, float]]:
    """Key, name, axis and value in m of the start, the hover, every waypoint and the landing."""
    vehicle = draft.part(VehicleKeys, "vehicle")
    points: list[tuple[Key, str, Vector3]] = []
    if vehicle is not None:
        points.append((("vehicle", "initial_position"), "the start", vehicle.initial_position_m))
        for key, takeoff in draft.items("takeoff", Takeoff):
            yield (*key, "height"), "the hover", 2, vehicle.initial_position_m[2] + takeoff.height_m
    points += [((*key, "position"), "the waypoint", waypoint.position_m) for key, waypoint in draft.waypoints()]
    points += [
        ((*key, "position"), "the landing", land.position_m)
        for key, land in draft.items("land", Land)
        if land.position_m is not None
    ]
    for key, what, point in points:
        yield from (((*key, axis), what, axis, value) for axis, value in enumerate(point))


def waypoints_apart(draft: Draft) -> Found:
    """Consecutive waypoints differ in position, or in heading with a time between them."""
    for key, before, waypoint in _pairs(draft):
        if math.dist(before.position_m, waypoint.position_m) >= SAME_POINT:
            continue
        turned = waypoint.yaw_deg is not None and waypoint.yaw_deg != before.yaw_deg
        if not turned:
            yield (*key, "position"), f"{list(waypoint.position_m)} equals the waypoint before; remove one of them"
        elif waypoint.time_s is None:
            yield (
                (*key, "position"),
                f"{list(waypoint.position_m)} equals the waypoint before, so a speed gives no duration; "
                "add `time` or remove one of them",
            )


def _pairs(draft: Draft) -> Iterator[tuple[Key, Waypoint, Waypoint]]:
    """Consecutive waypoints that are both right, with the key of the second."""
    for key, waypoints in draft.trajectories():
        for index, (before, waypoint) in enumerate(pairwise(waypoints), 1):
            if before and waypoint:
                yield (*key, index), before, waypoint


def first_has_no_time(draft: Draft) -> Found:
    """The way to a trajectory's first waypoint is planned by itself."""
    for key, waypoints in draft.trajectories():
        if waypoints and waypoints[0] and waypoints[0].time_s is not None:
            yield (*key, 0, "time"), f"{waypoints[0].time_s:g} s: the first waypoint has no time; remove it"


def speeds(draft: Draft) -> Found:
    """Mean speeds that the mission asks for stay below planner.limits.max_velocity."""
    planner = draft.part(Planner, "planner")
    if planner is None:
        return
    limit = planner.limits.max_velocity_m_per_s
    for name in ("speed", "transfer_speed"):
        speed = getattr(planner, f"{name}_m_per_s")
        if speed > limit:
            yield (
                ("planner", name),
                f"{speed:g} is above planner.limits.max_velocity {limit:g} m/s; lower it or raise the limit",
            )
    for key, distance_m, duration_s in _timed_ways(draft):
        speed = distance_m / duration_s
        if speed > limit:
            yield (
                key,
                f"{duration_s:g} s for {distance_m:.2f} m needs {speed:.2f} m/s, above planner.limits.max_velocity "
                f"{limit:g} m/s; write at least {_up(distance_m / limit)} s",
            )


def _timed_ways(draft: Draft) -> Iterator[tuple[Key, float, float]]:
    """Key of the duration, distance in m to be judged by mean speed, duration in s."""
    for key, takeoff in draft.items("takeoff", Takeoff):
        yield (*key, "duration"), PEAK_TO_MEAN_SPEED * takeoff.height_m, takeoff.duration_s
    for key, land in draft.items("land", Land):
        if land.duration_s is not None:
            yield (*key, "duration"), PEAK_TO_MEAN_SPEED * land.height_m, land.duration_s
    for key, before, waypoint in _pairs(draft):
        if waypoint.time_s is not None:
            yield (*key, "time"), math.dist(before.position_m, waypoint.position_m), waypoint.time_s


def _up(value: float) -> float:
    """Rounded up to two decimals."""
    return math.ceil(value * 100.0) / 100.0


CHECKS: tuple[Check, ...] = (
    battery_order,
    endpoint_port,
    fence_order,
    error_order,
    faults_once,
    plan_order,
    inside_fence,
    waypoints_apart,
    first_has_no_time,
    speeds,
)
