"""The simulated MAVLink vehicle on its ports, and `lcd sim mavlink`."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import common

from lcd_flight.cli.main import app, run
from lcd_flight.flight.clock import RealClock
from lcd_flight.model import InputError, LinkContext, RefusedError
from lcd_flight.plugins.vehicle_servers import VehicleServer, vehicle_server
from lcd_flight.wire.mocap_frame import decode
from lcd_flight.worlds import load_vehicle
from sim_bridge.mavlink.ports import MOST_CLIENTS

LIMIT_S = 20.0
VERSION_WANTED = common.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0)


def context(published: list[bytes] | None = None) -> LinkContext:
    return LinkContext(
        vehicle=load_vehicle("hummingbird"),
        clock=RealClock(),
        initial_position_m=(1.0, 2.0, 0.0),
        initial_yaw_rad=0.0,
        seed=0,
        publish_pose=None if published is None else published.append,
        rigid_body="body",
    )


def open_server(address: str = "127.0.0.1:0", given: LinkContext | None = None, **options: str) -> VehicleServer:
    return vehicle_server("mavlink", address, options, given or context())


@contextlib.asynccontextmanager
async def living(server: VehicleServer) -> AsyncIterator[VehicleServer]:
    """It serves meanwhile."""
    async with server:
        task = asyncio.create_task(server.serve(lambda _: None))
        yield server
        assert not task.done()
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


def udp_socket() -> socket.socket:
    client = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    client.bind(("127.0.0.1", 0))
    client.setblocking(False)
    return client


def place(server: VehicleServer) -> tuple[str, int]:
    host, _, port = server.uri.partition("://")[2].rpartition(":")
    return host, int(port)


async def hear(client: socket.socket, kind: int) -> Any:
    """The next message of a kind."""
    loop, codec = asyncio.get_running_loop(), common.MAVLink(None)
    async with asyncio.timeout(LIMIT_S):
        while True:
            message = codec.decode(bytearray(await loop.sock_recv(client, 300)))
            if message.get_msgId() == kind:
                return message


def test_it_sends_heartbeats_to_where_clients_listen() -> None:
    async def script() -> None:
        with udp_socket() as client:
            async with living(open_server(f"127.0.0.1:{client.getsockname()[1]}")):
                assert (await hear(client, 0)).autopilot == common.MAV_AUTOPILOT_PX4

    asyncio.run(script())


def test_it_answers_whoever_talks_to_it() -> None:
    async def script() -> None:
        async with living(open_server(flavour="ardupilot")) as server:
            with udp_socket() as client:
                client.sendto(VERSION_WANTED.pack(common.MAVLink(None, srcSystem=245)), place(server))
                assert (await hear(client, 148)).flight_sw_version >> 24 == 4

    asyncio.run(script())


def test_clients_are_bounded_and_one_that_has_gone_does_no_harm() -> None:
    async def script() -> None:
        async with living(open_server()) as server:
            for _ in range(3 * MOST_CLIENTS):
                with udp_socket() as client:
                    client.sendto(b"x", place(server))
                    await hear(client, 30)
            assert len(server._port._talkers) <= MOST_CLIENTS  # type: ignore[attr-defined]

    asyncio.run(script())


def test_over_tcp_packets_are_cut_out_of_the_stream() -> None:
    async def script() -> None:
        async with living(open_server("tcp:127.0.0.1:0", flavour="ardupilot")) as server:
            host, port = place(server)
            reader, writer = await asyncio.open_connection(host, port)
            packet = VERSION_WANTED.pack(common.MAVLink(None, srcSystem=245))
            for part in (b"noise" + packet[:7], packet[7:20], packet[20:] + packet):
                writer.write(part)
                await writer.drain()
                await asyncio.sleep(0.02)
            codec, seen = common.MAVLink(None), 0
            async with asyncio.timeout(LIMIT_S):
                while seen < 2:
                    messages = codec.parse_buffer(await reader.read(300)) or []
                    seen += sum(message.get_msgId() == 148 for message in messages)
            writer.close()
            await writer.wait_closed()

    asyncio.run(script())


def test_its_pose_is_published() -> None:
    published: list[bytes] = []

    async def script() -> None:
        async with living(open_server(given=context(published), noise_mm="1")):
            while len(published) < 20:
                await asyncio.sleep(0.01)

    asyncio.run(asyncio.wait_for(script(), LIMIT_S))
    frames = [decode(data) for data in published]
    assert {frame.body for frame in frames} == {"body"}
    assert [frame.sequence for frame in frames[:3]] == [0, 1, 2]
    assert frames[0].position == pytest.approx((1.0, 2.0, 0.0), abs=0.01)


@pytest.mark.parametrize("address", ["127.0.0.1", "127.0.0.1:", ":1", "127.0.0.1:99999", "127.0.0.1:x", "tcp:x"])
def test_what_is_no_address(address: str) -> None:
    with pytest.raises(InputError, match="is not HOST:PORT"):
        open_server(address)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"drop": "1.5"}, "drop=1.5"),
        ({"speed": "2"}, "unknown option speed=2"),
        ({"flavour": "betaflight"}, "flavour=betaflight"),
        ({"key_file": "no-such-key"}, "key file no-such-key: No such file"),
    ],
)
def test_what_is_no_option(options: dict[str, str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        open_server(**options)


def test_a_tcp_port_that_is_taken_is_refused_with_the_remedy() -> None:
    async def script(port: int) -> None:
        async with open_server(f"tcp:127.0.0.1:{port}"):
            raise AssertionError

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(RefusedError, match="choose another port with --port"):
            asyncio.run(script(taken.getsockname()[1]))


def test_a_host_that_there_is_not_is_refused() -> None:
    async def script() -> None:
        async with open_server("no-such-host.invalid:14540"):
            raise AssertionError

    with pytest.raises(RefusedError, match="cannot be sent to"):
        asyncio.run(script())


class TestCommand:
    def lcd(self, capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, dict[str, Any], str]:
        code = run(app, ["sim", "mavlink", "--port", "0", "--json", *arguments])
        out, err = capsys.readouterr()
        return code, json.loads(out.splitlines()[-1]), err

    @pytest.mark.parametrize(
        ("flavour", "vehicle", "events"),
        [
            ("px4", "PX4 on x500, system 1", ["disarmed, loiter"]),
            ("ardupilot", "ArduCopter on x500, system 1", ["disarmed, stabilize"]),
        ],
    )
    def test_it_serves_for_as_long_as_it_is_told(
        self, capsys: pytest.CaptureFixture[str], flavour: str, vehicle: str, events: list[str]
    ) -> None:
        code, told, err = self.lcd(capsys, "--flavour", flavour, "--mocap", "none", "--seconds", "0.3")
        assert (code, told["outcome"], told["vehicle"], told["events"]) == (0, "ok", vehicle, events)
        assert told["uri"] in err

    @pytest.mark.parametrize(("name", "maker"), [("px4", "PX4"), ("ardupilot", "ArduCopter")])
    def test_a_mission_says_where_it_stands_and_which_it_is(
        self, capsys: pytest.CaptureFixture[str], tmp_path: Path, name: str, maker: str
    ) -> None:
        source = Path(f"missions/bench_{name}.yaml").read_text()
        mission = tmp_path / "bench.yaml"
        mission.write_text(source.replace("tcp://127.0.0.1:5555", f"ipc://{tmp_path}/poses"))
        code, told, err = self.lcd(capsys, str(mission), "--seconds", "0.1")
        assert code == 0
        assert told["vehicle"].startswith(maker)
        assert f"poses of body at ipc://{tmp_path}/poses" in err

    @pytest.mark.parametrize(
        ("arguments", "error"),
        [
            (("--flavour", "betaflight"), "flavour=betaflight"),
            (("--with", "speed=2"), "unknown option speed=2"),
            (("--with", "wrong=NO_SUCH:1"), "no parameter 'NO_SUCH'"),
            (("--vehicle", "zeppelin"), "zeppelin"),
            (("no-such-mission.yaml",), "no-such-mission.yaml"),
        ],
    )
    def test_what_is_wrong_is_told(
        self, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], error: str
    ) -> None:
        code, told, _ = self.lcd(capsys, "--mocap", "none", "--seconds", "0.1", *arguments)
        assert code == 2
        assert error in told["error"]
