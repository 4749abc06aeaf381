"""What the Crazyflie link promises beside the contract of every link, against a simulated Crazyflie in real time."""

from __future__ import annotations

import asyncio
import math
import struct

import pytest
from crazyflie_bench import CLOCK, START_M, START_YAW_RAD, VEHICLE, Bench, bench, level, stream, wait_ms

from drivers.crazyflie import crtp_wire
from drivers.crazyflie.status import Status
from lcd_flight.model import AttitudeThrust, Link, Quaternion, Telemetry
from lcd_flight.model.frames import from_yaw, multiply, rotate, wrapped, yaw_of

pytestmark = [pytest.mark.realtime, pytest.mark.slow]

RPYT, STOP, NOTIFY = 0x3C, 0x7C, 0x7D
FEED = crtp_wire.emergency_watchdog(12)


def tilted(axis: int, angle_rad: float) -> AttitudeThrust:
    """Hovering, turned about one body axis from the heading it stands with."""
    half = [0.0, 0.0, 0.0]
    half[axis] = math.sin(0.5 * angle_rad)
    q: Quaternion = (half[0], half[1], half[2], math.cos(0.5 * angle_rad))
    return AttitudeThrust(
        VEHICLE.weight_N / math.cos(angle_rad if axis < 2 else 0.0), multiply(from_yaw(START_YAW_RAD), q)
    )


def telemetry(link: Link) -> Telemetry:
    found = link.report(CLOCK.now_ns()).telemetry
    assert found is not None
    return found


async def climb(link: Link) -> None:
    await link.arm()
    await stream(link, level(1.25), 0.7)
    await stream(link, level(0.9), 0.4)


def velocity(made: Bench) -> tuple[float, float]:
    """m/s forward and to the left, as seen from the heading it stands with, over the last tenth of a second."""
    a, b = made.frames[-11], made.frames[-1]
    way = [(q - p) / 0.1 for p, q in zip(a.position, b.position, strict=True)]
    x, y, _ = rotate(from_yaw(-START_YAW_RAD), (way[0], way[1], 0.0))
    return x, y


def test_signs_as_flown() -> None:
    """Nose down goes forward, right side down goes right, yaw turns left; each alone."""

    async def main() -> None:
        async with bench() as made, made.link() as link:
            await climb(link)
            for axis, sign in ((1, +1.0), (0, -1.0)):
                await stream(link, level(1.0), 0.4)
                before = velocity(made)
                await stream(link, tilted(axis, 0.25), 0.4)
                gained = [b - a for a, b in zip(before, velocity(made), strict=True)]
                along, across = (gained[0], gained[1]) if axis == 1 else (gained[1], gained[0])
                assert sign * along > 0.4
                assert abs(across) < 0.5 * abs(along)
                await stream(link, tilted(axis, -0.25), 0.4)
            await stream(link, tilted(2, 0.5), 0.8)
            heading = yaw_of(made.frames[-1].quaternion)
            assert wrapped(heading - START_YAW_RAD) == pytest.approx(0.5, abs=0.15)
            link.stop_motors()

    asyncio.run(main())


def test_closing_in_the_air_descends_stops_says_so_and_locks_nothing() -> None:
    async def main() -> None:
        async with bench() as made:
            async with made.link() as link:
                await climb(link)
                highest = made.frames[-1].position[2]
                assert highest > 0.2
            assert made.frames[-1].position[2] < START_M[2] + 0.06
            assert made.frames[-1].position[2] < highest
            ups = [data for data, up in made.path.seen if up and data[0] in (RPYT, STOP, NOTIFY)]
            end = [data[0] for data in ups]
            assert end[-3:] == [NOTIFY] * 3
            stops = end.count(STOP)
            assert stops >= 5
            assert end[-3 - stops : -3] == [STOP] * stops
            assert struct.unpack_from("<ff", ups[-4 - stops], 1) == (0.0, 0.0)  # level
            assert "locked until reboot" not in made.story
            async with made.link() as again:
                await again.arm()
            assert not made.left_over()

    asyncio.run(main())


