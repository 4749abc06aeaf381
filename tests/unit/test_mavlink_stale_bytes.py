"""Old setpoints wait nowhere: what TCP and serial ports still hold is asked for before each."""

from __future__ import annotations

import asyncio
import contextlib
import os
import pty
import socket
import tty
from collections.abc import AsyncIterator, Iterator

import pytest

from drivers.mavlink import streams
from drivers.mavlink.backlog import BACKLOG, WAIT_S, Backlog
from drivers.mavlink.codec import Codec
from drivers.mavlink.dialect import Message, mavlink
from drivers.mavlink.session import Session
from drivers.mavlink.setpoint_wire import attitude_target
from drivers.mavlink.streams import HOLD_S, QUIET_S, SerialPort, Tcp
from lcd_flight.flight.clock import RealClock

CLOCK = RealClock()
VEHICLE = (1, 1)
SIZE = 100


class TestBacklog:
    def test_age_is_that_of_the_oldest_byte_still_held(self) -> None:
        backlog = Backlog()
        for second in range(4):
            backlog.note(10, float(second))
        assert backlog.age_s(40, 4.0) == 4.0
        assert backlog.age_s(31, 4.0) == 4.0
        assert backlog.age_s(30, 4.0) == 3.0
        assert backlog.age_s(1, 4.0) == 1.0
        assert backlog.age_s(0, 4.0) == 0.0

    def test_what_waits_too_long_is_left_out_but_never_cut(self) -> None:
        backlog = Backlog()
        backlog.add(b"begun", 0.0)
        backlog.add(b"whole", 0.0)
        backlog.add(b"later", WAIT_S)
        assert backlog.next(0.0) == b"begun"
        backlog.take(2)
        assert backlog.next(2 * WAIT_S) == b"gun"
        backlog.take(3)
        assert backlog.next(2 * WAIT_S) == b"later"
        assert backlog.dropped == 1

    def test_bytes_that_were_not_taken_have_not_begun(self) -> None:
        backlog = Backlog()
        backlog.add(b"packet", 0.0)
        backlog.take(0)
        assert backlog.next(1.0) == b""

    def test_memory_is_bounded_where_nobody_asks(self) -> None:
        backlog = Backlog()
        for number in range(10 * BACKLOG):
            backlog.note(1, float(number))
        assert len(backlog._writes) == BACKLOG


@contextlib.asynccontextmanager
async def tcp(receive_buffer: int | None = None) -> AsyncIterator[tuple[Tcp, socket.socket]]:
    """Our end of a connection, and the vehicle's, which reads only what the test reads."""
    with socket.socket() as listening:
        if receive_buffer is not None:
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        listening.bind(("127.0.0.1", 0))
        listening.listen(1)
        transport = Tcp("127.0.0.1", listening.getsockname()[1], 5.0)
        await transport.open(lambda _data, _peer: None)
        vehicle, _ = listening.accept()
    with vehicle:
        vehicle.setblocking(False)
        yield transport, vehicle
    transport.close()


async def read_all(vehicle: socket.socket) -> bytes:
    """What comes within a while of reading."""
    data = bytearray()
    for _ in range(60):
        await asyncio.sleep(0.01)
        with contextlib.suppress(BlockingIOError):
            data += vehicle.recv(1 << 20)
    return bytes(data)


def setpoint() -> Message:
    return attitude_target((0.0, 0.0, 0.0, 1.0), 0.5, now_ns=CLOCK.now_ns(), target=VEHICLE, frame="enu")


async def fill(transport: Tcp) -> None:
    """Until the other side's buffer and window are full."""
    for _ in range(2000):
        if not transport.send_now(bytes(SIZE), None):
            return
        await asyncio.sleep(0)
    raise AssertionError("a window without end")


