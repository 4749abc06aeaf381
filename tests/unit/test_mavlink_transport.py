"""UDP, TCP and serial ports in a real event loop: nothing blocks, floods are taken in portions, all is given back."""

from __future__ import annotations

import asyncio
import contextlib
import os
import pty
import socket
import tty

import pytest

from drivers.mavlink.backlog import BACKLOG
from drivers.mavlink.peer import Peer
from drivers.mavlink.streams import SerialPort, Tcp
from drivers.mavlink.transport import DRAIN, Udp
from lcd_flight.model import RefusedError

pytestmark = pytest.mark.realtime


class Heard(list[tuple[bytes, Peer]]):
    def __call__(self, data: bytes, peer: Peer) -> None:
        self.append((data, peer))

    async def wait_for(self, count: int) -> None:
        for _ in range(500):
            if len(self) >= count:
                return
            await asyncio.sleep(0.01)
        raise AssertionError(f"{len(self)} of {count} came")


def test_udp_listens_and_answers_to_whom_it_is_told() -> None:
    async def main() -> None:
        transport, heard = Udp("127.0.0.1", 0, call=False), Heard()
        await transport.open(heard)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
            peer.bind(("127.0.0.1", 0))
            peer.settimeout(5.0)
            assert not transport.send(b"to nobody", None)
            peer.sendto(b"hello", ("127.0.0.1", transport.port))
            await heard.wait_for(1)
            assert heard[0] == (b"hello", peer.getsockname())
            assert transport.send(b"answer", heard[0][1])
            assert peer.recv(100) == b"answer"
        transport.close()
        transport.close()
        assert not transport.send(b"closed", ("127.0.0.1", 9))

    asyncio.run(main())


def test_udp_calls_first_where_it_is_told_to() -> None:
    async def main() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
            peer.bind(("127.0.0.1", 0))
            peer.settimeout(5.0)
            transport = Udp("127.0.0.1", peer.getsockname()[1], call=True)
            await transport.open(Heard())
            assert transport.send(b"anybody?", None)
            assert peer.recv(100) == b"anybody?"
            transport.close()

    asyncio.run(main())


def test_a_peer_that_refuses_packets_is_a_fault_that_is_counted() -> None:
    async def main() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as gone:
            gone.bind(("127.0.0.1", 0))
            port = gone.getsockname()[1]
        transport = Udp("127.0.0.1", port, call=True)
        await transport.open(Heard())
        for _ in range(20):
            transport.send(b"x", None)
            await asyncio.sleep(0.005)
        transport.close()

    asyncio.run(main())


def test_a_flood_is_taken_in_portions() -> None:
    async def main() -> None:
        transport, heard = Udp("127.0.0.1", 0, call=False), Heard()
        await transport.open(heard)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
            for _ in range(10 * DRAIN):
                peer.sendto(b"x", ("127.0.0.1", transport.port))
            portions = []
            for _ in range(3):
                before = len(heard)
                await asyncio.sleep(0)
                portions.append(len(heard) - before)
        assert max(portions) <= DRAIN
        transport.close()

    asyncio.run(main())


def test_a_port_in_use_is_refused() -> None:
    async def main() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            other.bind(("127.0.0.1", 0))
            transport = Udp("127.0.0.1", other.getsockname()[1], call=False)
            with pytest.raises(RefusedError, match=r"UDP port \d+ of 127\.0\.0\.1 is not to be had .*in use"):
                await transport.open(Heard())

    asyncio.run(main())


def test_a_host_that_is_not_there_is_refused() -> None:
    async def main() -> None:
        with pytest.raises(RefusedError, match=r"host\.invalid is not to be found"):
            await Udp("host.invalid", 14540, call=True).open(Heard())

    asyncio.run(main())


def test_tcp_there_and_back_and_a_closed_connection_is_a_fault() -> None:
    async def main() -> None:
        served = asyncio.Queue[bytes]()

        async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            served.put_nowait(await reader.read(100))
            writer.write(b"back")
            await writer.drain()
            writer.close()
            await writer.wait_closed()

        server = await asyncio.start_server(serve, "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        transport, heard = Tcp("127.0.0.1", port, 5.0), Heard()
        await transport.open(heard)
        assert transport.send(b"there", None)
        assert await asyncio.wait_for(served.get(), 5.0) == b"there"
        await heard.wait_for(1)
        assert heard[0][0] == b"back"
        for _ in range(200):
            if transport.faults:
                break
            await asyncio.sleep(0.01)
        assert transport.faults == 1
        assert not transport.send(b"again", None)
        transport.close()
        server.close()
        await server.wait_closed()

    asyncio.run(main())


def test_tcp_to_nobody_is_refused() -> None:
    async def main() -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        with pytest.raises(RefusedError, match="nobody accepts a connection at"):
            await Tcp("127.0.0.1", port, 2.0).open(Heard())

    asyncio.run(main())


def test_what_a_slow_reader_does_not_take_is_left_out_and_never_cut() -> None:
    """Packets of 100 bytes to somebody who does not read: what comes is whole and in order, the rest is counted."""

    async def main() -> None:
        with socket.socket() as listening:
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            listening.bind(("127.0.0.1", 0))
            listening.listen(1)
            transport = Tcp("127.0.0.1", listening.getsockname()[1], 5.0)
            await transport.open(Heard())
            other, _ = listening.accept()
            with other:
                other.setblocking(False)
                sent = [n for n in range(10_000) if transport.send(n.to_bytes(4, "big") * 25, None)]
                assert 0 < len(sent) < 10_000
                assert len(transport._backlog) <= BACKLOG
                received = bytearray()
                for _ in range(50):
                    await asyncio.sleep(0.01)
                    with contextlib.suppress(BlockingIOError):
                        received += other.recv(1 << 20)
            pieces = [bytes(received[at : at + 100]) for at in range(0, len(received), 100)]
            numbers = [int.from_bytes(piece[:4], "big") for piece in pieces]
            assert pieces == [number.to_bytes(4, "big") * 25 for number in numbers]
            assert numbers == sorted(set(numbers) & set(sent))
            assert len(numbers) + transport.faults == 10_000
            transport.close()

    asyncio.run(main())


def test_serial_there_and_back_for_us_alone() -> None:
    async def main() -> None:
        ours, theirs = pty.openpty()
        tty.setraw(theirs)
        path = os.ttyname(theirs)
        transport, heard = SerialPort(path, 921_600), Heard()
        await transport.open(heard)
        assert transport.send(b"there", None)
        assert os.read(ours, 100) == b"there"
        os.write(ours, b"back")
        await heard.wait_for(1)
        assert heard[0] == (b"back", (path, 0))
        with pytest.raises(RefusedError, match="is not to be had"):
            await SerialPort(path, 921_600).open(Heard())
        transport.close()
        os.close(ours)
        os.close(theirs)

    asyncio.run(main())


def test_a_serial_port_that_is_not_there_is_refused() -> None:
    async def main() -> None:
        with pytest.raises(RefusedError, match=r"serial port /dev/nowhere is not to be had \(No such file"):
            await SerialPort("/dev/nowhere", 921_600).open(Heard())

    asyncio.run(main())