def test_who_does_not_wait_for_the_descent_cuts_the_motors() -> None:
    async def main() -> None:
        async with bench() as made:
            climbed = asyncio.Event()

            async def fly() -> None:
                async with made.link() as link:
                    await climb(link)
                    climbed.set()
                    await wait_ms(60_000)

            flying = asyncio.create_task(fly())
            await climbed.wait()
            flying.cancel()
            await wait_ms(200)
            assert not flying.done()  # it descends
            flying.cancel()
            with pytest.raises(asyncio.CancelledError):
                await flying
            assert made.path.sent_up(NOTIFY) == [crtp_wire.NOTIFY_STOP] * 3
            assert not made.left_over()

    asyncio.run(main())


def test_a_lost_link_cuts_within_a_second_where_that_was_asked_for() -> None:
    """The watchdog is fed while the loop lives; the loop stops, the fallback flies, the vehicle cuts and is locked."""

    async def main() -> None:
        async with bench() as made, made.link(on_link_lost="cut") as link:
            assert FEED not in [data for data, up in made.path.seen if up]
            await climb(link)
            assert FEED in [data for data, up in made.path.seen if up]
            await wait_ms(1_500)
            status = telemetry(link).status
            assert status is not None
            assert Status.LOCKED in Status(status)
            assert telemetry(link).crashed

    asyncio.run(main())


def test_without_that_the_fallback_goes_on_and_nothing_is_locked() -> None:
    async def main() -> None:
        async with bench() as made, made.link() as link:
            await climb(link)
            await wait_ms(1_500)
            report = link.report(CLOCK.now_ns())
            assert report.fallback_active
            assert report.telemetry is not None
            assert report.telemetry.crashed is False
            assert made.path.sent_up(FEED[0]) == []
            link.stop_motors()

    asyncio.run(main())


def test_loss_and_silence_are_measured() -> None:
    async def main() -> None:
        async with bench() as made, made.link() as link:
            assert link.report(CLOCK.now_ns()).loss_share < 0.02
            count = 0

            def every_fifth(_data: bytes, up: bool) -> bool:
                nonlocal count
                count += not up
                return not up and count % 5 == 0

            made.path.loses = every_fifth
            await wait_ms(1_500)
            report = link.report(CLOCK.now_ns())
            assert report.loss_share == pytest.approx(0.2, abs=0.08)
            assert report.lost > 10
            made.path.loses = lambda _data, _up: True
            began_ns = CLOCK.now_ns()
            await wait_ms(400)
            report = link.report(CLOCK.now_ns())
            assert report.age_ns is not None
            assert 0.3e9 < report.age_ns <= CLOCK.now_ns() - began_ns + 20_000_000
            assert report.connected
            made.path.loses = lambda _data, _up: False
            await wait_ms(100)
            age_ns = link.report(CLOCK.now_ns()).age_ns
            assert age_ns is not None
            assert age_ns < 100_000_000

    asyncio.run(main())


def test_what_the_vehicle_says_reaches_telemetry_and_a_locked_one_is_not_armed() -> None:
    async def main() -> None:
        async with bench(battery_V=3.6) as made, made.link() as link:
            told = telemetry(link)
            assert told.battery_V == pytest.approx(3.6, abs=0.1)
            assert told.status is not None
            assert Status.CAN_FLY in Status(told.status)
            assert told.p_WB == pytest.approx(START_M, abs=0.05)
            assert told.q_WB is not None
            assert yaw_of(told.q_WB) == pytest.approx(START_YAW_RAD, abs=0.05)
            assert told.specific_force_B == pytest.approx((0.0, 0.0, 9.81), abs=0.5)
            assert "Crazyflie 2.1, firmware 2026.08" in link.description
            assert "hover at 38842 of 65535" in link.description

    asyncio.run(main())


def test_a_brushless_vehicle_is_armed_on_request_and_disarmed_again() -> None:
    async def main() -> None:
        async with bench(platform="2.1-brushless") as made, made.link() as link:
            assert telemetry(link).armed is False
            await link.arm()
            assert made.path.sent_up(0x9D) == [crtp_wire.arming(True, 12)]
            await stream(link, level(0.2), 0.2)
            assert telemetry(link).armed is True
            await link.disarm()
            assert made.path.sent_up(0x9D)[-1] == crtp_wire.arming(False, 12)
            await wait_ms(100)
            status = telemetry(link).status
            assert status is not None
            assert Status.ARMED not in Status(status)

    asyncio.run(main())
