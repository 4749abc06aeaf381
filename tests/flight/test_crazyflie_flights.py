"""Whole flights over the Crazyflie link, in real time, against `lcd sim crazyflie` in a process of its own.

Between the two stands a path that can begin to lose datagrams in the middle of a flight.
"""

from __future__ import annotations

import asyncio
import contextlib
import random
import re
import struct
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
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


MOST_MISSED = 0.02
"""Of the ticks."""


@dataclass
class Flown:
    """One flight and what it left behind."""

    result: FlightResult
    listener: Listener

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

        async def yes(_operator: object) -> bool:
            return True

        options = FlightOptions(confirm=yes)
        plan = plan_mission(mission, vehicle).plan
        return Flown(run_flight(mission, plan, vehicle, options, observers=(listener,)), listener)


def kept_time(flown: Flown) -> Flown:
    """The flight, if its loop ran; one that the machine kept from running says nothing about the link."""
    figures = flown.result.figures
    if figures.missed > MOST_MISSED * figures.ticks:
        pytest.skip(f"the machine was too busy: {figures.missed} of {figures.ticks} ticks were skipped")
    return flown


def in_track(act: Callable[[], None]) -> Listener:
    """Acts once, when the first trajectory has begun."""
    acted: list[bool] = []

    def once(_inputs: TickInputs, tick: Tick) -> None:
        if tick.phase is Phase.TRACK and not acted:
            acted.append(True)
            act()

    return Listener(act=once)


def lose_a_third(world: World) -> None:
    """Each way."""
    luck = random.Random(4)  # noqa: S311 - nothing is to be kept secret
    world.path.loses = lambda _data, _up: luck.random() < 0.3


def be_silent_for_three_seconds(world: World) -> None:
    """Each way; poses go on."""
    world.path.loses = lambda _data, _up: True
    threading.Timer(3.0, setattr, (world.path, "loses", lambda _data, _up: False)).start()


def kill(world: World) -> None:
    """Vehicle and motion capture are gone at once."""
    world.process.kill()


FAULTS = {"lossy": lose_a_third, "silent": be_silent_for_three_seconds, "killed": kill}


@pytest.fixture(scope="module")
def faulty(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Flown]:
    """A flight with each fault, side by side, to save time."""
    flown: dict[str, Flown] = {}

    def fly(name: str) -> None:
        world = World(tmp_path_factory.mktemp(name))
        with world.running():
            flown[name] = world.fly(in_track(lambda: FAULTS[name](world)))

    flights = [threading.Thread(target=fly, args=(name,), name=name) for name in FAULTS]
    for flight in flights:
        flight.start()
    for flight in flights:
        flight.join()
    return flown


def test_a_mission_lands_and_every_setpoint_is_in_the_log_as_it_went_out(tmp_path: Path) -> None:
    world, before = World(tmp_path), set(threading.enumerate())
    with world.running():
        flown = world.fly(Listener())
    assert set(threading.enumerate()) == before
    flight = kept_time(flown).listener.flight
    assert flown.result.outcome is Outcome.LANDED, flown.result.reason
    tracked = [t.position_error_W for _, t in flight if t.phase is Phase.TRACK and t.position_error_W]
    assert (sum(e * e for error in tracked for e in error) / len(tracked)) ** 0.5 < 0.15
    chosen = thrust_map("vehicle", vehicle_of(Mission.model_validate(world.keys)))
    logged = [bytes.fromhex(sent.packet) for inputs, _ in flight for sent in inputs.link.transmitted]
    assert sorted(logged) == sorted(world.path.sent_up(0x3C) + world.path.sent_up(0x7C))
    asked = [chosen.counts(t.setpoint.thrust_N) for _, t in flight if t.phase.airborne and t.setpoint is not None]
    went_out = [counts for packet in logged if packet[0] == 0x3C for counts in struct.unpack_from("<H", packet, 13)]
    went_out = [counts for counts in went_out if counts > 0]
    assert len(went_out) >= 0.98 * len(asked)  # one that another overtook in the thread is not sent
    assert set(went_out) <= set(asked)
    assert world.path.sent_up(0x7D) == [crtp_wire.NOTIFY_STOP] * 3


def test_from_heavy_loss_in_flight_it_brakes_and_lands(faulty: dict[str, Flown]) -> None:
    flown = kept_time(faulty["lossy"])
    assert flown.result.outcome is Outcome.ABORTED, flown.result.reason
    assert flown.listener.phases[-1] is Phase.LANDED
    assert "link_loss_severe" in codes(flown.listener.flight)
    assert Phase.LAND_NOW in flown.listener.phases


def test_three_seconds_of_silence_are_seen_in_a_tenth_and_the_vehicle_does_what_it_does_alone(
    faulty: dict[str, Flown],
) -> None:
    flown = kept_time(faulty["silent"])
    inputs, tick = flown.first("link_age")
    assert inputs.link.age_ns is not None
    slept_ns = inputs.now_ns - inputs.deadline_ns + 10_000_000 * inputs.missed
    assert 100e6 < inputs.link.age_ns < 150e6 + slept_ns
    assert tick.phase is Phase.BRAKE_HOLD
    assert Phase.LAND_NOW in flown.listener.phases
    # It keeps its last thrust, and after 2 s it stops its motors and is locked, whatever the host would have liked:
    # it says so itself once it is heard again, unless it has climbed out of the fence before.
    assert flown.result.outcome in (Outcome.CRASHED, Outcome.CUT)
    assert {"vehicle_crashed", "fence_far", "hard_landing"} & codes(flown.listener.flight)


def test_a_killed_peer_ends_the_flight_in_seconds(faulty: dict[str, Flown]) -> None:
    """Poses end with it, so that nobody sees anything any more: level descent for its time, then the stop."""
    flown = kept_time(faulty["killed"])
    assert flown.listener.phases[-2:] == [Phase.DESCEND_BLIND, Phase.KILL]
    assert flown.result.outcome is Outcome.CUT
    gone_ns = flown.entered(Phase.BRAKE_HOLD).now_ns
    assert flown.entered(Phase.DESCEND_BLIND).now_ns - gone_ns < 0.5e9
    assert flown.entered(Phase.KILL).now_ns - gone_ns < 10e9
