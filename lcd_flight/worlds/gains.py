"""A file of gains for the flight loop's law: some of them, in place of a vehicle's own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from lcd_flight.model import GeometricGains
from lcd_flight.worlds.data_file import Strict, read
from lcd_flight.worlds.vehicles import Amounts, NotNegative


class GainsFile(Strict):
    """See `model.GeometricGains`; what is left out stays as it is."""

    position: Amounts | None = None
    velocity: Amounts | None = None
    attitude: NotNegative | None = None
    body_rates: NotNegative | None = None
    integral: Amounts | None = None
    integral_limit: NotNegative | None = None


def load_gains(path: Path, base: GeometricGains) -> GeometricGains:
    """`base` with the gains of a YAML file in place of its own.

    Raises:
        InputError: the file cannot be read or is wrong; a line for each key.
    """
    return replace(base, **read(path, GainsFile).model_dump(exclude_none=True))
