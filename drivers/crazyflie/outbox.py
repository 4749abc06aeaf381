"""What goes to the vehicle next: the sender's rules, as a table of modes. Pure: time comes in as an argument.

- Before arming, nothing; from arming to the first setpoint, the zero setpoint that unlocks.
- A setpoint goes out once, while it is at most 50 ms old; the freshest wins; what has aged is never sent.
- From 100 ms without a fresh one, the fallback, level and slightly below hover thrust, at the control rate: the vehicle
  itself would level out after 500 ms and keep its last thrust. A fresh setpoint ends it; after 15 s the motors stop.
- Setpoints are of one type (a change of type resets the onboard controller); the end is `stop`, repeated, then
  `notify stop`, since silence after `stop` locks the vehicle.
- The emergency stop's watchdog is fed only while the control loop shows that it is alive.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto

from drivers.crazyflie import crtp_wire

MS = 1_000_000
PERIOD_NS = 10 * MS
"""Of everything that is repeated: the control rate."""
MAX_AGE_NS = 50 * MS
FALLBACK_NS = 100 * MS
FALLBACK_LIMIT_NS = 15_000 * MS
FEED_PERIOD_NS = 100 * MS
"""The vehicle wants its emergency watchdog fed every 1,000 ms."""
NOTIFICATIONS = 3
"""How often the end is told: a lost one would lock the vehicle."""
ALIVE_NS = 50 * MS
"""A control loop that has shown no sign for so long is not healthy."""


class Mode(Enum):
    """What kind of setpoint is due."""

    SILENT = auto()
    """None: not armed."""
    UNLOCK = auto()
    """Zero, repeated: armed, no setpoint yet."""
    FLYING = auto()
    """The control loop's."""
    FALLBACK = auto()
    """The link's own."""
    ENDING = auto()
    """`stop`, repeated; then silence is allowed."""
    STOPPED = auto()
    """`stop`, repeated: emergency."""


@dataclass(frozen=True, slots=True)
class Parcel:
    """A packet that is due."""

    packet: bytes
    setpoint: bool = False
    """Whether it decides what the motors do, and so belongs in the log."""


