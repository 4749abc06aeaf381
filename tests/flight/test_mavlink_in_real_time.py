"""The MAVLink link over real sockets: a simulated vehicle in the same event loop, armed and lifted a little."""

from __future__ import annotations

import asyncio
import itertools
import socket
from dataclasses import replace

import pytest

from lcd_flight import plugins
from lcd_flight.flight.clock import RealClock
from lcd_flight.model import AttitudeThrust, LinkContext
from lcd_flight.model.frames import from_yaw
from lcd_flight.plugins.entry_points import load
from lcd_flight.worlds import load_vehicle

pytestmark = [pytest.mark.realtime, pytest.mark.slow]

CLOCK = RealClock()
VEHICLE = load_vehicle("crazyflie-2.1")
_names = itertools.count()


def free_port(kind: socket.SocketKind) -> int:
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


async def stream(link: object, share: float, seconds: float) -> None:
    setpoint = AttitudeThrust(share * VEHICLE.weight_N, from_yaw(0.0))
    for _ in range(round(seconds * 100)):
        link.report(CLOCK.now_ns())  # type: ignore[attr-defined]
        link.send(setpoint, CLOCK.now_ns())  # type: ignore[attr-defined]
        await CLOCK.sleep_until(CLOCK.now_ns() + 10_000_000)


@pytest.mark.parametrize(
    ("place", "scheme", "kind"),
    [("", "mavlink+udp", socket.SOCK_DGRAM), ("tcp:", "mavlink+tcp", socket.SOCK_STREAM)],
)
def test_it_connects_arms_lifts_off_and_stops(place: str, scheme: str, kind: socket.SocketKind) -> None:
    async def main() -> None:
        port, endpoint = free_port(kind), f"loopback://mavlink-real-{next(_names)}"
        publisher = plugins.pose_publisher(endpoint)
        context = LinkContext(VEHICLE, CLOCK, (0.0, 0.0, 0.0), 0.0, seed=3, publish_pose=publisher, rigid_body="body")
        given = {"flavour": "px4", "boot_s": "0"}
        server = load("vehicle_servers", "mavlink", "simulated vehicle")(f"{place}127.0.0.1:{port}", given, context)
        try:
            async with server, plugins.pose_source(endpoint, "body", CLOCK) as pose:
                serving = asyncio.create_task(server.serve(lambda _text: None))
                uri = f"{scheme}://127.0.0.1:{port}?autopilot=px4"
                async with plugins.open_link(uri, replace(context, listen_poses=pose.listen)) as link:
                    await link.arm()
                    await stream(link, 1.2, 0.6)
                    report = link.report(CLOCK.now_ns())
                    assert report.telemetry is not None
                    assert report.telemetry.armed
                    assert report.telemetry.airborne
                    assert report.telemetry.p_WB is not None
                    assert report.telemetry.p_WB[2] > 0.05
                    assert report.lost == 0
                    link.stop_motors()
                    await stream(link, 1.0, 0.3)
                    report = link.report(CLOCK.now_ns())
                    assert report.telemetry is not None
                    assert report.telemetry.armed is False
                serving.cancel()
                await asyncio.gather(serving, return_exceptions=True)
        finally:
            publisher.close()

    asyncio.run(main())
