"""The firmware's supervisor: may it arm, may the motors turn, and when is it over. Time comes in as milliseconds.

Source: crazyflie-firmware, src/modules/src/supervisor.c (conditions, what a change of state does) and
supervisor_state_machine.c (the table below, as it is since landing has a time-out); platform_defaults.h (the figures).
The line of the pre-flight time-out follows from what supervisor.c does about it. Brushless motors' spin-up is left out.
It is updated at 25 Hz and changes its state at most once an update.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

PERIOD_MS = 40
LEVEL_OUT_MS = 500
"""So long without a setpoint: level, with the thrust as it is."""
SHUTDOWN_MS = 2000
"""So long: motors off, and locked."""
WATCHDOG_MS = 1000
"""The emergency stop's watchdog, once it has been fed."""
FLYING_HYSTERESIS_MS = 2000
"""It counts as flying for so long after the last thrust."""
TILTED_G, TILTED_MS = 0.5, 1000
UPSIDE_DOWN_G, UPSIDE_DOWN_MS = -0.2, 100
FREE_FALL_G = 0.1


class State(IntEnum):
    """As in the firmware."""

    NOT_INITIALISED = 0
    CHECKS_NOT_PASSED = 1
    CHECKS_PASSED = 2
    READY_TO_FLY = 3
    FLYING = 4
    LANDED = 5
    RESET = 6
    LEVEL_OUT = 7
    FREE_FALL = 8
    LOCKED = 9
    CRASHED = 10


class Conditions(NamedTuple):
    """What an update looks at."""

    armed: bool
    flying: bool
    tumbled: bool
    late: bool
    """No setpoint for 500 ms."""
    silent: bool
    """None for 2 s."""
    emergency: bool
    crashed: bool
    waited: bool
    """Armed for long without flying."""
    rested: bool
    """Landed for long."""


def _always(_: Conditions) -> bool:
    return True


_TABLE: dict[State, tuple[tuple[State, Callable[[Conditions], bool]], ...]] = {
    State.NOT_INITIALISED: ((State.CHECKS_NOT_PASSED, _always),),
    State.CHECKS_NOT_PASSED: (
        (State.FREE_FALL, lambda c: c.emergency),
        (State.CHECKS_PASSED, lambda c: not c.tumbled),
    ),
    State.CHECKS_PASSED: (
        (State.FREE_FALL, lambda c: c.emergency),
        (State.CHECKS_NOT_PASSED, lambda c: c.tumbled),
        (State.READY_TO_FLY, lambda c: c.armed and not c.tumbled),
    ),
    State.READY_TO_FLY: (
        (State.FREE_FALL, lambda c: c.emergency),
        (State.CHECKS_NOT_PASSED, lambda c: c.tumbled or not c.armed),
        (State.FLYING, lambda c: c.flying),
        (State.CHECKS_PASSED, lambda c: c.waited),
    ),
    State.FLYING: (
        (State.FREE_FALL, lambda c: c.silent or c.emergency or not c.armed),
        (State.CRASHED, lambda c: c.tumbled),
        (State.LEVEL_OUT, lambda c: c.late),
        (State.LANDED, lambda c: not c.flying),
    ),
    State.LANDED: (
        (State.RESET, lambda c: c.rested),
        (State.FLYING, lambda c: c.flying),
    ),
    State.RESET: ((State.CHECKS_NOT_PASSED, _always),),
    State.LEVEL_OUT: (
        (State.FREE_FALL, lambda c: c.silent or c.tumbled or c.emergency or not c.armed),
        (State.FLYING, lambda c: not c.late),
    ),
    State.FREE_FALL: ((State.LOCKED, _always),),
    State.LOCKED: (),
    State.CRASHED: (
        (State.CHECKS_NOT_PASSED, lambda c: not c.crashed and not c.tumbled),
        (State.LOCKED, lambda c: c.emergency),
    ),
}
"""What leads where; the first line that holds is taken."""

