"""Which Crazyflie it is: platform (motors, arming) and firmware (protocol, thrust map), by name.

Sources: crazyflie-firmware, src/platform (arming, device names); cflib 0.1.34, crazyflie/commander.py and supervisor.py
(what a client does up to protocol 8 and from protocol 12 on); the older thrust map is one that others have identified
for a Crazyflie 2.0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from lcd_flight.model import GRAVITY_M_PER_S2, InputError

FULL_SCALE = 65535.0


def linear_in_force(counts: float, full_N: float) -> float:
    """Collective force in N of the newest firmware, which compensates for the battery: linear."""
    return counts / FULL_SCALE * full_N


def linear_in_pulse_width(counts: float, full_N: float) -> float:
    """Collective force in N of older firmware, which sets the pulse width: pwm = 60000 (c1 + c2 sqrt(c3 + grams))."""
    root = (counts / 60000.0 + 0.6709) / 0.1932
    grams = max(0.0, root * root - 13.0652)
    return min(full_N, grams * 1e-3 * GRAVITY_M_PER_S2)


@dataclass(frozen=True, slots=True)
class Variant:
    """A platform with a firmware."""

    platform: str
    device: str
    """What the firmware calls the platform."""
    auto_arming: bool
    firmware: str
    protocol: int
    force_N: Callable[[float, float], float]
    """Collective thrust counts and the force at full scale in N -> collective force in N."""


PLATFORMS = {
    "2.0": ("Crazyflie 2.0", True),
    "2.1": ("Crazyflie 2.1", True),
    "2.1-brushless": ("Crazyflie 2.1 Brushless", False),
}
"""Device name, and whether it arms by itself."""

FIRMWARES = {"2026.08": (12, linear_in_force), "2024.10": (8, linear_in_pulse_width)}
"""Protocol and thrust map."""


def variant(platform: str, firmware: str) -> Variant:
    """One by its two names.

    Raises:
        InputError: there is no such platform or firmware; says which there are.
    """
    if platform not in PLATFORMS:
        raise InputError(f"platform {platform!r} is not simulated; there are: {', '.join(PLATFORMS)}")
    if firmware not in FIRMWARES:
        raise InputError(f"firmware {firmware!r} is not simulated; there are: {', '.join(FIRMWARES)}")
    (device, auto_arming), (protocol, force_N) = PLATFORMS[platform], FIRMWARES[firmware]
    return Variant(platform, device, auto_arming, firmware, protocol, force_N)
