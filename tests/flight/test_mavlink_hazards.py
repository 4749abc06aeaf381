"""What may not happen over the MAVLink link, whatever somebody else does at that moment: a stop, a pilot, a stall."""

from __future__ import annotations

import asyncio
import contextlib
import os
import pty
import socket
import time
from pathlib import Path

import pytest
from mavlink_bench import CLOCK, Bench, bench, level, run, stream, wait_s
from mavlink_specification import packet, signed

from drivers.mavlink.codec import Codec
from drivers.mavlink.link import MavlinkLink
from drivers.mavlink.sequence import LossCounter
from drivers.mavlink.setpoint_wire import attitude_target
from drivers.mavlink.streams import SerialPort, Tcp
from lcd_flight import plugins
from lcd_flight.flight.clock import RealClock
from lcd_flight.model import AttitudeThrust, Link, LinkContext, RefusedError
from lcd_flight.worlds import load_vehicle
from sim_bridge.mavlink.autopilot import Result

SETPOINT, COMMAND = 82, 76
ARM, SET_MODE = 400, 176
KEY = bytes(range(32))
HAS_ROOM_FOR = 60
"""Setpoints: the least receive buffer of a TCP connection holds some 25, and a little may be on the way."""
PX4_HEARTBEAT = {"type": 2, "autopilot": 12, "base_mode": 1, "system_status": 3, "mavlink_version": 3}


@pytest.fixture(autouse=True)
def own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Signing timestamps are kept here."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setenv("LCD_TEST_KEY", KEY.hex())
    return tmp_path


async def lift_off(made: Bench, link: MavlinkLink, height_m: float = 1.0) -> None:
    await link.arm()
    while made.height_m < height_m:
        await stream(link, level(1.15), 0.05)
    await stream(link, level(0.9), 0.5)
    await stream(link, level(1.0), 0.3)


def orders(made: Bench, command: int, since_ns: int) -> list[float]:
    """First parameters of the commands of one kind."""
    heard = Codec(1, 1).decode(bytearray(b"".join(data for _, data in made.air.sent(COMMAND, since_ns))))
    return [message.param1 for message in heard if message.command == command]


def test_nothing_is_armed_after_an_emergency_stop() -> None:
    """The stop comes while arming is refused and asked for again; then the vehicle would arm."""

    async def main() -> None:
        async with bench("ardupilot") as made, made.link() as link:
            pilot = made.vehicle.firmware.pilot
            arms, pilot.arming_problem = pilot.arming_problem, lambda: "Gyros inconsistent"  # type: ignore[method-assign]
            arming = asyncio.create_task(link.arm())
            await wait_s(2.5)
            stopped_ns = CLOCK.now_ns()
            link.stop_motors()
            await wait_s(0.3)
            pilot.arming_problem = arms  # type: ignore[method-assign]
            with pytest.raises(RefusedError):
                await arming
            await wait_s(1.0)
            assert 1.0 not in orders(made, ARM, stopped_ns)
            assert not made.armed

    run(main)


def test_a_stop_goes_on_where_the_vehicle_is_armed_again() -> None:
    async def main() -> None:
        async with bench() as made, made.link() as link:
            await link.arm()
            link.stop_motors()
            await wait_s(1.0)
            assert not made.armed
            made.vehicle.firmware.pilot.request_arm(True, True)
            await wait_s(0.5)
            assert not made.armed

    run(main)


def test_the_operator_can_stop_what_its_own_failsafe_flies() -> None:
    """Nobody else has it: our stream stopped, and the autopilot lands by itself."""

    async def main() -> None:
        async with bench() as made, made.link() as link:
            await lift_off(made, link, 2.0)
            await wait_s(1.2)
            assert "by itself" in link.report(CLOCK.now_ns()).taken_over
            assert made.armed
            link.stop_motors()
            await wait_s(0.3)
            assert not made.armed

    run(main)


def test_a_failsafe_is_told_from_a_pilot_and_can_be_stopped() -> None:
    """PX4 says CRITICAL in its heartbeat while a failsafe of its own has the vehicle, here that of the battery."""

    async def main() -> None:
        async with bench() as made, made.link() as link:
            made.vehicle.parameters.put("COM_LOW_BAT_ACT", 3)
            await lift_off(made, link, 1.5)
            made.vehicle.body.set_battery(3.0)
            report = await stream(link, level(1.0), 1.0)
            assert "by itself" in report.taken_over
            link.stop_motors()
            await wait_s(0.3)
            assert not made.armed

    run(main)


