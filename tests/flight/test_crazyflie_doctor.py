"""`lcd doctor` looks at a simulated Crazyflie, says what it finds and changes nothing."""

from __future__ import annotations

import asyncio
import json
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from crazyflie_bench import CLOCK, bench

from lcd_flight.cli import main
from lcd_flight.model import InputError
from lcd_flight.plugins.links import inspect_link

pytestmark = pytest.mark.realtime


@contextmanager
def served(**options: object) -> Iterator[str]:
    """A vehicle in a thread of its own, for a command that runs an event loop itself."""
    uri: list[str] = []
    ready, done = threading.Event(), threading.Event()

    async def serve() -> None:
        async with bench(**options) as made:
            uri.append(made.path.uri)
            ready.set()
            while not done.is_set():
                await asyncio.sleep(0.02)

    thread = threading.Thread(target=lambda: asyncio.run(serve()))
    thread.start()
    try:
        assert ready.wait(30.0)
        yield uri[0]
    finally:
        done.set()
        thread.join()


def test_it_lists_what_is_there(capsys: pytest.CaptureFixture[str]) -> None:
    with served() as uri:
        assert main.run(main.app, ["doctor", "--link", uri, "--json"]) == 0
    found = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert found["outcome"] == "ok"
    assert found["platform"] == "Crazyflie 2.1"
    assert "2026.08" in found["firmware"]
    assert found["battery"].endswith(" V")
    assert any(text.startswith("flightmode.stabModeYaw is 0, flight sets 1") for text in found["differences"])
    assert found["problems"] == []


def test_what_speaks_against_flying_is_the_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    with served(battery_V=3.5, firmware="2024.10") as uri:
        assert main.run(main.app, ["doctor", "--link", uri]) == 3
    told = capsys.readouterr().err
    assert "the battery has 3." in told
    assert "older than thrust that is linear in force" in told


def test_it_changes_nothing() -> None:
    """Requests to read, log blocks, pings; no parameter written, no setpoint, no pose, no arming."""

    async def main() -> None:
        async with bench() as made:
            await inspect_link(made.path.uri, CLOCK)
            ports = {struct.unpack("B", data[:1])[0] >> 4 for data, up in made.path.seen if up}
            assert ports <= {0x2, 0x4, 0x5, 0xD, 0xF}
            assert made.path.sent_up(0x2E) == []
            assert all(data[1] in (1, 2) or data[0] == 0xDD for data in made.path.sent_up(0xDC))
            assert not made.left_over()

    asyncio.run(main())


def test_a_link_that_cannot_be_looked_at_is_said_to_be_one() -> None:
    with pytest.raises(InputError, match=r"there are: .*radio, udp, usb"):
        asyncio.run(inspect_link("sim://", CLOCK))
