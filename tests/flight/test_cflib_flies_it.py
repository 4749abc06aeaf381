"""Unmodified cflib connects to the simulated Crazyflie and flies it, in real time.

cflib's programs are processes of their own: it can wait for ever for one lost datagram, and a process can be ended.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from lcd_flight.flight.clock import RealClock
from lcd_flight.model import LinkContext
from lcd_flight.plugins import pose_publisher
from lcd_flight.plugins.vehicle_servers import vehicle_server
from lcd_flight.worlds import load_vehicle

pytestmark = pytest.mark.realtime

PROGRAMS = Path(__file__).parents[1] / "cflib_programs.py"
LIMIT_S = 60.0
"""Hard; everything here takes a few seconds."""
VEHICLES = {
    "brushed": {},
    "brushless": {"platform": "2.1-brushless"},
    "older": {"platform": "2.1-brushless", "firmware": "2024.10"},
}


@pytest.fixture(scope="module")
def endpoint(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Where the brushed vehicle's poses are."""
    return f"ipc://{tmp_path_factory.mktemp('mocap')}/poses"


@pytest.fixture(scope="module")
def uris(endpoint: str) -> Iterator[dict[str, str]]:
    """One vehicle of each kind, served from a thread; where each is."""
    found: dict[str, str] = {}
    ready, loop = threading.Event(), asyncio.new_event_loop()
    serving = loop.create_task(_serve(endpoint, found, ready))
    thread = threading.Thread(target=_run, args=(loop, serving))
    thread.start()
    assert ready.wait(LIMIT_S)
    yield found
    assert not serving.done(), "a simulated vehicle has ended"
    loop.call_soon_threadsafe(serving.cancel)
    thread.join(LIMIT_S)
    assert not thread.is_alive()


def _run(loop: asyncio.AbstractEventLoop, task: asyncio.Task[None]) -> None:
    with contextlib.suppress(asyncio.CancelledError):
        loop.run_until_complete(task)
    loop.close()


async def _serve(endpoint: str, found: dict[str, str], ready: threading.Event) -> None:
    async with contextlib.AsyncExitStack() as stack:
        publish = pose_publisher(endpoint)
        stack.callback(publish.close)
        servers = {}
        for name, options in VEHICLES.items():
            context = LinkContext(
                vehicle=load_vehicle("crazyflie-2.1"),
                clock=RealClock(),
                initial_position_m=(0.0, 0.0, 0.0),
                initial_yaw_rad=0.0,
                seed=0,
                publish_pose=publish if name == "brushed" else None,
                rigid_body="cf1",
            )
            server = vehicle_server("crazyflie", "127.0.0.1:0", options, context)
            servers[name] = await stack.enter_async_context(server)
        found.update({name: server.uri for name, server in servers.items()})
        ready.set()
        await asyncio.gather(*(server.serve(lambda _: None) for server in servers.values()))


def run(program: str, *arguments: str) -> Any:
    """What a program found."""
    done = subprocess.run(
        [sys.executable, str(PROGRAMS), program, *arguments],
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_it_flies_to_a_point_and_lands(uris: dict[str, str], endpoint: str) -> None:
    """With poses from the published motion capture, by the estimate that the vehicle reports."""
    found = run("fly", uris["brushed"], endpoint)
    assert found["highest"] == pytest.approx(0.5, abs=0.15)
    assert found["nearest"] < 0.1
    assert "Is flying" in found["flying"]
    assert found["landed"] == ["Is armed", "Is auto armed", "Can fly"]
    assert found["threads"] == []


def test_it_reads_writes_arms_stops_and_reboots(uris: dict[str, str]) -> None:
    found = run("talk", uris["brushless"])
    assert found["protocol"] == 12
    assert found["tables"] == [True, True]
    assert found["persistent"]
    assert found["values"] == ["0.5", "1"]
    assert found["stored"]
    assert found["state"] == {"is_stored": True, "default_value": 1, "stored_value": 2}
    assert found["default"] == pytest.approx(0.01)
    assert found["unarmed"] == ["Can be armed"]
    assert found["armed"] == ["Is armed", "Can fly"]
    assert found["spinning"]
    assert found["locked"]
    assert found["after"] == [False, "2"]


def test_it_knows_older_firmware(uris: dict[str, str]) -> None:
    found = run("older", uris["older"])
    assert found == {"protocol": 8, "info": 0b1010}
