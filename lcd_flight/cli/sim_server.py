"""Serving a simulated vehicle until it is told to stop: what every `lcd sim` shares."""

from __future__ import annotations

import asyncio
import contextlib
import math
import signal
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from lcd_flight.cli.terminal import Terminal
from lcd_flight.errors import InputError
from lcd_flight.flight.clock import RealClock
from lcd_flight.flight.realtime import prioritised
from lcd_flight.mission import load_mission
from lcd_flight.mission.airframe import vehicle_of
from lcd_flight.model import LinkContext, PosePublisher, Vector3, Vehicle
from lcd_flight.plugins import pose_publisher
from lcd_flight.plugins.vehicle_servers import VehicleServer, vehicle_server
from lcd_flight.worlds import load_vehicle

VEHICLE = "crazyflie-2.1"
ENDPOINT = "tcp://127.0.0.1:5555"
RIGID_BODY = "cf1"
NOWHERE = "none"
EVENTS = 1000
"""As many of the last ones stand in the JSON line."""


@dataclass(frozen=True, slots=True)
class Bench:
    """What stands where, and how it is seen."""

    vehicle: Vehicle
    position_m: Vector3
    yaw_rad: float
    endpoint: str
    """Of motion capture; `none`: its pose is not published."""
    rigid_body: str
    seed: int


def bench_of(
    mission: str | None, vehicle: str | None, endpoint: str | None, rigid_body: str | None, seed: int
) -> Bench:
    """What a mission says, and options in place of it; without a mission, at the origin.

    Raises:
        InputError: the mission or the vehicle is wrong.
    """
    if mission is None:
        airframe = load_vehicle(vehicle or VEHICLE)
        return Bench(airframe, (0.0, 0.0, 0.0), 0.0, endpoint or ENDPOINT, rigid_body or RIGID_BODY, seed)
    loaded = load_mission(mission)
    if loaded.motion_capture.frame != "enu":
        raise InputError(
            f"{loaded.place('motion_capture', 'frame')}: a simulated vehicle is seen in enu; "
            f"{loaded.motion_capture.frame} is not simulated"
        )
    return Bench(
        vehicle=load_vehicle(vehicle) if vehicle else vehicle_of(loaded),
        position_m=loaded.vehicle.initial_position_m,
        yaw_rad=math.radians(loaded.vehicle.initial_yaw_deg),
        endpoint=endpoint or loaded.motion_capture.endpoint,
        rigid_body=rigid_body or loaded.motion_capture.rigid_body,
        seed=seed,
    )


def serve(
    name: str, address: str, options: Mapping[str, str], bench: Bench, terminal: Terminal, seconds: float | None
) -> dict[str, Any]:
    """Serve until Ctrl-C, SIGTERM or for so many seconds; what the JSON line says.

    Raises:
        InputError: an option is wrong.
        RefusedError: the port or the endpoint is not to be had.
    """
    publishers: list[PosePublisher] = []

    def publish(data: bytes) -> None:
        for publisher in publishers:
            publisher(data)

    context = LinkContext(
        vehicle=bench.vehicle,
        clock=RealClock(),
        initial_position_m=bench.position_m,
        initial_yaw_rad=bench.yaw_rad,
        seed=bench.seed,
        publish_pose=publish,
        rigid_body=bench.rigid_body,
    )
    server = vehicle_server(name, address, options, context)
    return asyncio.run(_served(server, publishers, bench, terminal, seconds))


async def _served(
    server: VehicleServer, publishers: list[PosePublisher], bench: Bench, terminal: Terminal, seconds: float | None
) -> dict[str, Any]:
    """Compile, then ask for priority, then open motion capture: its thread has the priority, compiling has not."""
    terminal.announce_compilation()
    events: deque[str] = deque(maxlen=EVENTS)

    def say(text: str) -> None:
        events.append(text)
        terminal.line("VEHICLE", text)

    async with server:
        with prioritised() as objection, contextlib.ExitStack() as stack:
            if bench.endpoint != NOWHERE:
                publishers.append(pose_publisher(bench.endpoint))
                stack.callback(publishers[0].close)
            _announce(server, bench, terminal, objection)
            await _until_told(server, say, seconds)
    return {"uri": server.uri, "vehicle": server.description, "events": list(events)}


def _announce(server: VehicleServer, bench: Bench, terminal: Terminal, objection: str) -> None:
    terminal.line("SIM", f"{server.description} at {server.uri}; Ctrl-C ends it")
    if bench.endpoint != NOWHERE:
        terminal.detail(f"poses of {bench.rigid_body} at {bench.endpoint}")
    if objection:
        terminal.warn(objection)


async def _until_told(server: VehicleServer, say: Callable[[str], None], seconds: float | None) -> None:
    """Serve until a signal comes or the time is up; an error of the simulation itself comes out here."""
    loop, serving = asyncio.get_running_loop(), asyncio.create_task(server.serve(say))
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, serving.cancel)
    with contextlib.suppress(asyncio.CancelledError, TimeoutError):
        await asyncio.wait_for(serving, seconds)
