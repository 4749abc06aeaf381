"""Faults by option: what they change before the flight, and what happens when."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from lcd_flight.model import InputError
from sim_bridge.mavlink.framing import V2
from sim_bridge.mavlink.options import MavlinkOptions
from sim_bridge.mavlink.parameters import Parameters


@dataclass(frozen=True, slots=True)
class Timed:
    """Something that happens once."""

    at_s: float
    """Since arming."""
    text: str
    """What a person sees; empty: nothing."""
    act: Callable[[], None]


def spoil(parameters: Parameters, options: MavlinkOptions) -> None:
    """Give parameters wrong values, or values that do not change.

    Raises:
        InputError: no such parameter, or no number.
    """
    for pair in filter(None, options.wrong.split(",")):
        name, separator, value = pair.partition(":")
        try:
            number = float(value)
        except ValueError:
            number = float("nan")
        if not (separator and abs(number) < 2**31):
            raise InputError(f"wrong={options.wrong}: {pair!r} is not NAME:VALUE")
        parameters.put(_known(parameters, name, "wrong"), number)
    stuck = [_known(parameters, name, "stuck") for name in options.stuck.split(",") if name]
    parameters.hold_fast(stuck)


def kind_of(datagram: bytes) -> int | None:
    """Number of the message in a packet of our own; None: not MAVLink 2."""
    return int.from_bytes(datagram[7:10], "little") if datagram[:1] == bytes((V2,)) else None


def _known(parameters: Parameters, name: str, option: str) -> str:
    if name not in parameters:
        raise InputError(f"{option}: the vehicle has no parameter {name!r}")
    return name
