"""One suite over every pose source: what the flight relies on, whatever the frames travel on.

ZeroMQ runs over real sockets on the loopback interface, on a port that the system chooses.
"""

from __future__ import annotations

import asyncio
import contextlib
import gc
import itertools
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import pytest

from lcd_flight import plugins
from lcd_flight.flight.clock import RealClock
from lcd_flight.model import InputError, PoseOptions, PosePublisher, PoseReport, PoseSource, RawPose, RefusedError
from lcd_flight.wire.mocap_frame import MocapFrame, encode

CLOCK = RealClock()
PATIENCE_S = 20.0

_names = itertools.count()


def free_endpoint(kind: str, folder: Path) -> str:
    """An endpoint that nobody has."""
    if kind == "loopback":
        return f"loopback://contract-{next(_names)}"
    if kind == "ipc":
        return f"ipc://{folder}/mocap"
    probe = plugins.pose_publisher("tcp://127.0.0.1:0")
    endpoint: str = probe.endpoint  # type: ignore[attr-defined]
    probe.close()
    return endpoint


@dataclass
class Pair:
    """A publisher and a source that listens to it."""

    publish: PosePublisher
    source: PoseSource
    sent: int = 0

    def frame(self, **changes: Any) -> MocapFrame:
        now_ns = CLOCK.now_ns()
        plain = MocapFrame(
            body="cf1",
            sequence=self.sent,
            frame_number=self.sent,
            source_time_ns=now_ns,
            send_time_ns=now_ns,
            clock_id="host",
            position=(1.0, 2.0, 3.0 + 1e-6 * self.sent),
            quaternion=(0.0, 0.0, 0.0, 1.0),
        )
        return msgspec.structs.replace(plain, **changes)

    def send(self, **changes: Any) -> None:
        self.publish(encode(self.frame(**changes)))
        self.sent += 1

    def report(self) -> PoseReport:
        return self.source.report(CLOCK.now_ns())

    async def until(self, holds: Callable[[PoseReport], bool], *, sending: bool = True) -> PoseReport:
        """Publish at 500 Hz until the report says so."""
        async with asyncio.timeout(PATIENCE_S):
            while not holds(report := self.report()):
                if sending:
                    self.send()
                await asyncio.sleep(0.002)
        return report


@contextlib.asynccontextmanager
async def connected(endpoint: str, options: PoseOptions | None = None) -> AsyncIterator[Pair]:
    publisher = plugins.pose_publisher(endpoint)
    try:
        async with plugins.pose_source(endpoint, "cf1", CLOCK, options) as source:
            pair = Pair(publisher, source)
            await pair.until(lambda report: report.received > 0)
            yield pair
    finally:
        publisher.close()


