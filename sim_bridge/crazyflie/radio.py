"""The way between client and vehicle, with its faults: loss, delay, silence. Pure; time comes in as an argument."""

from __future__ import annotations

import random
from collections import deque

from sim_bridge.crazyflie.options import CrazyflieOptions

MOST_UNDER_WAY = 10_000
"""Datagrams; more are lost, so that a flood takes no memory."""
_NS_PER_MS = 1e6
_NS_PER_S = 1e9


class Radio:
    """Decides which datagrams arrive and when."""

    def __init__(self, options: CrazyflieOptions, seed: int) -> None:
        self._options = options
        self._draws = random.Random(seed)  # noqa: S311 - not a secret
        self._delay_ns = round(options.delay_ms * _NS_PER_MS)
        self._heard = 0

    def carries_up(self, now_ns: int, began_ns: int | None) -> bool:
        """Whether the client's next datagram arrives. began_ns: when the flight began; None: not yet."""
        self._heard += 1
        return self._heard != self._options.drop_at and self.carries_down(now_ns, began_ns)

    def carries_down(self, now_ns: int, began_ns: int | None) -> bool:
        """Whether the vehicle's next datagram arrives."""
        if self._frozen(now_ns, began_ns):
            return False
        return not self._options.drop or self._draws.random() >= self._options.drop

    def due_ns(self, now_ns: int) -> int:
        """When what is sent now arrives."""
        return now_ns + self._delay_ns

    def _frozen(self, now_ns: int, began_ns: int | None) -> bool:
        if self._options.freeze_s is None or began_ns is None:
            return False
        since_ns = now_ns - began_ns - self._options.freeze_s * _NS_PER_S
        return 0.0 <= since_ns < self._options.freeze_ms * _NS_PER_MS


class Queue:
    """Datagrams under way one way, in the order in which they were sent."""

    def __init__(self) -> None:
        self._under_way: deque[tuple[int, bytes]] = deque()

    def push(self, due_ns: int, datagram: bytes) -> None:
        """Send one."""
        if len(self._under_way) < MOST_UNDER_WAY:
            self._under_way.append((due_ns, datagram))

    def pop(self, now_ns: int) -> tuple[int, bytes] | None:
        """The next that has arrived by `now_ns`, with when."""
        return self._under_way.popleft() if self._under_way and self._under_way[0][0] <= now_ns else None
