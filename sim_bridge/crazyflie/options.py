"""Options of the simulated Crazyflie, faults included."""

from __future__ import annotations

from typing import Annotated

import msgspec

Seconds = Annotated[float, msgspec.Meta(ge=0.0, le=1e6)]
Milliseconds = Annotated[float, msgspec.Meta(ge=0.0, le=1e9)]


class CrazyflieOptions(msgspec.Struct, frozen=True):
    """Times of faults count from the first thrust; None: the fault does not happen."""

    platform: str = "2.1"
    firmware: str = "2026.08"
    battery_V: Annotated[float, msgspec.Meta(ge=0.0, le=100.0)] | None = None
    """Voltage to start with; None: a full battery."""
    noise_mm: Annotated[float, msgspec.Meta(ge=0.001, le=1000.0)] = 0.3
    """Standard deviation of the published position, each axis. Never zero: a camera without noise looks frozen."""
    noise_deg: Annotated[float, msgspec.Meta(ge=0.0, le=90.0)] = 0.1
    """Of the published attitude, each axis."""
    twist: bool = True
    """Whether velocity and body rates are published beside the pose."""
    drop: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)] = 0.0
    """Share of datagrams lost, each way."""
    drop_at: Annotated[int, msgspec.Meta(ge=1)] | None = None
    """Which of the client's datagrams is lost, counted from 1 over all connections."""
    delay_ms: Milliseconds = 0.0
    """Each way."""
    freeze_s: Seconds | None = None
    """When the radio goes silent both ways; the vehicle lives on."""
    freeze_ms: Milliseconds = 3000.0
    """For how long."""
    die_s: Seconds | None = None
    """When all power is lost."""
    upright_s: Seconds | None = None
    """So long after a crash somebody puts it on its feet."""
