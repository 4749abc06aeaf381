"""A finding: one thing that was noticed, with what it was measured against."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class Severity(IntEnum):
    """What a finding asks for; the most severe one of a tick wins."""

    INFO = 0
    WARN = 1
    BRAKE = 2
    """Stop and hold position."""
    LAND = 3
    """Land where it is, under position control."""
    DESCEND = 4
    """Level descent without pose."""
    KILL = 5
    """Stop the motors."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the flight's story, e.g. `WARN pose_gap: pose gap 42 ms (limit 300 ms)`."""

    code: str
    """Stable name, e.g. `pose_gap`; the table of them is `lcd_flight.safety.monitors`."""
    severity: Severity
    message: str
    """For a person: what, how much, and the limit, with units."""
    value: float | None = None
    limit: float | None = None
