"""The simulated vehicle in real time: its poses over ZeroMQ into the filter, judged by what arrives."""

from __future__ import annotations

import asyncio
import contextlib
import math

import pytest

from lcd_flight import plugins
from lcd_flight.flight.clock import RealClock
from lcd_flight.model import AttitudeThrust, LinkContext, PoseReport
from lcd_flight.worlds import load_vehicle

pytestmark = pytest.mark.realtime

CLOCK = RealClock()
VEHICLE = load_vehicle("crazyflie-2.1")
LEVEL = (0.0, 0.0, 0.0, 1.0)


async def flown(seconds: float) -> list[PoseReport]:
    """Climb slowly, with a setpoint every 10 ms; the pose reports of those ticks."""
    reports = []
    with contextlib.closing(plugins.pose_publisher("tcp://127.0.0.1:0")) as publish:
        endpoint: str = publish.endpoint  # type: ignore[attr-defined]
        context = LinkContext(VEHICLE, CLOCK, (0.5, 0.0, 0.0), 0.0, 1, publish_pose=publish, rigid_body="cf1")
        async with plugins.pose_source(endpoint, "cf1", CLOCK) as source, plugins.open_link("sim://", context) as link:
            async with asyncio.timeout(60.0):
                while source.report(CLOCK.now_ns()).state is None:
                    await asyncio.sleep(0.01)
            await link.arm()
            due_ns = CLOCK.now_ns()
            for _ in range(round(seconds * 100)):
                due_ns += 10_000_000
                await CLOCK.sleep_until(due_ns)
                now_ns = CLOCK.now_ns()
                link.send(AttitudeThrust(1.1 * VEHICLE.weight_N, LEVEL), now_ns)
                reports.append(source.report(now_ns))
    return reports


def test_poses_reach_the_filter_and_follow_the_vehicle() -> None:
    reports = asyncio.run(flown(1.5))
    last = reports[-1]
    assert last.state is not None
    assert last.rejected == 0
    assert last.lost == 0
    assert last.raw is not None
    assert last.received > 50
    assert last.state.p_WB[2] > 0.2
    assert last.state.v_WB_W[2] > 0.2
    assert math.dist(last.state.p_WB, last.raw.p_WB) < 0.3
