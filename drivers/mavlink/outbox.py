"""What may go to the vehicle, and when: the rules, as a table of modes. Pure: time comes in as an argument.

- Before arming, nothing. To enter the autopilot's mode it wants a stream: level, far too weak to lift, made anew each
  time, on the ground only; it goes on until the control loop's first setpoint.
- In flight a setpoint goes out once, at once, while it is at most 50 ms old; the freshest wins; nothing is repeated.
- From 100 ms without a fresh one there is silence, and the autopilot's own failsafe acts. A fresh setpoint ends it.
- Once the pilot or the autopilot has taken over, no setpoint follows, whatever mode comes.
- The emergency stop is repeated until the vehicle says that it is disarmed.
"""

from __future__ import annotations

from enum import Enum, auto

MS = 1_000_000
PERIOD_NS = 10 * MS
"""Of a stream of our own: the control rate."""
MAX_AGE_NS = 50 * MS
FALLBACK_NS = 100 * MS
IDLE_LIMIT_NS = 10_000 * MS
"""So long an armed vehicle waits for the first setpoint; the flight itself gives up by then."""
STOP_PERIOD_NS = 50 * MS


class Mode(Enum):
    """What is due."""

    SILENT = auto()
    """Nothing."""
    IDLING = auto()
    """Level, too weak to lift, on the ground; setpoints are not taken yet."""
    READY = auto()
    """The same, until the first setpoint."""
    FLYING = auto()
    """The control loop's setpoints."""
    LANDING = auto()
    """Nothing: the autopilot lands by itself."""
    HANDED_OVER = auto()
    """Nothing, for good: somebody else flies."""
    STOPPED = auto()
    """The emergency stop, for good."""


class Outbox:
    """Decides; whoever has it sends."""

    def __init__(self) -> None:
        self.mode = Mode.SILENT
        self.stale = 0
        """Setpoints that were refused: too old, or older than one before."""
        self._newest_stamp_ns = 0
        self._fresh_ns = self._since_ns = 0
        self._next_ns = 0
        self._off = self._pilot = False

    @property
    def latched(self) -> bool:
        """Whether there was an emergency stop."""
        return self.mode is Mode.STOPPED

    @property
    def over(self) -> bool:
        """Whether nothing of ours may fly any more on this connection."""
        return self.mode in (Mode.STOPPED, Mode.HANDED_OVER)

    def admits(self, stamp_ns: int, now_ns: int) -> bool:
        """Whether a setpoint of the tick that began at `stamp_ns` may go out now; `sent` tells that it did."""
        if self.mode not in (Mode.READY, Mode.FLYING):
            return False
        if now_ns - stamp_ns > MAX_AGE_NS or stamp_ns < self._newest_stamp_ns:
            self.stale += 1
            return False
        return True

    def sent(self, stamp_ns: int, now_ns: int) -> None:
        """It went out: what did not is silence."""
        self.mode, self._newest_stamp_ns, self._fresh_ns = Mode.FLYING, stamp_ns, now_ns

    def falls_back(self, now_ns: int) -> bool:
        """Whether there has been silence for want of a fresh setpoint."""
        return self.mode is Mode.FLYING and now_ns - self._fresh_ns >= FALLBACK_NS

    def idles(self, now_ns: int) -> bool:
        """Whether a setpoint of our own is due now; it then counts as sent."""
        if self.mode not in (Mode.IDLING, Mode.READY) or now_ns < self._next_ns:
            return False
        if self.mode is Mode.READY and now_ns - self._since_ns > IDLE_LIMIT_NS:
            return False
        self._next_ns = max(self._next_ns + PERIOD_NS, now_ns + PERIOD_NS // 2)
        return True

    def stops(self, now_ns: int) -> bool:
        """Whether the emergency stop is due now; it then counts as sent."""
        if self.mode is not Mode.STOPPED or self._off or now_ns < self._next_ns:
            return False
        self._next_ns = now_ns + STOP_PERIOD_NS
        return True

    def confirm(self, *, armed: bool) -> None:
        """What the vehicle says after an emergency stop: one that is armed is stopped again."""
        self._off = not armed

    def idle(self, now_ns: int) -> None:
        """Stream setpoints of our own from now on."""
        self._enter(Mode.IDLING, now_ns)

    def ready(self, now_ns: int) -> None:
        """Take setpoints from now on."""
        self._enter(Mode.READY, now_ns)

    def land(self, now_ns: int) -> None:
        """The autopilot lands."""
        self._enter(Mode.LANDING, now_ns)

    def rest(self, now_ns: int) -> None:
        """Nothing more, until it is armed again."""
        self._enter(Mode.SILENT, now_ns)

    def hand_over(self, now_ns: int, *, to_pilot: bool) -> None:
        """Somebody else flies, or the autopilot by itself."""
        self._enter(Mode.HANDED_OVER, now_ns)
        self._pilot = to_pilot

    def stop(self, now_ns: int) -> None:
        """Emergency stop, for good. Not of a vehicle that a pilot flies."""
        if self.mode is Mode.HANDED_OVER and not self._pilot:
            self.mode, self._since_ns, self._next_ns = Mode.STOPPED, now_ns, now_ns
        self._enter(Mode.STOPPED, now_ns)

    def _enter(self, mode: Mode, now_ns: int) -> None:
        if self.over or self.mode is mode:
            return
        if not (self.mode is Mode.IDLING and mode is Mode.READY):
            self._next_ns = now_ns
        self.mode, self._since_ns = mode, now_ns