def test_a_pilot_who_takes_over_while_it_is_left_to_land_keeps_his_mode() -> None:
    """He is faster than the heartbeat that would have shown LAND."""

    async def main() -> None:
        async with bench(rc=True) as made:
            pilot = made.vehicle.firmware.pilot
            link = made.link()
            await link.__aenter__()
            await lift_off(made, link)
            leaving = asyncio.create_task(link.__aexit__(None, None, None))
            while made.mode != pilot.modes["land"]:
                await wait_s(0.004)
            pilot.request_mode(pilot.modes["posctl"])
            await wait_s(4.0)
            assert made.mode == pilot.modes["posctl"]
            pilot.request_arm(False, True)
            await leaving

    run(main)


def test_a_pilot_who_goes_back_from_offboard_is_not_asked_again() -> None:
    async def main() -> None:
        async with bench(rc=True) as made, made.link() as link:
            pilot = made.vehicle.firmware.pilot
            granted = pilot.request_mode

            def takes_back(mode: int) -> object:
                granted(mode)
                return granted(pilot.modes["posctl"])

            pilot.request_mode = takes_back  # type: ignore[method-assign,assignment]
            began_ns = CLOCK.now_ns()
            with pytest.raises(RefusedError):
                await link.arm()
            assert len(orders(made, SET_MODE, began_ns)) == 1

    run(main)


def test_an_autopilot_that_is_in_progress_for_ever_does_not_hang() -> None:
    def tampers(data: bytes, up: bool, _now_ns: int) -> list[bytes]:
        """Every acknowledgement of the mode becomes IN_PROGRESS."""
        if up or int.from_bytes(data[7:10], "little") != 77 or int.from_bytes(data[10:12], "little") != SET_MODE:
            return [data]
        told = {"command": SET_MODE, "result": 5, "target_system": 245, "target_component": 191}
        return [packet("COMMAND_ACK", told, data[4], (1, 1))]

    async def main() -> None:
        async with bench(tampers=tampers) as made, made.link() as link:
            pilot = made.vehicle.firmware.pilot
            pilot.request_mode = lambda _mode: Result.ACCEPTED  # type: ignore[method-assign]
            nagging = asyncio.create_task(nag(made))
            began_ns = CLOCK.now_ns()
            with pytest.raises(RefusedError):
                await link.arm()
            assert CLOCK.now_ns() - began_ns < 15e9
            nagging.cancel()

    async def nag(made: Bench) -> None:
        told = {"command": SET_MODE, "result": 5, "target_system": 245, "target_component": 191}
        while True:
            await wait_s(2.0)
            made.air.deliver(packet("COMMAND_ACK", told, 0, (1, 1)))

    run(main)


def test_a_disarm_on_the_ground_that_we_did_not_order_ends_the_stream() -> None:
    """Who arms it again in the same mode does not fly by our setpoints."""

    async def main() -> None:
        async with bench(rc=True) as made, made.link() as link:
            pilot = made.vehicle.firmware.pilot
            await link.arm()
            await stream(link, level(0.4), 0.3)
            pilot.request_arm(False, True)
            await stream(link, level(0.4), 0.3)
            disarmed_ns = CLOCK.now_ns()
            await stream(link, level(1.2), 0.5)
            assert made.air.sent(SETPOINT, disarmed_ns) == []
            pilot.request_arm(True, True)
            await stream(link, level(1.2), 1.5)
            assert made.height_m < 0.01

    run(main)


@pytest.mark.parametrize("what", ["a socket that refuses", "attitudes that are none"])
def test_what_is_not_sent_is_silence(what: str) -> None:
    async def main() -> None:
        async with bench() as made, made.link() as link:
            await lift_off(made, link)
            wanted = level(1.0)
            if what == "a socket that refuses":
                made.air.send = lambda _data, _peer: False  # type: ignore[method-assign]
            else:
                wanted = AttitudeThrust(wanted.thrust_N, (0.0, 0.0, 0.0, 1.2))
            report = await stream(link, wanted, 0.3)
            assert report.fallback_active

    run(main)


def test_the_kept_timestamp_is_never_behind_what_was_signed(own_state: Path) -> None:
    """A crash or a power cut comes without closing; the clock of a board without a battery then goes back."""

    async def main() -> None:
        async with bench() as made:
            made.vehicle._codec.signatures.key = KEY
            made.vehicle._unix_ns_at_zero = time.time_ns() - CLOCK.now_ns()
            async with made.link("signing=env:LCD_TEST_KEY"):
                await wait_s(60.0)
                (kept,) = (own_state / "lcd-flight").glob("mavlink-signing-*")
                newest = max(int.from_bytes(data[-12:-6], "little") for _, data in made.air.ups)
                assert int(kept.read_text()) >= newest

    run(main)


