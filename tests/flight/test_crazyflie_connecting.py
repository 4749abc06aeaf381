"""Connecting to a simulated Crazyflie over a path that loses datagrams, or to nobody; in real time.

cflib by itself waits for ever for an answer that was lost.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from crazyflie_bench import CLOCK, START_M, Bench, bench, level, stream, wait_ms
from short_mission import Listener, mission, plan, vehicle

from drivers.crazyflie import connect, connection, parameters
from lcd_flight.flight.operator import Operator
from lcd_flight.flight.session import FlightOptions, run_flight
from lcd_flight.model import Link, LinkReport, RefusedError

pytestmark = pytest.mark.realtime

PROTOCOL_ECHO, PROTOCOL_VERSION = 0xFD, 0xDD


@pytest.fixture(autouse=True)
def _empty_toc_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """So that the tables are asked for."""
    monkeypatch.setattr(connection, "cache_folder", lambda: tmp_path)


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """A connection that stands still is given up sooner, to save time."""
    monkeypatch.setattr(connect, "SILENCE_NS", 300_000_000)


class FirstLost:
    """Loses the first datagram of each kind: header, first byte, and way."""

    def __init__(self, only: Callable[[bytes, bool], bool] = lambda _data, _up: True) -> None:
        self.lost: set[tuple[bytes, bool]] = set()
        self._only = only

    def __call__(self, data: bytes, up: bool) -> bool:
        kind = (data[:1] if data[0] in (0x2D, 0x2E) else data[:2], up)
        if kind in self.lost or not self._only(data, up):
            return False
        self.lost.add(kind)
        return True


def settled(bench: Bench, report: LinkReport) -> None:
    """Connected, with the estimate where the vehicle stands."""
    assert report.connected
    assert report.telemetry is not None
    assert report.telemetry.p_WB == pytest.approx(START_M, abs=0.05)
    assert any("thrust map" in text for text in report.telemetry.messages)


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize(
    ("header", "up"),
    [
        pytest.param(PROTOCOL_ECHO, True, id="the first request is lost"),
        pytest.param(PROTOCOL_VERSION, False, id="the answer to the second is lost"),
    ],
)
def test_the_two_first_requests_cannot_be_repeated_so_it_connects_anew(header: int, up: bool) -> None:
    async def main() -> None:
        loses = FirstLost(lambda data, way: way is up and data[0] & 0xF3 == header & 0xF3)
        async with bench(loses) as made:
            async with made.link() as link:
                settled(made, link.report(CLOCK.now_ns()))
            assert loses.lost
            assert len(made.path.sent_up(PROTOCOL_ECHO)) >= 2
            assert not made.left_over()

    asyncio.run(main())


@pytest.mark.slow
def test_every_other_step_may_lose_its_request_and_its_answer_in_one_and_the_same_connect() -> None:
    async def main() -> None:
        loses = FirstLost(lambda data, _up: data[0] & 0xF0 in (0x20, 0x40, 0x50))
        async with bench(loses) as made:
            async with made.link() as link:
                settled(made, link.report(CLOCK.now_ns()))
            up = {kind.hex() for kind, way in loses.lost if way}
            assert {"5d05", "5c03", "5c02", "4c01", "2c03", "2c02", "5d06", "5d03"} <= up
            assert {"2d", "2e"} <= up
            assert len(made.path.sent_up(PROTOCOL_ECHO)) == 1
            assert not made.left_over()

    asyncio.run(main())


def test_the_second_connect_has_the_tables_already() -> None:
    async def main() -> None:
        async with bench() as made:
            for asked in (True, False):
                made.path.seen.clear()
                async with made.link():
                    requests = [data for data in made.path.sent_up(0x5C) + made.path.sent_up(0x2C) if data[1] == 0x02]
                    assert bool(requests) is asked

    asyncio.run(main())


def test_parameters_are_set_and_read_back_while_poses_stream_and_before_the_estimator_is_reset() -> None:
    async def main() -> None:
        async with bench() as made, made.link() as link:
            up = [data for data, way in made.path.seen if way]
            writes = [index for index, data in enumerate(up) if data[0] == 0x2E]
            first_pose = next(index for index, data in enumerate(up) if data[:2] == b"\x6d\x08")
            assert len(writes) == len(parameters.REQUIRED) + 2
            assert first_pose < writes[0]
            for index in writes[: len(parameters.REQUIRED)]:  # what follows a write is its reading back
                assert b"\x2d" + up[index][1:3] in up[index:]
            poses = [index for index, data in enumerate(up) if data[:2] == b"\x6d\x08"]
            assert poses[-1] > writes[-1]
            messages = link.report(CLOCK.now_ns()).telemetry.messages  # type: ignore[union-attr]
            assert "parameter flightmode.stabModeYaw 0 -> 1" in messages

    asyncio.run(main())


def test_a_parameter_that_does_not_hold_is_refused_by_name() -> None:
    """The reading back is changed on its way: stabModeYaw stays 0, which would make yaw a rate."""

    async def main() -> None:
        async with bench() as made:
            refused = []
            session_values = parameters.value_of

            def found(session: parameters.Session, name: str) -> float | None:
                return 0.0 if name == "flightmode.stabModeYaw" else session_values(session, name)

            parameters.value_of = found
            try:
                with pytest.raises(RefusedError, match=r"flightmode\.stabModeYaw was set to 1 but reads 0"):
                    async with made.link():
                        refused.append(False)
            finally:
                parameters.value_of = session_values
            assert not refused
            assert not made.left_over()

    asyncio.run(main())


@pytest.mark.usefixtures("impatient")
def test_nobody_there_is_refused_in_seconds_and_leaves_no_thread() -> None:
    async def main() -> None:
        async with bench(lambda _data, _up: True) as made:
            began_ns = CLOCK.now_ns()
            with pytest.raises(RefusedError, match=r"no answer from udp://127\.0\.0\.1:.*is the vehicle on"):
                async with made.link():
                    pass
            assert CLOCK.now_ns() - began_ns < 20e9
            assert not made.left_over()

    asyncio.run(main())


@pytest.mark.usefixtures("impatient")
def test_a_vehicle_that_falls_silent_while_connecting_is_given_up_in_the_time_that_was_set() -> None:
    async def main() -> None:
        heard = 0

        def loses(_data: bytes, up: bool) -> bool:
            nonlocal heard
            heard += not up
            return heard > 20

        async with bench(loses) as made:
            with pytest.raises(RefusedError, match="does not come about"):
                async with made.link("?connect_s=2"):
                    pass
            assert not made.left_over()

    asyncio.run(main())


def test_without_poses_it_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection, "FIRST_POSE_S", 0.3)

    async def main() -> None:
        async with bench() as made:
            with pytest.raises(RefusedError, match="needs poses"):
                async with made.link(listen_poses=None):
                    pass
            with pytest.raises(RefusedError, match=r"no pose from motion capture: check motion_capture\.endpoint"):
                async with made.link(listen_poses=lambda _listener: None):
                    pass
            assert not made.left_over()

    asyncio.run(main())


def test_who_is_cancelled_while_connecting_leaves_nothing_behind() -> None:
    async def main() -> None:
        async with bench(lambda _data, _up: True) as made:

            async def connect() -> None:
                async with made.link():
                    pass

            connecting = asyncio.create_task(connect())
            await wait_ms(300)
            connecting.cancel()
            with pytest.raises(asyncio.CancelledError):
                await connecting
            assert not made.left_over()

    asyncio.run(main())


def test_older_firmware_is_refused_with_the_map_that_it_does_not_understand() -> None:
    async def main() -> None:
        async with bench(firmware="2024.10") as made:
            with pytest.raises(RefusedError, match="CRTP protocol 8 is older than thrust that is linear in force"):
                async with made.link():
                    pass
            async with made.link("?thrust_map=cf2-pwm-identified") as link:
                assert "cf2-pwm-identified version 1" in link.description
                await fly_up(link)
                link.stop_motors()

    asyncio.run(main())


async def fly_up(link: Link) -> None:
    await link.arm()
    report = await stream(link, level(1.3), 0.4)
    assert report.telemetry is not None
    assert report.telemetry.airborne


def test_the_operator_may_end_the_connecting() -> None:
    operator, listener = Operator(), Listener()
    nobody = {"type": "crazyflie", "uri": "udp://127.0.0.1:1"}
    flown = mission(vehicle=nobody, motion_capture={"endpoint": "loopback://nobody"})
    threading.Timer(0.3, operator.interrupt).start()
    with pytest.raises(RefusedError, match="interrupted while connecting"):
        run_flight(flown, plan(), vehicle(), FlightOptions(arm=False, operator=operator), observers=(listener,))
    assert listener.flight == []
    assert listener.closed == 1