@pytest.mark.realtime
class TestTcp:
    def test_after_a_stall_the_first_setpoint_to_arrive_is_a_fresh_one(self) -> None:
        """A window that is full for a second of setpoints, poses and commands: nothing of ours waited for its end."""

        async def main() -> tuple[list[Message], int, int]:
            async with tcp(receive_buffer=1024) as (transport, vehicle):
                session = Session(transport, Codec(245, 191), CLOCK, VEHICLE)
                await fill(transport)
                before, went = transport.faults, 0
                for _ in range(100):
                    went += session.send(setpoint()) is not None
                    session.send(mavlink.MAVLink_command_long_message(*VEHICLE, 400, 0, *(0.0,) * 7))
                    await asyncio.sleep(0.01)
                assert transport.faults - before >= 100  # each setpoint that was left out is counted
                resumed_ms = CLOCK.now_ns() // 1_000_000
                data = await read_all(vehicle)
                vehicle.send(b"alive")
                await asyncio.sleep(0.02)
                assert session.send(setpoint()) is not None
                data += await read_all(vehicle)
                messages = Codec(1, 1).decode(bytearray(data))
                return messages, went, resumed_ms

        messages, went, resumed_ms = asyncio.run(main())
        assert went == 0
        targets = [m for m in messages if m.get_type() == "SET_ATTITUDE_TARGET"]
        assert [m.time_boot_ms >= resumed_ms % 2**32 for m in targets] == [True]
        commands = [m for m in messages if m.get_type() == "COMMAND_LONG"]
        assert len(commands) * 40 <= BACKLOG

    def test_behind_what_is_unsent_the_system_is_given_nothing(self) -> None:
        """From the first packet on that did not fit into the other side's window, however short ago that was."""

        async def main() -> list[int]:
            async with tcp(receive_buffer=1024) as (transport, _vehicle):
                await fill(transport)
                assert transport.send(bytes(SIZE), None)
                assert transport._file is not None
                return [streams._asked(transport._file, streams._UNSENT), len(transport._backlog)]

        unsent, waits = asyncio.run(main())
        assert 0 < unsent <= SIZE
        assert waits == SIZE

    def test_commands_of_a_long_stall_are_left_out_too(self) -> None:
        async def main() -> bytes:
            async with tcp(receive_buffer=1024) as (transport, vehicle):
                await fill(transport)
                assert transport.send(b"old!" * 10, None)
                await asyncio.sleep(WAIT_S + 0.1)
                assert transport.send(b"new!" * 10, None)
                return await read_all(vehicle)

        data = asyncio.run(main())
        assert b"old!" not in data
        assert data.endswith(b"new!" * 10)

    def test_who_acknowledges_late_gets_all(self) -> None:
        """Acknowledgements that are delayed by up to 40 ms, and reports at 20 Hz, are no stall."""

        async def main() -> int:
            async with tcp() as (transport, vehicle):
                for tick in range(60):
                    if tick % 5 == 0:
                        vehicle.send(b"report")
                    transport.send_now(bytes(SIZE), None)
                    await asyncio.sleep(0.01)
                return len(await read_all(vehicle)) // SIZE

        assert asyncio.run(main()) >= 50  # a machine under load may stall by itself

    def test_who_stands_still_with_room_for_all_gets_a_tenth_of_a_second(self) -> None:
        """Its system takes and acknowledges what its autopilot does not read: that it says nothing is all we see."""

        async def main() -> tuple[int, bool]:
            async with tcp() as (transport, vehicle):
                for _ in range(100):
                    transport.send_now(bytes(SIZE), None)
                    await asyncio.sleep(0.01)
                got = len(await read_all(vehicle)) // SIZE
                vehicle.send(b"here again")
                await asyncio.sleep(0.02)
                return got, transport.send_now(bytes(SIZE), None)

        got, again = asyncio.run(main())
        assert 0 < got <= 100 * QUIET_S + 1
        assert again

    def test_a_closed_connection_takes_nothing(self) -> None:
        async def main() -> None:
            async with tcp() as (transport, _vehicle):
                transport.close()
                assert not transport.send_now(b"x", None)
                assert not transport.send(b"x", None)

        asyncio.run(main())


@pytest.fixture
def line() -> Iterator[tuple[int, str]]:
    """A serial line: the file at the vehicle's end, and the name of ours."""
    theirs, ours = pty.openpty()
    tty.setraw(ours)
    yield theirs, os.ttyname(ours)
    for file in (theirs, ours):
        with contextlib.suppress(OSError):
            os.close(file)


@contextlib.asynccontextmanager
async def serial(path: str, baud: int = 921_600) -> AsyncIterator[tuple[SerialPort, bytearray]]:
    heard = bytearray()
    port = SerialPort(path, baud)
    await port.open(lambda data, _peer: heard.extend(data))
    yield port, heard
    port.close()


@pytest.mark.realtime
class TestSerial:
    def test_reading_nothing_is_not_the_end(self, line: tuple[int, str]) -> None:
        async def main() -> None:
            async with serial(line[1]) as (port, heard):
                for _ in range(200):
                    port._drain()
                os.write(line[0], b"still here")
                await asyncio.sleep(0.05)
                assert heard == b"still here"
                assert port.faults == 0

        asyncio.run(main())

    def test_a_cable_that_is_pulled_is_the_end(self, line: tuple[int, str]) -> None:
        async def main() -> None:
            async with serial(line[1]) as (port, _heard):
                os.close(line[0])
                for _ in range(100):
                    await asyncio.sleep(0.01)
                    if port.faults:
                        break
                assert port.faults == 1
                assert not port.send_now(b"x", None)

        asyncio.run(main())

    def test_a_line_that_stands_still_gets_no_setpoint(self, line: tuple[int, str]) -> None:
        async def main() -> None:
            async with serial(line[1]) as (port, _heard):
                while len(port._backlog) == 0:  # nobody reads: the system takes no more
                    assert port.send(bytes(SIZE), None)
                faults = port.faults
                assert not port.send_now(bytes(SIZE), None)
                assert port.faults == faults + 1

        asyncio.run(main())

    @pytest.mark.parametrize(("baud", "bytes_in_50_ms"), [(230_400, 1152), (921_600, 4608)])
    def test_no_more_than_50_ms_of_bytes_are_before_a_setpoint(
        self, line: tuple[int, str], monkeypatch: pytest.MonkeyPatch, baud: int, bytes_in_50_ms: int
    ) -> None:
        """A pseudo-terminal holds nothing itself, so the system's answer is given here."""

        async def main() -> list[bool]:
            async with serial(line[1], baud) as (port, _heard):
                went = []
                for held in (0, bytes_in_50_ms, bytes_in_50_ms + 1):
                    monkeypatch.setattr(streams, "_asked", lambda _file, _request, held=held: held)
                    went.append(port.send_now(b"x", None))
                return went

        assert asyncio.run(main()) == [True, True, False]

    def test_bytes_that_are_held_for_long_are_a_stall_however_few(
        self, line: tuple[int, str], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        async def main() -> list[bool]:
            async with serial(line[1]) as (port, _heard):
                monkeypatch.setattr(streams, "_asked", lambda _file, _request: 1)
                first = port.send_now(b"x", None)
                await asyncio.sleep(HOLD_S + 0.01)
                return [first, port.send_now(b"y", None)]

        assert asyncio.run(main()) == [True, False]
