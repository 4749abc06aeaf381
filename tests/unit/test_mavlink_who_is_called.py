"""role=call: the host that is called is the vehicle or nobody, whatever others send us first."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator, Iterator

import pytest

from drivers.mavlink.codec import Codec
from drivers.mavlink.contact import Contact
from drivers.mavlink.dialect import mavlink
from drivers.mavlink.options import MavlinkOptions
from drivers.mavlink.peer import Peer
from drivers.mavlink.transport import Udp, transport_to
from lcd_flight.flight.clock import RealClock
from lcd_flight.model import RefusedError

pytestmark = pytest.mark.realtime
HEARTBEAT = mavlink.MAVLink_heartbeat_message(2, 12, 1, 0, 3, 3)


def on(host: str) -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.bind((host, 0))
    made.setblocking(False)
    return made


@pytest.fixture
def vehicle() -> Iterator[socket.socket]:
    with on("127.0.0.1") as made:
        yield made


@pytest.fixture
def stranger() -> Iterator[socket.socket]:
    with on("127.0.0.2") as made:
        yield made


@contextlib.asynccontextmanager
async def calling(port: int, host: str = "127.0.0.1") -> AsyncIterator[tuple[Contact, Udp]]:
    options = MavlinkOptions(autopilot="px4", role="call", connect_s=0.3)
    transport = transport_to("mavlink+udp", f"{host}:{port}", options)
    assert isinstance(transport, Udp)
    contact = Contact(f"mavlink+udp://{host}:{port}", options, RealClock(), transport)
    yield contact, transport
    contact.close()


async def hear(sender: socket.socket, port: int) -> None:
    sender.sendto(Codec(1, 1).encode(HEARTBEAT, 0), ("127.0.0.1", port))
    await asyncio.sleep(0.05)


def address(of: socket.socket) -> Peer:
    host, port = of.getsockname()
    return (host, port)


def test_a_heartbeat_from_another_host_is_nobodys(vehicle: socket.socket, stranger: socket.socket) -> None:
    async def main() -> None:
        async with calling(address(vehicle)[1]) as (contact, transport):
            await contact.session.open()
            await hear(stranger, transport.port)
            assert contact.session.peer is None
            contact.session.beat(1 << 40)
            with pytest.raises(BlockingIOError):
                stranger.recv(100)
            assert vehicle.recv(100)

    asyncio.run(main())


def test_the_refusal_names_it(vehicle: socket.socket, stranger: socket.socket) -> None:
    """A vehicle with two addresses may answer from the other: then it must be called there."""

    async def main() -> None:
        async with calling(address(vehicle)[1]) as (contact, transport):
            finding = asyncio.create_task(contact.find())
            while not transport.port:
                await asyncio.sleep(0.01)
            await hear(stranger, transport.port)
            with pytest.raises(RefusedError, match=r"no heartbeat from system 1 .* but from the address 127\.0\.0\.2"):
                await finding

    asyncio.run(main())


def test_the_host_may_answer_from_another_port_and_be_called_by_name(vehicle: socket.socket) -> None:
    async def main() -> None:
        async with calling(address(vehicle)[1], "localhost") as (contact, transport):
            await contact.session.open()
            with on("127.0.0.1") as other_port:
                await hear(other_port, transport.port)
                assert contact.session.peer == address(other_port)

    asyncio.run(main())


def test_who_listens_hears_any_host(stranger: socket.socket) -> None:
    async def main() -> None:
        options = MavlinkOptions(autopilot="px4")
        transport = Udp("127.0.0.1", 0, call=False)
        contact = Contact("mavlink+udp://0.0.0.0:0", options, RealClock(), transport)
        await contact.session.open()
        await hear(stranger, transport.port)
        assert contact.session.peer == address(stranger)
        contact.close()

    asyncio.run(main())
