"""The supervisor's status word, log variable `supervisor.info` (crazyflie-firmware 2026.08, supervisor.c)."""

from __future__ import annotations

from enum import IntFlag


class Status(IntFlag):
    """What the vehicle says of itself."""

    CAN_ARM = 1 << 0
    ARMED = 1 << 1
    AUTO_ARM = 1 << 2
    """Arms by itself; brushless vehicles want to be asked."""
    CAN_FLY = 1 << 3
    FLYING = 1 << 4
    """Motors above idle, now or in the last two seconds."""
    TUMBLED = 1 << 5
    LOCKED = 1 << 6
    """Until it is restarted."""
    CRASHED = 1 << 7

    @property
    def trouble(self) -> str:
        """Why it will not fly; empty where nothing is known against it."""
        if Status.LOCKED in self:
            return "it is locked, after a lost link or an emergency stop: restart it"
        if Status.CRASHED in self:
            return "it has crashed: look at its propellers, then restart it"
        if Status.TUMBLED in self:
            return "it lies on its side or back: put it upright"
        return ""
