"""The simulated Crazyflie on its UDP port, and `lcd sim crazyflie`."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import socket
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from lcd_flight.cli.main import app, run
from lcd_flight.cli.terminal import Terminal
from lcd_flight.flight.clock import RealClock
from lcd_flight.model import InputError, LinkContext, RefusedError
from lcd_flight.plugins.vehicle_servers import VehicleServer, vehicle_server
from lcd_flight.wire.mocap_frame import decode
from lcd_flight.worlds import load_vehicle

LIMIT_S = 20.0
PING = bytes.fromhex("FC 00 01")


def context(published: list[bytes] | None = None, vehicle: str = "crazyflie-2.1") -> LinkContext:
    return LinkContext(
        vehicle=load_vehicle(vehicle),
        clock=RealClock(),
        initial_position_m=(1.0, 2.0, 0.0),
        initial_yaw_rad=0.0,
        seed=0,
        publish_pose=None if published is None else published.append,
        rigid_body="cf7",
    )


def open_server(address: str = "127.0.0.1:0", given: LinkContext | None = None, **options: str) -> VehicleServer:
    return vehicle_server("crazyflie", address, options, given or context())


@contextlib.asynccontextmanager
async def serving(server: VehicleServer) -> AsyncIterator[socket.socket]:
    """A client's socket to a vehicle that lives."""
    loop = asyncio.get_running_loop()
    async with server:
        task = loop.create_task(server.serve(lambda _: None))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.setblocking(False)
            host, _, port = server.uri.removeprefix("udp://").rpartition(":")
            client.connect((host, int(port)))
            yield client
        assert not task.done()
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def ask(client: socket.socket, datagram: bytes) -> bytes:
    loop = asyncio.get_running_loop()
    await loop.sock_sendall(client, datagram)
    return await asyncio.wait_for(loop.sock_recv(client, 64), LIMIT_S)


def test_it_answers_a_scan_and_a_ping() -> None:
    async def script() -> None:
        async with serving(open_server()) as client:
            assert await ask(client, b"\xff") == b"\xff"
            assert await ask(client, PING) == PING

    asyncio.run(script())


def test_whoever_spoke_last_is_the_client() -> None:
    async def script() -> None:
        server = open_server()
        async with serving(server) as first:
            assert await ask(first, PING) == PING
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as second:
                second.setblocking(False)
                second.connect(first.getpeername())
                assert await ask(second, PING) == PING
            assert await ask(first, PING) == PING  # the second has gone: what was refused there does no harm

    asyncio.run(script())


def test_its_pose_is_published() -> None:
    published: list[bytes] = []

    async def script() -> None:
        async with serving(open_server(given=context(published), noise_mm="1")):
            while len(published) < 20:
                await asyncio.sleep(0.01)

    asyncio.run(asyncio.wait_for(script(), LIMIT_S))
    frames = [decode(data) for data in published]
    assert {frame.body for frame in frames} == {"cf7"}
    assert [frame.sequence for frame in frames[:3]] == [0, 1, 2]
    assert frames[0].position == pytest.approx((1.0, 2.0, 0.0), abs=0.01)
    assert all(frame.source_time_ns <= frame.send_time_ns for frame in frames)


@pytest.mark.parametrize("address", ["127.0.0.1", "127.0.0.1:", ":1", "127.0.0.1:99999", "127.0.0.1:x"])
def test_what_is_no_address(address: str) -> None:
    with pytest.raises(InputError, match="is not HOST:PORT"):
        open_server(address)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"drop": "1.5"}, "drop=1.5"),
        ({"speed": "2"}, "unknown option speed=2"),
        ({"firmware": "1.0"}, "there are: 2026.08, 2024.10"),
    ],
)
def test_what_is_no_option(options: dict[str, str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        open_server(**options)


def test_a_vehicle_that_flies_no_setpoints() -> None:
    with pytest.raises(InputError, match="onboard controller"):
        open_server(given=context(vehicle="hummingbird"))


def test_a_port_that_is_taken_is_refused_with_the_remedy() -> None:
    async def script(port: int) -> None:
        async with open_server(f"127.0.0.1:{port}"):
            raise AssertionError

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        with pytest.raises(RefusedError, match="choose another port with --port"):
            asyncio.run(script(taken.getsockname()[1]))


def test_an_unknown_vehicle_says_which_there_are() -> None:
    with pytest.raises(InputError, match=r"there are: .*crazyflie"):
        vehicle_server("zeppelin", "127.0.0.1:0", {}, context())


class TestCommand:
    def lcd(self, capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, dict[str, Any], str]:
        code = run(app, ["sim", "crazyflie", "--port", "0", "--json", *arguments])
        out, err = capsys.readouterr()
        return code, json.loads(out.splitlines()[-1]), err

    def test_it_serves_for_as_long_as_it_is_told(self, capsys: pytest.CaptureFixture[str]) -> None:
        code, told, err = self.lcd(capsys, "--mocap", "none", "--seconds", "0.3")
        assert code == 0
        assert told["outcome"] == "ok"
        assert told["vehicle"] == "Crazyflie 2.1, firmware 2026.08 (protocol 12)"
        assert told["events"] == ["armed"]
        assert told["uri"] in err

    @pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
    def test_a_signal_ends_it_well(
        self, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, number: signal.Signals
    ) -> None:
        """Sent once the vehicle has told of itself, when the signal is surely listened to."""

        def line(_terminal: Terminal, label: str, _text: str) -> None:
            if label == "VEHICLE":
                os.kill(os.getpid(), number)

        monkeypatch.setattr(Terminal, "line", line)
        code, told, _ = self.lcd(capsys, "--mocap", "none", "--seconds", str(LIMIT_S))
        assert (code, told["outcome"], told["events"]) == (0, "ok", ["armed"])

    def test_a_mission_says_where_it_stands(self, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
        source = Path("missions/bench_crazyflie.yaml").read_text()
        mission = tmp_path / "bench.yaml"
        mission.write_text(source.replace("tcp://127.0.0.1:5555", f"ipc://{tmp_path}/poses"))
        code, _, err = self.lcd(capsys, str(mission), "--seconds", "0.1")
        assert code == 0
        assert f"poses of cf1 at ipc://{tmp_path}/poses" in err

    @pytest.mark.parametrize(
        ("arguments", "code", "error"),
        [
            (("--platform", "4"), 2, "platform '4' is not simulated"),
            (("--vehicle", "hummingbird"), 2, "onboard controller"),
            (("--mocap", "carrier-pigeon"), 2, "not one such as tcp://HOST:PORT"),
            (("no-such-mission.yaml",), 2, "no-such-mission.yaml"),
        ],
    )
    def test_what_is_wrong_is_told(
        self, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], code: int, error: str
    ) -> None:
        found, told, _ = self.lcd(capsys, "--seconds", "0.1", *arguments)
        assert found == code
        assert error in told["error"]
