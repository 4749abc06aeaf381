"""The kernels, compiled on first use; the machine code is kept on disk until any source that goes into it changes."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import lcd_flight
from lcd_flight.jit import Compiler
from sim_bridge.kernels import plant, rollout

_HOUSE = Path(lcd_flight.__file__).parent
SOURCES = (
    Path(__file__).parent / "kernels",
    _HOUSE / "control",
    _HOUSE / "model" / "types.py",
    _HOUSE / "model" / "frames.py",
)
"""All that kernels may be made of; a test holds them to it."""


@cache
def rollout_kernel() -> Any:
    """`kernels.rollout.fly`; it holds no lock while it runs."""
    return _compiler().kernel(rollout.fly)


@cache
def plant_kernel() -> Any:
    """`kernels.plant.fly_periods`."""
    return _compiler().kernel(plant.fly_periods)


def _compiler() -> Compiler:
    # No option that lets the compiler assume finite numbers: a diverged vehicle is NaN and must be seen as such.
    # No counting of references: kernels keep no array, and every count waits for the other cores.
    return Compiler(*SOURCES, error_model="numpy", nogil=True, _nrt=False, fastmath={"contract", "nsz", "arcp"})
