"""One lithium-polymer cell: voltage from charge, sag from load.

Figures of the Crazyflie: charge to voltage from crazyflie-firmware, src/hal/src/pm_stm32f4.c (bat671723HS25C); current
and sag from bitcraze.io, "PWM to Thrust" (0.24 A at rest, 6.7 A more for each newton; 0.36 V lost at 2.15 A); capacity
250 mAh. They give 7.0 minutes of hover. Other vehicles get a cell that lasts as long: load is thrust over weight.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

_VOLTS = (3.00, 3.78, 3.83, 3.87, 3.89, 3.92, 3.96, 4.00, 4.04, 4.10, 4.20)
"""Without load at 0, 10, ... 100 % of charge."""
_CAPACITY_C = 0.250 * 3600.0
_REST_A = 0.24
_HOVER_A = 6.7 * 0.029 * 9.81
"""More, while a Crazyflie of 29 g hovers."""
_RESISTANCE_OHM = 0.36 / 2.15


@dataclass(frozen=True, slots=True)
class Battery:
    """How full the cell is and what is drawn from it."""

    charge: float = 1.0
    """Share of its capacity, 0 to 1."""
    current_A: float = _REST_A

    @staticmethod
    def at_voltage(volts: float | None) -> Battery:
        """A cell that shows so many volts at rest; None: a full one."""
        return Battery(1.0 if volts is None else _charge_at(volts + _REST_A * _RESISTANCE_OHM))

    @property
    def voltage_V(self) -> float:
        """What is measured at its terminals."""
        return _voltage_at(self.charge) - self.current_A * _RESISTANCE_OHM

    def drained(self, load: float, dt_s: float) -> Battery:
        """After dt_s under a load: thrust over weight."""
        current_A = _REST_A + _HOVER_A * load
        return Battery(max(0.0, self.charge - current_A * dt_s / _CAPACITY_C), current_A)


def _voltage_at(charge: float) -> float:
    step = min(int(charge * 10.0), 9)
    return _VOLTS[step] + (charge * 10.0 - step) * (_VOLTS[step + 1] - _VOLTS[step])


def _charge_at(volts: float) -> float:
    if volts <= _VOLTS[0]:
        return 0.0
    if volts >= _VOLTS[-1]:
        return 1.0
    step = bisect_right(_VOLTS, volts) - 1
    return (step + (volts - _VOLTS[step]) / (_VOLTS[step + 1] - _VOLTS[step])) / 10.0
