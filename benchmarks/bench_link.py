"""What the links cost a tick, against their peers' own calls in the same run. MAVLink: `link_mavlink`.

Crazyflie: both sides send to a UDP socket that swallows everything. Ours hands a packet to its sender thread and goes
on; cflib's `send_setpoint` and `send_extpose` go through to the socket. How late reports are is timed from the driver's
queue to the event loop, with cflib's threads in between.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from cflib.crtp.crtpstack import CRTPPacket

from benchmarks import link_mavlink
from benchmarks.timing import PERIOD_S, SHARES, as_in_flight, paced, row
from drivers.crazyflie import crtp_wire
from drivers.crazyflie.outbox import Outbox
from drivers.crazyflie.sender import Sender
from drivers.crazyflie.session import Session
from drivers.crazyflie.thrust_map import thrust_map
from lcd_flight.flight.clock import RealClock
from lcd_flight.model import AttitudeThrust
from lcd_flight.model.frames import body_x_axis, from_yaw
from lcd_flight.worlds import load_vehicle

ROUNDS = 5
SENDS = 200
"""Of each side in each round."""
REPORTS = 500

CLOCK = RealClock()
ATTITUDE = from_yaw(0.3)


def rows(report: Callable[[str], None]) -> list[dict[str, Any]]:
    """Costs in microseconds."""
    ours: dict[str, list[float]] = {"setpoint": [], "pose": []}
    cflib: dict[str, list[float]] = {"setpoint": [], "pose": []}
    with as_in_flight(), _session() as (session, _):
        sender = Sender(Outbox(lambda: crtp_wire.UNLOCK, 1000.0), CLOCK, session.transmit)
        sender.start()
        sender.change(lambda box: box.unlock(CLOCK.now_ns()))
        for number in range(ROUNDS):
            report(f"round {number + 1} of {ROUNDS}, {4 * SENDS} packets")
            ours["setpoint"] += paced(_our_setpoint(sender), SENDS)
            cflib["setpoint"] += paced(lambda: session.commander.send_setpoint(1.0, 2.0, 17.0, 38842), SENDS)
            ours["pose"] += paced(_our_pose(sender), SENDS)
            cflib["pose"] += paced(lambda: session.loc.send_extpose((1.0, 2.0, 3.0), ATTITUDE), SENDS)
        sender.end()
    table = [
        row(f"cost of a {what} in the loop, {name}", ours[what], cflib[what], share, peer)
        for what, peer in (("setpoint", "cflib send_setpoint"), ("pose", "cflib send_extpose"))
        for name, share in SHARES
    ]
    report(f"{REPORTS} reports from the driver to the event loop")
    late_us = asyncio.run(_hand_off())
    what = "report, from the driver to the event loop"
    table += [row(f"{what}, {name}", late_us, None, share, None) for name, share in SHARES]
    return table + link_mavlink.rows(report)


def _our_setpoint(sender: Sender) -> Callable[[], None]:
    """All that `CrazyflieLink.send` does for a fresh setpoint."""
    vehicle = load_vehicle("crazyflie-2.1")
    chosen, wanted = thrust_map("vehicle", vehicle), AttitudeThrust(vehicle.weight_N, ATTITUDE)

    def send() -> None:
        stamp_ns = CLOCK.now_ns()
        packet = crtp_wire.setpoint(wanted, body_x_axis(ATTITUDE), chosen.counts(wanted.thrust_N))
        sender.change(lambda box: box.offer(packet, stamp_ns))

    return send


def _our_pose(sender: Sender) -> Callable[[], None]:
    def send() -> None:
        packet, now_ns = crtp_wire.extpose((1.0, 2.0, 3.0), ATTITUDE), CLOCK.now_ns()
        sender.change(lambda box: box.pose(packet, now_ns))

    return send


async def _hand_off() -> list[float]:
    """us from a packet in the driver's queue to the function that takes it in the event loop."""
    loop, late_us = asyncio.get_running_loop(), list[float]()
    arrived = asyncio.Event()

    def take(sent_ns: int) -> None:
        late_us.append((time.perf_counter_ns() - sent_ns) * 1e-3)
        arrived.set()

    with as_in_flight(), _session() as (session, driver):
        sent_ns = 0
        session.packet_received.add_callback(lambda _packet: loop.call_soon_threadsafe(take, sent_ns))
        for _ in range(REPORTS):
            arrived.clear()
            sent_ns = time.perf_counter_ns()
            driver.in_queue.put(CRTPPacket(0xF3))
            await arrived.wait()
            await asyncio.sleep(PERIOD_S)
    return late_us


@contextlib.contextmanager
def _session() -> Iterator[tuple[Session, Any]]:
    """cflib's Crazyflie on a socket that swallows everything, without connecting; and its driver."""
    from cflib.crtp.udpdriver import UdpDriver

    with TemporaryDirectory() as folder, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sink:
        sink.bind(("127.0.0.1", 0))
        swallowing = threading.Thread(target=_swallow, args=(sink,), daemon=True)
        swallowing.start()
        session = Session(Path(folder), CLOCK)
        driver = UdpDriver()
        driver.connect(f"udp://127.0.0.1:{sink.getsockname()[1]}", None, lambda _message: None)
        session.link = driver
        session.incoming.start()
        try:
            yield session, driver
        finally:
            session.shut()
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as last:
                last.sendto(b"", sink.getsockname())
            swallowing.join()


def _swallow(sink: socket.socket) -> None:
    while sink.recv(64):
        pass
