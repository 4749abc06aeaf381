"""What is at the other end of a MAVLink link: looked at for two seconds. Reports are asked for; nothing else is."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping

from drivers.mavlink import options
from drivers.mavlink.contact import Contact
from drivers.mavlink.parameters import Difference
from drivers.mavlink.transport import Transport, transport_to
from drivers.mavlink.waiting import pause
from lcd_flight.model import Clock, Inspection

LISTEN_S = 2.0
LOSSY = 0.05
TEND_S = 0.1


async def inspect_udp(address: str, given: Mapping[str, str], clock: Clock) -> Inspection:
    """Look at what is behind `mavlink+udp://`.

    Raises:
        InputError: not an address, or a wrong option.
        RefusedError: nobody answers.
    """
    return await _inspected("mavlink+udp", address, given, clock)


async def inspect_tcp(address: str, given: Mapping[str, str], clock: Clock) -> Inspection:
    """Look at what is behind `mavlink+tcp://`.

    Raises:
        InputError: not an address, or a wrong option.
        RefusedError: nobody answers.
    """
    return await _inspected("mavlink+tcp", address, given, clock)


async def inspect_serial(address: str, given: Mapping[str, str], clock: Clock) -> Inspection:
    """Look at what is behind `mavlink+serial://`.

    Raises:
        InputError: not an address, or a wrong option.
        RefusedError: nobody answers.
    """
    return await _inspected("mavlink+serial", address, given, clock)


async def _inspected(scheme: str, address: str, given: Mapping[str, str], clock: Clock) -> Inspection:
    chosen = options.read(scheme, address, given)
    return await look(f"{scheme}://{address}", chosen, clock, transport_to(scheme, address, chosen))


async def look(uri: str, chosen: options.MavlinkOptions, clock: Clock, transport: Transport) -> Inspection:
    """Connect, listen, read the parameters, close.

    Raises:
        RefusedError: nobody answers, or it is another autopilot.
    """
    contact = Contact(uri, chosen, clock, transport)
    tending = asyncio.create_task(_tend(contact))
    try:
        await contact.find()
        received = contact.session.losses.received
        await pause(clock, LISTEN_S)
        rate_hz = (contact.session.losses.received - received) / LISTEN_S
        wrong = await contact.parameters.differences(contact.autopilot.requirements("vehicle"))
        hover = contact.autopilot.hover_parameter
        await contact.parameters.read([hover])
        return _told(contact, wrong, rate_hz)
    finally:
        tending.cancel()
        await asyncio.gather(tending, return_exceptions=True)
        contact.close()


async def _tend(contact: Contact) -> None:
    while True:
        contact.tend(contact.clock.now_ns())
        await pause(contact.clock, TEND_S)


def _told(contact: Contact, wrong: tuple[Difference, ...], rate_hz: float) -> Inspection:
    """All that was found, for a person."""
    picture, autopilot, losses = contact.picture, contact.autopilot, contact.session.losses
    mode = "does not say" if picture.custom_mode is None else autopilot.mode_name(picture.custom_mode)
    hover = contact.parameters.values.get(autopilot.hover_parameter)
    facts = (
        ("autopilot", f"{autopilot.name} {picture.version or 'of unknown version'}"),
        ("mode", f"{mode}, {'armed' if picture.armed else 'disarmed'}"),
        ("battery", "not reported" if picture.battery_V is None else f"{picture.battery_V:.2f} V"),
        ("estimator", autopilot.estimate_objection(picture.estimator_flags) or "knows where it is"),
        ("checks", {None: "not told", True: "passed", False: "not passed"}[picture.prearm_ok]),
        ("hover", "no such parameter" if hover is None else f"{autopilot.hover_parameter} {hover:.3f}"),
        ("signing", "signed both ways" if contact.signed else "none"),
        ("reports", f"{rate_hz:.0f} a second, {losses.share(contact.clock.now_ns()):.0%} lost"),
        ("left out", _counted(contact.session.rejected, contact.session.strangers)),
    )
    may_set = contact.options.set_parameters
    mine = [d for d in wrong if may_set and d.found is not None and not d.requirement.restart]
    differences = tuple(
        f"{d.requirement.name} is {d.found:g}, flight sets {d.requirement.value:g}: {d.requirement.why}" for d in mine
    )
    problems = [d.described() for d in wrong if d not in mine]
    return Inspection(
        f"{autopilot.name} {picture.version}".strip(), facts, differences, (*problems, *_problems(contact))
    )


def _problems(contact: Contact) -> tuple[str, ...]:
    """What speaks against flying, beside parameters."""
    picture, found = contact.picture, []
    if picture.battery_V is None:
        found.append("it does not report its battery: set up its power module")
    if picture.failsafe:
        found.append(f"it reports a failsafe{contact.said()}")
    if contact.session.losses.share(contact.clock.now_ns()) > LOSSY:
        found.append("over 5 % of its packets are lost: look at cable, radio or network")
    return tuple(found)


def _counted(*counts: Mapping[str, int]) -> str:
    told = [f"{count} {reason}" for group in counts for reason, count in group.items()]
    return ", ".join(told) or "nothing"