_MOTORS_ALLOWED = frozenset({State.READY_TO_FLY, State.FLYING, State.LEVEL_OUT, State.LANDED})


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What the rest of the vehicle tells the supervisor at an update."""

    now_ms: int
    setpoint_ms: int
    """When the newest setpoint came."""
    motors_run: bool
    acceleration_g: tuple[float, float, float]
    """As the accelerometer has it, body axes: (0, 0, 1) at rest."""
    stop_parameter: bool
    tumble_check: bool
    preflight_timeout_ms: float
    landing_timeout_ms: float


class Supervisor:
    """One vehicle's; `said` collects what it prints."""

    def __init__(self, auto_arming: bool) -> None:
        self._auto_arming = auto_arming
        self._emergency = False
        self._watchdog_ms: int | None = None
        self._thrust_ms: int | None = None
        self._tumble_ms: int | None = None
        self._ready_ms = self._landed_ms = 0
        self._tumbled = False
        self.state = State.NOT_INITIALISED
        self.armed = self.crashed = False
        self.said: list[str] = []

    @property
    def motors_allowed(self) -> bool:
        """Whether the motors may turn."""
        return self.state in _MOTORS_ALLOWED

    @property
    def levels_out(self) -> bool:
        """Whether it flies level for want of setpoints."""
        return self.state is State.LEVEL_OUT

    @property
    def info(self) -> int:
        """The bit field `supervisor.info`, without the high-level commander's bits."""
        flies = self.state in (State.FLYING, State.LEVEL_OUT)
        locked = self.state is State.LOCKED
        can_arm = self.state is State.CHECKS_PASSED
        bits = (can_arm, self.armed, self._auto_arming, self.motors_allowed, flies, self._tumbled, locked, self.crashed)
        return sum(1 << bit for bit, is_set in enumerate(bits) if is_set)

    def request_arming(self, arm: bool) -> bool:
        """Arm or disarm; whether it is as asked."""
        if arm and not self.armed and self.state is not State.CHECKS_PASSED:
            return False
        self.armed = arm
        return True

    def request_recovery(self) -> bool:
        """Take a crash back; only while it stands upright."""
        if self._tumbled:
            return not self.crashed
        self.crashed = False
        return True

    def stop_emergency(self) -> None:
        """Stop for good: only a reboot helps."""
        self._emergency = True

    def feed_watchdog(self, now_ms: int) -> None:
        """From the first time on it must be fed, or everything stops."""
        self._watchdog_ms = now_ms

    def update(self, around: Surroundings) -> None:
        """One of 25 a second."""
        conditions = self._conditions(around)
        self._tumbled = conditions.tumbled
        for state, holds in _TABLE[self.state]:
            if holds(conditions):
                self._enter(state, around.now_ms)
                return

    def _conditions(self, around: Surroundings) -> Conditions:
        now_ms, age_ms = around.now_ms, around.now_ms - around.setpoint_ms
        starved = self._watchdog_ms is not None and now_ms >= self._watchdog_ms + WATCHDOG_MS
        return Conditions(
            armed=self.armed,
            flying=self._is_flying(around),
            tumbled=self._is_tumbled(around) and around.tumble_check,
            late=age_ms > LEVEL_OUT_MS,
            silent=age_ms > SHUTDOWN_MS,
            emergency=self._emergency or starved or around.stop_parameter,
            crashed=self.crashed,
            waited=self.state is State.READY_TO_FLY and now_ms - self._ready_ms > around.preflight_timeout_ms,
            rested=self.state is State.LANDED and now_ms - self._landed_ms > around.landing_timeout_ms,
        )

    def _is_flying(self, around: Surroundings) -> bool:
        if around.motors_run:
            self._thrust_ms = around.now_ms
        return self._thrust_ms is not None and around.now_ms - self._thrust_ms < FLYING_HYSTERESIS_MS

    def _is_tumbled(self, around: Surroundings) -> bool:
        """Tilted for long, or upside down for a little while; falling freely is neither."""
        up_g = around.acceleration_g[2]
        if all(abs(axis_g) < FREE_FALL_G for axis_g in around.acceleration_g):
            self._tumble_ms = None
        if up_g >= TILTED_G:
            self._tumble_ms = None
            return False
        self._tumble_ms = around.now_ms if self._tumble_ms is None else self._tumble_ms
        lasted_ms = around.now_ms - self._tumble_ms
        return lasted_ms > TILTED_MS or (up_g < UPSIDE_DOWN_G and lasted_ms > UPSIDE_DOWN_MS)

    def _enter(self, state: State, now_ms: int) -> None:
        before, self.state = self.state, state
        if state is State.READY_TO_FLY:
            self._ready_ms = now_ms
        if state is State.LANDED:
            self._landed_ms = now_ms
        if state is State.CRASHED:
            self.crashed = True
        if not self.motors_allowed:
            self.armed = False
        if state is State.CHECKS_PASSED and self._auto_arming:
            self.armed = True
        self._say(before, state)

    def _say(self, before: State, state: State) -> None:
        if state is State.LOCKED:
            self.said.append("SUP: Locked, reboot required\n")
        elif state is State.CRASHED:
            self.said.append("SUP: Crashed, recovery required\n")
        elif state is State.READY_TO_FLY and not self._auto_arming:
            self.said.append("SUP: Ready to fly\n")
        elif before in (State.READY_TO_FLY, State.LANDED) and not self.armed:
            self.said.append("SUP: Disarming\n")