def test_an_outage_of_two_hundred_packets_is_loss_and_what_follows_is_heard() -> None:
    """Half a second at 400 packets a second, as PX4 sends them by USB."""
    counter, period_ns = LossCounter(), 2_500_000
    for number in range(100):
        counter.take(number, number * period_ns)
    heard = [counter.take(number % 256, number * period_ns) for number in range(308, 330)]
    assert all(heard)
    assert counter.lost == 208


def test_a_serial_port_without_data_stays_open() -> None:
    """A read that finds nothing is no end: pyserial opens ports so that it returns at once, with nothing."""

    async def main() -> None:
        theirs, ours = pty.openpty()
        port, heard = SerialPort(os.ttyname(ours), 921_600), bytearray()
        await port.open(lambda data, _peer: heard.extend(data))
        port._drain()
        os.write(theirs, b"\xfd")
        await asyncio.sleep(0.05)
        port.close()
        os.close(theirs)
        os.close(ours)
        assert heard == b"\xfd"

    asyncio.run(main())


def context() -> LinkContext:
    return LinkContext(load_vehicle("hummingbird"), RealClock(), (0.0, 0.0, 0.0), 0.0, seed=0)


def datagram_socket(host: str = "127.0.0.1") -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.bind((host, 0))
    made.setblocking(False)
    return made


async def connect(link: Link) -> None:
    with contextlib.suppress(RefusedError):
        async with link:
            pass


def test_setpoints_that_are_old_wait_nowhere_on_a_tcp_connection() -> None:
    """The other side does not read for a while; what it then gets may be what it had room for, and nothing older."""
    clock = RealClock()

    async def main() -> list[int]:
        with socket.socket() as server:
            server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
            server.bind(("127.0.0.1", 0))
            server.listen(1)
            link = Tcp("127.0.0.1", server.getsockname()[1], 2.0)
            await link.open(lambda _data, _peer: None)
            vehicle, _ = server.accept()
            codec, buffer = Codec(245, 191), bytearray()
            with vehicle:
                vehicle.setblocking(False)
                for _ in range(1000):
                    now_ns = clock.now_ns()
                    level_one = attitude_target((0.0, 0.0, 0.0, 1.0), 0.5, now_ns=now_ns, target=(1, 1), frame="enu")
                    link.send_now(codec.encode(level_one, now_ns), None)  # as a session sends setpoints
                    await asyncio.sleep(0.001)
                for _ in range(100):
                    await asyncio.sleep(0.01)
                    with contextlib.suppress(BlockingIOError):
                        buffer += vehicle.recv(65536)
            link.close()
        return [message.time_boot_ms for message in Codec(1, 1).decode(buffer)]

    stamps_ms = asyncio.run(main())
    assert len(stamps_ms) < HAS_ROOM_FOR


def test_who_is_called_is_the_only_one_that_is_heard() -> None:
    async def main() -> None:
        with datagram_socket() as vehicle, datagram_socket("127.0.0.2") as stranger:
            port = vehicle.getsockname()[1]
            uri = f"mavlink+udp://127.0.0.1:{port}?autopilot=px4&role=call&connect_s=3"
            connecting = asyncio.create_task(connect(plugins.open_link(uri, context())))
            loop = asyncio.get_running_loop()
            _, ours = await asyncio.wait_for(loop.sock_recvfrom(vehicle, 2048), 5.0)
            stranger.sendto(packet("HEARTBEAT", PX4_HEARTBEAT, 0, (1, 1)), ours)
            await connecting
            with pytest.raises(BlockingIOError):
                stranger.recv(2048)

    asyncio.run(main())


def test_a_signed_vehicle_whose_clock_is_behind_is_told_the_time() -> None:
    """Indoors there is no GPS, and few autopilots keep the date: its stamps are too old until it hears us."""
    hour_ago = round((time.time() - 3600.0 - 1_420_070_400) * 100_000)

    async def main() -> int:
        with datagram_socket() as vehicle, datagram_socket() as probe:
            port = probe.getsockname()[1]
            probe.close()
            uri = f"mavlink+udp://127.0.0.1:{port}?autopilot=px4&signing=env:LCD_TEST_KEY&connect_s=1"
            connecting, heard = asyncio.create_task(connect(plugins.open_link(uri, context()))), 0
            for number in range(8):
                told = packet("HEARTBEAT", PX4_HEARTBEAT, number, (1, 1), flags=1)
                vehicle.sendto(signed(told, KEY, 0, hour_ago + number), ("127.0.0.1", port))
                await asyncio.sleep(0.1)
                with contextlib.suppress(BlockingIOError):
                    heard += len(vehicle.recv(2048)) > 0
            await connecting
            return heard

    assert asyncio.run(main()) > 0
