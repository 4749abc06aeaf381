"""Simulators by name."""

from __future__ import annotations

from typing import cast

from lcd_flight.model import Simulator
from lcd_flight.plugins.entry_points import load


def simulator(name: str = "multirotor") -> Simulator:
    """The batched simulator of that name.

    Raises:
        InputError: there is no such simulator; says which there are.
        RefusedError: a package that it needs is not installed.
    """
    return cast(Simulator, load("simulators", name, "simulator")())