class Outbox:
    """Holds what is waiting and decides what is due. Whoever shares it between threads guards it."""

    def __init__(self, fallback: Callable[[], bytes], pose_rate_hz: float, watchdog: bytes | None = None) -> None:
        """fallback: makes the fallback's packet of what is known. watchdog: its feed; None where it is not wanted."""
        self.mode = Mode.SILENT
        self.latched = False
        """Whether there was an emergency stop: nothing but `stop` goes out any more."""
        self.stale = 0
        """Setpoints that aged here."""
        self._fallback, self._watchdog = fallback, watchdog
        self._pose_period_ns = round(1e9 / pose_rate_hz)
        self._setpoint: tuple[bytes, int] | None = None
        self._pose: bytes | None = None
        self._requests: deque[bytes] = deque(maxlen=100)
        self._fresh_ns = self._since_ns = self._repeat_ns = self._pose_ns = self._fed_ns = self._alive_ns = 0
        self._descending = self._unlocked = False

    def offer(self, packet: bytes, stamp_ns: int) -> None:
        """A fresh setpoint of the control loop, in place of one that may still be waiting."""
        self._setpoint = (packet, stamp_ns)
        self._alive_ns = max(self._alive_ns, stamp_ns)

    def alive(self, now_ns: int) -> None:
        """The control loop shows that it is."""
        self._alive_ns = now_ns

    def pose(self, packet: bytes, now_ns: int) -> None:
        """A pose; one that comes too soon after another is left out."""
        if now_ns >= self._pose_ns - self._pose_period_ns // 2:
            self._pose = packet
            self._pose_ns = max(self._pose_ns + self._pose_period_ns, now_ns)

    def request(self, packet: bytes) -> None:
        """Anything else, in order."""
        self._requests.append(packet)

    def unlock(self, now_ns: int) -> None:
        """Armed: zero setpoints until the control loop's come."""
        self._enter(Mode.UNLOCK, now_ns)

    def end(self, now_ns: int) -> None:
        """Stop the motors on the ground, and let the vehicle rest."""
        if self.mode is not Mode.SILENT:
            self._enter(Mode.ENDING, now_ns)

    def stop(self, now_ns: int) -> None:
        """Emergency stop, for good."""
        self._enter(Mode.STOPPED, now_ns)
        self.latched = True

    def descend(self, now_ns: int) -> None:
        """Whoever sent setpoints has failed: the fallback, and no setpoint ends it."""
        if self.mode in (Mode.FLYING, Mode.FALLBACK):
            self._descending = True
            self._enter(Mode.FALLBACK, now_ns)

    def rest(self) -> None:
        """Say that no setpoint will follow, and fall silent; after an emergency stop that is for good."""
        if self.mode is not Mode.SILENT:
            self._requests.extend([crtp_wire.NOTIFY_STOP] * NOTIFICATIONS)
            self.mode, self._setpoint = Mode.SILENT, None

    def due(self, now_ns: int) -> list[Parcel]:
        """What is to be handed to the driver now, in order."""
        parcels = [Parcel(packet) for packet in self._requests]
        self._requests.clear()
        setpoint = self._setpoint_due(now_ns)
        if setpoint is not None:
            parcels.append(Parcel(setpoint, setpoint=True))
        if self._pose is not None:
            parcels.append(Parcel(self._pose))
            self._pose = None
        if self._feed_due(now_ns):
            self._fed_ns = now_ns
            parcels.append(Parcel(self._watchdog or b""))
        return parcels

    def next_ns(self, now_ns: int) -> int:
        """When to look again, should nothing come before."""
        return now_ns + PERIOD_NS if self.mode is Mode.SILENT else max(self._repeat_ns, now_ns + MS)

    def _enter(self, mode: Mode, now_ns: int) -> None:
        if self.latched or self.mode is mode:
            return
        self.mode, self._since_ns, self._repeat_ns, self._setpoint = mode, now_ns, now_ns, None
        self._unlocked = False

    def _setpoint_due(self, now_ns: int) -> bytes | None:
        fresh = self._taken(now_ns)
        if fresh is not None and (self.mode in (Mode.FLYING, Mode.FALLBACK) or self._unlocked):
            self.mode, self._fresh_ns = Mode.FLYING, now_ns
            self._repeat_ns = now_ns + FALLBACK_NS
            return fresh
        if self.mode is Mode.FLYING and now_ns - self._fresh_ns >= FALLBACK_NS:
            self._enter(Mode.FALLBACK, now_ns)
        if self.mode is Mode.FALLBACK and now_ns - self._since_ns >= FALLBACK_LIMIT_NS:
            self.stop(now_ns)
        return self._repeated(now_ns)

    def _taken(self, now_ns: int) -> bytes | None:
        """The waiting setpoint, if it may be sent; it is not waiting any more."""
        waiting, self._setpoint = self._setpoint, None
        if waiting is None or self._descending:
            return None
        packet, stamp_ns = waiting
        if now_ns - stamp_ns <= MAX_AGE_NS:
            return packet
        self.stale += 1
        return None

    def _repeated(self, now_ns: int) -> bytes | None:
        """What a mode repeats at the control rate, where it is time."""
        if self.mode in (Mode.SILENT, Mode.FLYING) or now_ns < self._repeat_ns:
            return None
        self._repeat_ns = max(self._repeat_ns + PERIOD_NS, now_ns + PERIOD_NS // 2)
        match self.mode:
            case Mode.UNLOCK:
                self._unlocked = True
                return crtp_wire.UNLOCK
            case Mode.FALLBACK:
                return self._fallback()
        return crtp_wire.STOP

    def _feed_due(self, now_ns: int) -> bool:
        healthy = now_ns - self._alive_ns <= ALIVE_NS
        begun = self._fed_ns > 0 or self.mode is not Mode.SILENT
        return self._watchdog is not None and begun and healthy and now_ns - self._fed_ns >= FEED_PERIOD_NS
