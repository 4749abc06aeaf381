"""What is at the other end of a Crazyflie link: looked at for two seconds, nothing set, no setpoint sent."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Mapping
from dataclasses import dataclass

from drivers.crazyflie import options, parameters
from drivers.crazyflie.connect import connect
from drivers.crazyflie.log_blocks import BLOCKS, start
from drivers.crazyflie.picture import Picture
from drivers.crazyflie.session import Session
from drivers.crazyflie.status import Status
from drivers.crazyflie.thrust_map import FORCE_LINEAR_PROTOCOL
from lcd_flight.jit import cache_folder
from lcd_flight.model import Clock, Inspection

LISTEN_S = 2.0
LOW_BATTERY_V = 3.8
"""At rest: no flight worth the name; missions have their own limit."""
LOSSY = 0.05


async def inspect_radio(address: str, given: Mapping[str, str], clock: Clock) -> Inspection:
    """Look at what is behind `radio://`.

    Raises:
        InputError: not an address, or a wrong option.
        RefusedError: nobody answers.
    """
    return await _inspect("radio", address, given, clock)


async def inspect_usb(address: str, given: Mapping[str, str], clock: Clock) -> Inspection:
    """Look at what is behind `usb://`.

    Raises:
        InputError: not a number, or a wrong option.
        RefusedError: nobody answers.
    """
    return await _inspect("usb", address, given, clock)


async def inspect_udp(address: str, given: Mapping[str, str], clock: Clock) -> Inspection:
    """Look at what is behind `udp://`.

    Raises:
        InputError: not an address, or a wrong option.
        RefusedError: nobody answers.
    """
    return await _inspect("udp", address, given, clock)


@dataclass(frozen=True, slots=True)
class _Seen:
    """All that was found."""

    protocol: int
    firmware: str
    device: str
    revision: str
    picture: Picture
    differences: tuple[parameters.Difference, ...]
    latency_ms: float
    reports_hz: float
    loss_share: float
    quality: float | None


async def _inspect(scheme: str, address: str, given: Mapping[str, str], clock: Clock) -> Inspection:
    chosen, uri = options.read(scheme, address, given), f"{scheme}://{address}"
    cancelled = threading.Event()
    looking = asyncio.ensure_future(asyncio.to_thread(_look, uri, chosen.connect_s, clock, cancelled))
    try:
        return _told(await asyncio.shield(looking))
    finally:
        cancelled.set()
        await asyncio.gather(looking, return_exceptions=True)


def _look(uri: str, limit_s: float, clock: Clock, cancelled: threading.Event) -> _Seen:
    """Connect, listen, close. Blocks."""
    session = connect(uri, cache_folder() / "crazyflie-toc", clock, limit_s, cancelled)
    try:
        picture, count = Picture(), 0

        def take(block: str, vehicle_ms: int, values: Mapping[str, float]) -> None:
            nonlocal count
            count += 1
            picture.take(block, vehicle_ms, values, clock.now_ns())

        start(session, BLOCKS, take)
        session.identify()
        cancelled.wait(LISTEN_S)
        return _seen(session, picture, count / LISTEN_S, clock.now_ns())
    finally:
        session.shut()


def _seen(session: Session, picture: Picture, reports_hz: float, now_ns: int) -> _Seen:
    return _Seen(
        protocol=session.protocol,
        firmware=session.version,
        device=session.device,
        revision=session.revision,
        picture=picture,
        differences=parameters.differences(session),
        latency_ms=float(session.link_statistics.latency.latency),
        reports_hz=reports_hz,
        loss_share=picture.loss_share(now_ns),
        quality=session.quality,
    )


def _told(seen: _Seen) -> Inspection:
    """The same for a person."""
    picture = seen.picture
    battery = "not reported" if picture.battery_V is None else f"{picture.battery_V:.2f} V"
    status = "not reported" if picture.status is None else _words(picture.status)
    facts = [
        ("platform", seen.device or "does not say"),
        ("firmware", f"{seen.firmware or 'does not say'}, revision {seen.revision}, CRTP protocol {seen.protocol}"),
        ("battery", battery),
        ("status", status),
        ("reports", f"{seen.reports_hz:.0f} a second, {seen.loss_share:.0%} lost"),
        ("latency", f"{seen.latency_ms:.1f} ms there and back (95th percentile)"),
    ]
    if seen.quality is not None:
        facts.append(("radio", f"{seen.quality:.0%} of packets acknowledged at once"))
    differences = tuple(
        f"{d.requirement.name} is {'absent' if d.found is None else f'{d.found:g}'}, "
        f"flight sets {d.requirement.value:g}: {d.requirement.why}"
        for d in seen.differences
    )
    return Inspection(
        f"{seen.device or 'Crazyflie'}, CRTP protocol {seen.protocol}", tuple(facts), differences, _problems(seen)
    )


def _problems(seen: _Seen) -> tuple[str, ...]:
    """What speaks against flying."""
    picture, found = seen.picture, []
    if picture.status is None:
        found.append("it does not report its status: update its firmware")
    elif picture.status.trouble:
        found.append(picture.status.trouble)
    if picture.battery_V is not None and picture.battery_V < LOW_BATTERY_V:
        found.append(f"the battery has {picture.battery_V:.2f} V (at least {LOW_BATTERY_V} V at rest): charge it")
    if seen.loss_share > LOSSY:
        found.append(f"{seen.loss_share:.0%} of its reports are lost: change the channel, or come nearer")
    if seen.protocol < FORCE_LINEAR_PROTOCOL:
        found.append("its firmware is older than thrust that is linear in force: update it, or name a ?thrust_map=")
    found += [f"its firmware has no parameter {d.requirement.name}" for d in seen.differences if d.found is None]
    return tuple(found)


def _words(status: Status) -> str:
    """The bits that are set, as words."""
    return ", ".join(str(bit.name).lower().replace("_", " ") for bit in Status if bit in status) or "nothing"