@pytest.fixture(params=["tcp", "ipc", "loopback"])
def endpoint(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    return free_endpoint(request.param, tmp_path)


def test_listeners_hear_of_every_accepted_frame_and_of_no_other(endpoint: str) -> None:
    async def main() -> None:
        async with connected(endpoint) as pair:
            await pair.until(lambda r: r.state is not None)
            heard: list[RawPose] = []
            pair.source.listen(heard.append)
            began = pair.report()
            pair.send(position=(90.0, 0.0, 0.0))
            for _ in range(5):
                pair.send()
            ended = await pair.until(lambda r: r.received >= began.received + 6, sending=False)
            assert [raw.sequence for raw in heard] == [pair.sent - n for n in range(5, 0, -1)]
            assert heard[-1] == ended.raw

    asyncio.run(main())


def test_frames_become_a_filtered_pose(endpoint: str) -> None:
    async def main() -> None:
        async with connected(endpoint) as pair:
            report = await pair.until(lambda r: r.state is not None)
            assert report.state is not None
            assert report.raw is not None
            assert report.state.p_WB == pytest.approx((1.0, 2.0, 3.0), abs=1e-2)
            assert report.raw.arrival_ns >= report.raw.source_stamp_ns
            assert report.age_ns is not None
            assert report.rejected == 0

    asyncio.run(main())


def test_every_frame_is_counted_and_none_is_merged(endpoint: str) -> None:
    async def main() -> None:
        async with connected(endpoint) as pair:
            pair.sent += 1000  # the gap tells when everything before it has arrived
            pair.send()
            before = await pair.until(lambda r: r.lost >= 1000, sending=False)
            for _ in range(50):
                pair.send()
            after = await pair.until(lambda r: r.received >= before.received + 50, sending=False)
            assert after.received == before.received + 50
            assert after.lost == before.lost

    asyncio.run(main())


def test_gaps_in_the_sequence_are_counted_as_lost(endpoint: str) -> None:
    async def main() -> None:
        async with connected(endpoint) as pair:
            before = pair.report()
            pair.sent += 7
            report = await pair.until(lambda r: r.received >= before.received + 2)
            assert report.lost - before.lost == 7

    asyncio.run(main())


def test_another_body_is_not_heard_even_where_its_name_begins_alike(endpoint: str) -> None:
    async def main() -> None:
        async with connected(endpoint) as pair:
            await pair.until(lambda r: r.state is not None)
            for n in range(20):
                pair.publish(encode(pair.frame(body="cf10", sequence=n, position=(9.0, 9.0, 9.0))))
                pair.publish(encode(pair.frame(body="other", sequence=n, position=(9.0, 9.0, 9.0))))
            sent_before = pair.sent
            report = await pair.until(lambda r: r.raw is not None and r.raw.sequence > sent_before)
            assert report.rejected == 0
            assert report.received <= pair.sent

    asyncio.run(main())


def test_malformed_frames_are_counted_and_survived(endpoint: str) -> None:
    async def main() -> None:
        async with connected(endpoint) as pair:
            await pair.until(lambda r: r.state is not None)
            pair.publish(b"mocap/cf1\0not a frame")
            pair.publish(b"mocap/cf1\0")
            report = await pair.until(lambda r: r.rejected >= 2)
            assert "not a mocap frame" in report.reject_reason
            await pair.until(lambda r: r.state is not None)

    asyncio.run(main())


def test_frames_in_other_axes_than_the_mission_says_are_refused(endpoint: str) -> None:
    async def main() -> None:
        async with connected(endpoint, PoseOptions(axes="ned")) as pair:
            report = await pair.until(lambda r: r.rejected > 10)
            assert report.state is None
            assert report.reject_reason == "frame is enu, the mission expects ned"

    asyncio.run(main())


def test_without_frames_the_pose_becomes_invalid_and_its_age_grows(endpoint: str) -> None:
    async def main() -> None:
        async with connected(endpoint) as pair:
            await pair.until(lambda r: r.state is not None)
            report = await pair.until(lambda r: r.state is None, sending=False)
            assert report.age_ns is not None
            assert report.age_ns > 0
            await pair.until(lambda r: r.state is not None)

    asyncio.run(main())


def test_a_source_may_come_before_its_publisher_and_survives_its_restart(endpoint: str) -> None:
    async def main() -> None:
        async with plugins.pose_source(endpoint, "cf1", CLOCK) as source:
            assert source.report(CLOCK.now_ns()).received == 0
            for _ in range(2):
                before = source.report(CLOCK.now_ns()).received
                pair = Pair(plugins.pose_publisher(endpoint), source)
                await pair.until(lambda r, before=before: r.received > before + 10 and r.state is not None)
                pair.publish.close()

    asyncio.run(main())


def test_after_closing_nothing_is_taken_in_and_nothing_is_left(endpoint: str) -> None:
    async def main() -> None:
        async with connected(endpoint) as pair:
            await pair.until(lambda r: r.state is not None)
        received = pair.report().received
        publisher = plugins.pose_publisher(endpoint)
        publisher(encode(pair.frame()))
        publisher.close()
        await asyncio.sleep(0.01)
        assert pair.report().received == received
        assert asyncio.all_tasks() == {asyncio.current_task()}

    asyncio.run(main())
    gc.collect()  # an unclosed socket would warn here, and warnings are errors


def test_it_closes_after_an_exception_too(endpoint: str) -> None:
    async def main() -> None:
        async with connected(endpoint):
            raise KeyError("flight code")

    with pytest.raises(KeyError, match="flight code"):
        asyncio.run(main())
    plugins.pose_publisher(endpoint).close()


@pytest.mark.parametrize("kind", ["tcp", "loopback"])  # an ipc file is taken over from its owner by ZeroMQ
def test_an_endpoint_that_is_taken_is_refused_with_its_name_and_a_remedy(kind: str, tmp_path: Path) -> None:
    endpoint = free_endpoint(kind, tmp_path)
    with contextlib.closing(plugins.pose_publisher(endpoint)):
        with pytest.raises(RefusedError, match="is in use: ") as caught:
            plugins.pose_publisher(endpoint)
        assert endpoint in str(caught.value)


def test_a_name_that_is_no_rigid_body_is_an_input_error(endpoint: str) -> None:
    with pytest.raises(InputError, match=r"motion_capture\.rigid_body"):
        plugins.pose_source(endpoint, "", CLOCK)
