"""What the vehicle is asked to report, and how: cflib's log blocks, of at most 26 bytes each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from cflib.crazyflie.log import LogConfig

from drivers.crazyflie.session import Session
from lcd_flight.model import RefusedError

Take = Callable[[str, int, Mapping[str, float]], None]
"""Told of each report, in cflib's thread: block, the vehicle's milliseconds (24 bits), values."""


@dataclass(frozen=True, slots=True)
class Block:
    """One kind of report."""

    name: str
    period_ms: int
    variables: tuple[tuple[str, str], ...]
    """Name, and the type it is sent as."""


ATTITUDE = Block(
    "attitude",
    10,
    (
        *((f"stateEstimate.q{axis}", "float") for axis in "xyzw"),
        *((f"motor.m{number}", "uint16_t") for number in range(1, 5)),
    ),
)
STATUS = Block(
    "status",
    50,
    (
        ("pm.vbat", "float"),
        ("supervisor.info", "uint16_t"),
        *((f"stateEstimate.{axis}", "float") for axis in "xyz"),
    ),
)
SLOW = Block(
    "slow",
    100,
    (
        *((f"kalman.var{axis}", "float") for axis in "XYZ"),
        *((f"acc.{axis}", "float") for axis in "xyz"),
    ),
)
BLOCKS = (ATTITUDE, STATUS, SLOW)
"""The attitude and not its angles: `stateEstimate.pitch` has the opposite sign of the commanded pitch. The variances
are those of the position; `kalman.varPX` and its sisters, which cflib's own helper looks at, are of the velocity."""


def start(session: Session, blocks: tuple[Block, ...], take: Take) -> None:
    """Have the vehicle report; the first reports arrive soon after.

    Raises:
        RefusedError: its firmware does not know a variable.
    """
    for block in blocks:
        config = LogConfig(block.name, block.period_ms)
        for name, kind in block.variables:
            config.add_variable(name, kind)
        try:
            session.log.add_config(config)
        except KeyError as error:
            raise RefusedError(f"the vehicle's firmware cannot report {error.args[0]}: update it") from error
        config.data_received_cb.add_callback(_taker(block.name, take))
        config.start()


def _taker(name: str, take: Take) -> Callable[[int, Mapping[str, float], LogConfig], None]:
    return lambda timestamp_ms, values, _config: take(name, timestamp_ms, values)
