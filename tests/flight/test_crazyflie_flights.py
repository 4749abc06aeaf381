"""Whole flights over the Crazyflie link, in real time, against `lcd sim crazyflie` in a process of its own.

Between the two stands a path that can begin to lose datagrams in the middle of a flight.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import random
import re
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
import yaml
from crazyflie_bench import Path as LossyPath
from flight_bench import codes
from short_mission import TEXT, Listener

from drivers.crazyflie import crtp_wire
from drivers.crazyflie.thrust_map import thrust_map
from lcd_flight.flight.result import FlightResult
from lcd_flight.flight.session import FlightOptions, run_flight
from lcd_flight.mission import Mission
from lcd_flight.mission.airframe import vehicle_of
from lcd_flight.mission.plan_mission import plan_mission
from lcd_flight.model import Outcome, Phase, Tick, TickInputs
from lcd_flight.plugins import pose_publisher

pytestmark = [pytest.mark.realtime, pytest.mark.slow]


@dataclass
class Flown:
    """One flight and what it left behind."""

    result: FlightResult
    listener: Listener
    threads: set[threading.Thread]

    def first(self, code: str) -> tuple[TickInputs, Tick]:
        """The tick that had a finding first."""
        return next((i, t) for i, t in self.listener.flight if any(f.code == code for f in t.findings))

    def entered(self, phase: Phase) -> TickInputs:
        """The first tick of a phase."""
        return next(i for i, t in self.listener.flight if t.phase is phase)


class World:
    """A simulated Crazyflie in its process, and the path to it in a thread."""

    def __init__(self, folder: Path) -> None:
        probe = pose_publisher("tcp://127.0.0.1:0")
        endpoint: str = probe.endpoint  # type: ignore[attr-defined]
        probe.close()
        self._file = folder / "mission.yaml"
        keys = yaml.safe_load(TEXT)
        keys["vehicle"] = {"type": "crazyflie-2.1", "uri": "udp://127.0.0.1:1"}
        keys["motion_capture"] = {"endpoint": endpoint}
        keys["planner"]["speed"] = 0.6  # it has less thrust to spare than the mission's own vehicle
        self._file.write_text(yaml.safe_dump(keys))
        self.keys = keys
        self.path: LossyPath
        self.process: subprocess.Popen[str]

    @contextlib.contextmanager
    def running(self) -> Iterator[None]:
        """Until the flight is over."""
        command = "import sys; from lcd_flight.cli.main import lcd; lcd(sys.argv[1:])"
        arguments = ["sim", "crazyflie", str(self._file), "--port", "0", "--seconds", "60"]
        with subprocess.Popen(  # stays until it is killed
            [sys.executable, "-u", "-c", command, *arguments], stdout=subprocess.PIPE, text=True
        ) as self.process:
            with contextlib.suppress(PermissionError):  # a busy machine must not keep it from publishing poses
                os.sched_setscheduler(self.process.pid, os.SCHED_FIFO, os.sched_param(10))
            try:
                assert self.process.stdout is not None
                found = next(m for line in self.process.stdout if (m := re.search(r"udp://([\d.]+):(\d+)", line)))
                with self._path((found[1], int(found[2]))):
                    yield
            finally:
                self.process.kill()

    @contextlib.contextmanager
    def _path(self, vehicle: tuple[str, int]) -> Iterator[None]:
        ready, done = threading.Event(), threading.Event()

        async def carry() -> None:
            transport, path = await asyncio.get_running_loop().create_datagram_endpoint(
                lambda: LossyPath(vehicle, lambda _data, _up: False), local_addr=("127.0.0.1", 0)
            )
            self.path = path
            ready.set()
            while not done.is_set():
                await asyncio.sleep(0.02)
            transport.close()

        thread = threading.Thread(target=lambda: asyncio.run(carry()))
        thread.start()
        try:
            assert ready.wait(10.0)
            yield
        finally:
            done.set()
            thread.join()

    def fly(self, listener: Listener) -> Flown:
        """The mission, over the path."""
        keys = {**self.keys, "vehicle": {**self.keys["vehicle"], "uri": self.path.uri}}
        mission = Mission.model_validate(keys)
        vehicle = vehicle_of(mission)
        before = set(threading.enumerate())

        async def yes(_operator: object) -> bool:
            return True

        result = run_flight(
            mission, plan_mission(mission, vehicle).plan, vehicle, FlightOptions(confirm=yes), observers=(listener,)
        )
        return Flown(result, listener, set(threading.enumerate()) - before)


def in_track(act: object) -> Listener:
    """Acts once, when the first trajectory has begun."""
    acted: list[bool] = []

    def once(_inputs: TickInputs, tick: Tick) -> None:
        if tick.phase is Phase.TRACK and not acted:
            acted.append(True)
            act()  # type: ignore[operator]

    return Listener(act=once)


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    world = World(tmp_path)
    with world.running():
        yield world


def test_a_mission_lands_and_every_setpoint_is_in_the_log_as_it_went_out(world: World) -> None:
    flown = world.fly(Listener())
    flight = flown.listener.flight
    assert flown.result.outcome is Outcome.LANDED, flown.result.reason
    errors = [
        sum(e * e for e in t.position_error_W) for _, t in flight if t.phase is Phase.TRACK and t.position_error_W
    ]
    assert (sum(errors) / len(errors)) ** 0.5 < 0.15
    chosen = thrust_map("vehicle", vehicle_of(Mission.model_validate(world.keys)))
    logged = [bytes.fromhex(sent.packet) for inputs, _ in flight for sent in inputs.link.transmitted]
    asked = [chosen.counts(t.setpoint.thrust_N) for _, t in flight if t.phase.airborne and t.setpoint is not None]
    flown_counts = [struct.unpack("<H", packet[13:])[0] for packet in logged if packet[0] == 0x3C]
    flown_counts = [counts for counts in flown_counts if counts > 0]
    assert len(flown_counts) >= 0.98 * len(asked)  # one that another overtook in the thread is not sent
    assert [counts for counts in flown_counts if counts not in asked] == []
    assert sorted(logged) == sorted(world.path.sent_up(0x3C) + world.path.sent_up(0x7C))
    assert world.path.sent_up(0x7D) == [crtp_wire.NOTIFY_STOP] * 3
    assert not flown.threads


def test_from_loss_in_flight_it_brakes_and_lands(world: World) -> None:
    luck = random.Random(4)  # noqa: S311 - nothing is to be kept secret
    flown = world.fly(in_track(lambda: setattr(world.path, "loses", lambda _data, _up: luck.random() < 0.3)))
    assert flown.result.outcome is Outcome.ABORTED, flown.result.reason
    assert flown.listener.phases[-1] is Phase.LANDED
    assert "link_loss_severe" in codes(flown.listener.flight)
    assert Phase.LAND_NOW in flown.listener.phases
    assert not flown.threads


def test_three_seconds_of_silence_are_seen_in_a_tenth_and_the_vehicle_does_what_it_does_alone(world: World) -> None:
    def freeze() -> None:
        world.path.loses = lambda _data, _up: True
        threading.Timer(3.0, setattr, (world.path, "loses", lambda _data, _up: False)).start()

    flown = world.fly(in_track(freeze))
    inputs, tick = flown.first("link_age")
    assert inputs.link.age_ns is not None
    assert 100e6 < inputs.link.age_ns < 150e6 + inputs.now_ns - inputs.deadline_ns
    assert tick.phase is Phase.BRAKE_HOLD
    assert Phase.LAND_NOW in flown.listener.phases
    # 2 s without setpoints: its motors stopped and it is locked, whatever the host would have liked.
    assert flown.result.outcome is Outcome.CRASHED
    assert not flown.threads


def test_a_killed_peer_ends_the_flight_in_seconds(world: World) -> None:
    """Poses end with it, so that nobody sees anything any more: level descent for its time, then the stop."""
    flown = world.fly(in_track(world.process.kill))
    phases = flown.listener.phases
    assert phases[-2:] == [Phase.DESCEND_BLIND, Phase.KILL]
    assert flown.result.outcome is Outcome.CUT
    gone_ns = flown.entered(Phase.BRAKE_HOLD).now_ns
    assert flown.entered(Phase.DESCEND_BLIND).now_ns - gone_ns < 0.4e9
    assert flown.entered(Phase.KILL).now_ns - gone_ns < 10e9
    assert not flown.threads
