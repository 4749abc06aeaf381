"""The way between client and vehicle, with its faults: loss, duplicates, another order, delay, silence.

Pure; time comes in as an argument.
"""

from __future__ import annotations

import heapq
import random

from sim_bridge.mavlink.options import MavlinkOptions

MOST_UNDER_WAY = 10_000
"""Datagrams; more are lost, so that a flood takes no memory."""
OVERTAKEN_NS = 15_000_000
"""What comes out of order comes so much later."""
_NS_PER_MS, _NS_PER_S = 1e6, 1e9


class Way:
    """One direction."""

    def __init__(self, options: MavlinkOptions, seed: int) -> None:
        self._options = options
        self._draws = random.Random(seed)  # noqa: S311 - not a secret
        self._delay_ns = round(options.delay_ms * _NS_PER_MS)
        self._under_way: list[tuple[int, int, bytes]] = []
        self._number = 0

    def send(self, datagram: bytes, now_ns: int, began_ns: int | None) -> None:
        """Send one. began_ns: when the vehicle was armed; None: it was not yet."""
        if self._silent(now_ns, began_ns) or self._happens(self._options.drop):
            return
        for _ in range(2 if self._happens(self._options.duplicate) else 1):
            late_ns = OVERTAKEN_NS if self._happens(self._options.reorder) else 0
            self._number += 1
            if len(self._under_way) < MOST_UNDER_WAY:
                heapq.heappush(self._under_way, (now_ns + self._delay_ns + late_ns, self._number, datagram))

    def arrived(self, now_ns: int) -> tuple[int, bytes] | None:
        """The next that has arrived by `now_ns`, with when."""
        if self._under_way and self._under_way[0][0] <= now_ns:
            due_ns, _, datagram = heapq.heappop(self._under_way)
            return due_ns, datagram
        return None

    def _happens(self, share: float) -> bool:
        return share > 0.0 and self._draws.random() < share

    def _silent(self, now_ns: int, began_ns: int | None) -> bool:
        if self._options.freeze_s is None or began_ns is None:
            return False
        since_ns = now_ns - began_ns - self._options.freeze_s * _NS_PER_S
        return 0.0 <= since_ns < self._options.freeze_ms * _NS_PER_MS
