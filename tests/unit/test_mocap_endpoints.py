"""What a user is told about an endpoint that is not to be had; ZeroMQ details that the contract does not show."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import time

import pytest

from lcd_flight.flight import virtual_time
from lcd_flight.flight.clock import RealClock
from lcd_flight.flight.virtual_time import VirtualClock
from lcd_flight.model import InputError, PoseOptions, PoseReport, RefusedError
from lcd_flight.wire.mocap_frame import MocapFrame, encode
from mocap import loopback, zmq_source
from mocap.zmq_publisher import open_publisher
from mocap.zmq_source import open_source

CLOCK = RealClock()


def frame_bytes(sequence: int, stamp_ns: int) -> bytes:
    return encode(
        MocapFrame(
            body="cf1",
            sequence=sequence,
            frame_number=sequence,
            source_time_ns=stamp_ns,
            send_time_ns=stamp_ns,
            clock_id="host",
            position=(1e-6 * sequence, 0.0, 1.0),
            quaternion=(0.0, 0.0, 0.0, 1.0),
        )
    )


@pytest.mark.parametrize(
    ("endpoint", "message"),
    [
        (
            "tcp://192.0.2.1:5555",
            "motion capture endpoint tcp://192.0.2.1:5555 is not an address of this machine: "
            "set motion_capture.endpoint to one of its own",
        ),
        (
            "ipc:///no/such/folder/mocap",
            "motion capture endpoint ipc:///no/such/folder/mocap cannot be opened (No such file or directory): "
            "write it as tcp://HOST:PORT or ipc://FILE",
        ),
        (
            "carrier://pigeon",
            "motion capture endpoint carrier://pigeon cannot be opened (Protocol not supported): "
            "write it as tcp://HOST:PORT or ipc://FILE",
        ),
    ],
)
def test_a_publisher_that_cannot_bind_says_why(endpoint: str, message: str) -> None:
    with pytest.raises(RefusedError) as caught:
        open_publisher(endpoint)
    assert str(caught.value) == message


@pytest.mark.parametrize("endpoint", ["tcp://*:5555", "carrier://pigeon"])
def test_a_source_that_cannot_connect_says_why(endpoint: str) -> None:
    async def main() -> None:
        async with open_source(endpoint, "cf1", CLOCK, PoseOptions()):
            pytest.fail("connected")

    with pytest.raises(RefusedError, match=r"cannot be opened .*: write it as tcp://HOST:PORT"):
        asyncio.run(main())


@pytest.mark.parametrize("endpoint", ["tcp://127.0.0.1:70000", "tcp://127.0.0.1", "tcp://host:", "tcp://host:-1"])
def test_a_port_that_is_none_is_refused_instead_of_wrapped(endpoint: str) -> None:
    with pytest.raises(InputError, match="the port must be a number from 0 to 65535"):
        open_publisher(endpoint)
    with pytest.raises(InputError, match="the port must be a number from 0 to 65535"):
        open_source(endpoint, "cf1", CLOCK, PoseOptions())


def test_a_flood_is_taken_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zmq_source, "_DRAIN_LIMIT", 3)

    async def main() -> list[int]:
        with contextlib.closing(open_publisher("tcp://127.0.0.1:0")) as publish:
            async with open_source(publish.endpoint, "cf1", CLOCK, PoseOptions()) as source:
                sequence = 0
                while source.report(0).received == 0:
                    publish(frame_bytes(sequence, sequence))
                    sequence += 1
                    await asyncio.sleep(0.005)
                counts = [source.report(0).received]
                for n in range(10):
                    publish(frame_bytes(sequence + n, sequence + n))
                give_up = time.monotonic() + 20.0
                while counts[-1] < counts[0] + 10 and time.monotonic() < give_up:
                    time.sleep(0.01)  # the event loop stands still: reports alone drain
                    counts.append(source.report(0).received)
                return counts

    counts = asyncio.run(main())
    assert counts[-1] == counts[0] + 10
    assert max(b - a for a, b in itertools.pairwise(counts)) <= 3


def test_closing_takes_the_socket_out_of_the_event_loop() -> None:
    async def main() -> None:
        async with open_source("tcp://127.0.0.1:9", "cf1", CLOCK, PoseOptions()) as source:
            assert source._socket is not None
            descriptor = source._socket.fileno()
        assert not asyncio.get_running_loop().remove_reader(descriptor)

    asyncio.run(main())


def test_the_loopback_is_deterministic_in_virtual_time() -> None:
    def flight() -> list[PoseReport]:
        clock, reports = VirtualClock(), []

        async def main() -> None:
            publish = loopback.open_publisher("loopback://virtual")
            async with loopback.open_source("loopback://virtual", "cf1", clock, PoseOptions()) as source:
                for n in range(100):
                    await clock.sleep_until(n * 10_000_000)
                    publish(frame_bytes(n, clock.now_ns()))
                    await clock.sleep_until(n * 10_000_000 + 3_000_000)
                    reports.append(source.report(clock.now_ns()))
            publish.close()

        virtual_time.run(main())
        return reports

    first = flight()
    assert first == flight()
    assert [report.received for report in first] == list(range(1, 101))
    assert {report.age_ns for report in first[10:]} == {3_000_000}
