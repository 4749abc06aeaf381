"""What the firmware makes of the battery's voltage. Time comes in as milliseconds.

Source: crazyflie-firmware 2026.08, src/hal/src/pm_stm32f4.c.
"""

from __future__ import annotations

from enum import IntEnum

PATIENCE_MS = 5000
"""A voltage counts only after so long (PM_BAT_LOW_TIMEOUT, PM_BAT_CRITICAL_LOW_TIMEOUT)."""


class PowerState(IntEnum):
    """The log variable `pm.state`."""

    BATTERY = 0
    LOW = 3
    SHUT_DOWN = 4


class Power:
    """How long the voltage has been low and critical."""

    def __init__(self) -> None:
        self._well_ms = self._not_critical_ms = 0
        self.state = PowerState.BATTERY

    def update(self, voltage_V: float, low_V: float, critical_V: float, now_ms: int) -> None:
        """Take note of the voltage."""
        if voltage_V >= low_V:
            self._well_ms = now_ms
        if voltage_V >= critical_V:
            self._not_critical_ms = now_ms
        if now_ms - self._not_critical_ms > PATIENCE_MS:
            self.state = PowerState.SHUT_DOWN
        elif self.state is not PowerState.SHUT_DOWN:
            self.state = PowerState.LOW if now_ms - self._well_ms > PATIENCE_MS else PowerState.BATTERY
