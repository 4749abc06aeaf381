"""A whole flight: open everything, check, arm, fly, land, close everything; whatever happens, it ends safely."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Coroutine, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from lcd_flight.flight import virtual_time
from lcd_flight.flight.clock import RealClock
from lcd_flight.flight.director import Consent, Direction, Director
from lcd_flight.flight.loop import FlightLoop
from lcd_flight.flight.operator import Operator
from lcd_flight.flight.progress import Connected, Progress, Reporter
from lcd_flight.flight.realtime import realtime
from lcd_flight.flight.result import FlightResult, Story
from lcd_flight.flight.safe_end import descend_and_stop
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.mission import Mission
from lcd_flight.model import (
    Clock,
    FlightPlan,
    InputError,
    Link,
    LinkContext,
    Observer,
    PoseOptions,
    PoseSource,
    RefusedError,
    Vehicle,
)
from lcd_flight.plugins import open_link, pose_publisher, pose_source
from lcd_flight.plugins.links import parse_uri

SIMULATOR = "sim"
"""The link that publishes its own pose, needs no consent to arm and can be flown in virtual time."""
INTERRUPT_POLL_S = 0.05
Opened = TypeVar("Opened")
LOOPBACK = "loopback://flight"
"""Where pose goes in virtual time."""


@dataclass(frozen=True, slots=True)
class FlightOptions:
    """How to fly, beside what the mission says."""

    uri: str | None = None
    """Link in place of the mission's."""
    fast: bool = False
    """In virtual time; the simulator only."""
    arm: bool = True
    """False: everything but the motors, for `idle_s` seconds after the pre-flight."""
    idle_s: float = 5.0
    by_hand: bool = False
    """Without arming: in place of standing idle, the operator carries the vehicle through the check by hand."""
    confirm: Consent | None = None
    """Asks whether to arm; needed for everything but the simulator."""
    operator: Operator = field(default_factory=Operator)


def run_flight(
    mission: Mission,
    plan: FlightPlan,
    vehicle: Vehicle,
    options: FlightOptions | None = None,
    *,
    observers: Sequence[Observer] = (),
    progress: Progress | None = None,
) -> FlightResult:
    """`fly`, in an event loop of its own: in real time, or in virtual time with `options.fast`."""
    options = options or FlightOptions()
    flight = fly(mission, plan, vehicle, options, observers=observers, progress=progress)
    return virtual_time.run(flight) if options.fast else asyncio.run(flight)


async def fly(
    mission: Mission,
    plan: FlightPlan,
    vehicle: Vehicle,
    options: FlightOptions,
    *,
    observers: Sequence[Observer] = (),
    progress: Progress | None = None,
) -> FlightResult:
    """Fly a plan and say how it ended.

    observers: told of every tick, and closed at the end, also after an error.

    Raises:
        InputError: the link or the endpoint is wrong.
        RefusedError: the link or the pose source is not to be had. What is refused after that is in the result.
    """
    setup = FlightSetup.of(plan, vehicle, mission.safety_limits())
    clock: Clock = virtual_time.VirtualClock() if options.fast else RealClock()
    story = Story()
    listeners: list[Observer] = [story, *([] if progress is None else [Reporter(setup, progress)]), *observers]
    async with contextlib.AsyncExitStack() as stack:
        for observer in observers:
            stack.callback(observer.close)
        stack.enter_context(options.operator.listening())
        # First, so that the threads of link and pose source get the priority too.
        notes = () if options.fast else stack.enter_context(realtime())
        pose, link = await _unless_interrupted(_opened(stack, mission, plan, vehicle, options, clock), options.operator)
        if progress is not None:
            progress(Connected(options.uri or mission.vehicle.uri, link.description))
        loop = FlightLoop(setup, clock, link, pose, options.operator, listeners)
        direction = await _flown(loop, link, clock, setup, options, progress)
        return FlightResult(
            outcome=direction.outcome or story.outcome,
            reason=direction.reason or story.reason,
            phase=story.phase,
            checks=direction.checks,
            figures=loop.figures,
            notes=(*notes, *loop.notes),
        )


async def _opened(
    stack: contextlib.AsyncExitStack,
    mission: Mission,
    plan: FlightPlan,
    vehicle: Vehicle,
    options: FlightOptions,
    clock: Clock,
) -> tuple[PoseSource, Link]:
    """Pose source and link, open until the stack closes; a simulated vehicle publishes its pose on the way."""
    uri, capture = options.uri or mission.vehicle.uri, mission.motion_capture
    simulated = is_simulated(uri)
    _require_consent(simulated, uri, options)
    endpoint = LOOPBACK if options.fast else capture.endpoint
    publisher = pose_publisher(endpoint) if simulated else None
    if publisher is not None:
        stack.callback(publisher.close)
    axes = "enu" if simulated else capture.frame  # a simulated vehicle publishes in our own axes
    source = pose_source(endpoint, capture.rigid_body, clock, PoseOptions(axes=axes))
    pose = await stack.enter_async_context(source)
    context = LinkContext(
        vehicle=vehicle,
        clock=clock,
        initial_position_m=plan.start_m,
        initial_yaw_rad=plan.start_yaw_rad,
        seed=mission.seed,
        publish_pose=publisher,
        rigid_body=capture.rigid_body,
        listen_poses=pose.listen,
        on_link_lost=mission.safety.on_link_lost,
    )
    return pose, await stack.enter_async_context(open_link(uri, context))


async def _unless_interrupted(opening: Coroutine[Any, Any, Opened], operator: Operator) -> Opened:
    """What opens; it may take long, and there is nothing yet that could land.

    Raises:
        RefusedError: the operator asked for something meanwhile, whatever it was.
    """
    task = asyncio.ensure_future(opening)
    try:
        while not task.done():
            if operator():
                raise RefusedError("interrupted while connecting")
            await asyncio.wait({task}, timeout=INTERRUPT_POLL_S)
        return await task
    finally:
        if not task.done():
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)


def is_simulated(uri: str) -> bool:
    """Whether a link leads to the simulator.

    Raises:
        InputError: not a URI, or an unknown link.
    """
    return parse_uri(uri).link == SIMULATOR


def _require_consent(simulated: bool, uri: str, options: FlightOptions) -> None:
    if simulated:
        return
    if options.fast:
        raise InputError(f"--fast flies the simulator only, and the link is {uri}: add --sim or leave --fast out")
    if options.arm and options.confirm is None:
        raise RefusedError(f"nobody was asked whether to arm the vehicle at {uri}: run in a terminal, or with --yes")


async def _flown(
    loop: FlightLoop, link: Link, clock: Clock, setup: FlightSetup, options: FlightOptions, progress: Progress | None
) -> Direction:
    """Run loop and director to the director's end. If either fails, bring the vehicle down before anything else."""
    director = Director(loop, setup, options.operator, options.confirm, progress)
    ticking = asyncio.ensure_future(loop.run())
    directing = asyncio.ensure_future(director.direct(options.arm, options.idle_s, by_hand=options.by_hand))
    try:
        await asyncio.wait({ticking, directing}, return_when=asyncio.FIRST_COMPLETED)
        if ticking.done():
            await ticking  # raises what ended it
        return await directing
    except BaseException:
        ticking.cancel()
        await asyncio.gather(ticking, return_exceptions=True)
        await descend_and_stop(link, clock, setup, loop.memory)
        raise
    finally:
        loop.stop()
        directing.cancel()
        await asyncio.gather(ticking, directing, return_exceptions=True)
