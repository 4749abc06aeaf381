"""Packets lost on the way here, by the gaps in a sender's sequence numbers. Pure.

A late packet is not lost after all, a second copy counts once, and a sender that was restarted or not heard for a while
begins anew: its numbers then say nothing about the ones before. A number that looks old is far ahead where there was
time to send all those between. Numbers go around after 256: what a longer outage lost counts less 256.
"""

from __future__ import annotations

from collections import deque

NUMBERS = 256
WINDOW = 64
"""So many numbers back, a packet may still come late; further back is a restart."""
RESTART_AFTER = 3
"""Old numbers that follow each other: not late packets but a sender that counts from the beginning."""
AVERAGED = 64
"""Packets over which the sender's period is averaged."""
SHORTEST_PERIOD_NS = 500_000.0
"""No sender is faster; the first packets may come all at once, and would make its period nothing."""
SILENCE_NS = 1_000_000_000
"""After so long a gap is not loss but absence, which is judged by its age."""
_SECOND_NS = 1_000_000_000
_MASK = (1 << WINDOW) - 1


class LossCounter:
    """Counts for one sender: one (system, component)."""

    def __init__(self) -> None:
        self.received = 0
        """Without second copies."""
        self.lost = 0
        self.late = 0
        self.duplicates = 0
        self.restarts = 0
        self._last: int | None = None
        self._last_ns = 0
        self._period_ns = float(SILENCE_NS)
        """Between packets of this sender, on average."""
        self._seen = 0
        """One bit for each of the last numbers, the newest lowest."""
        self._old = 0
        self._old_number: int | None = None
        self._last_second: deque[tuple[int, int]] = deque()
        """Arrival of each packet, and what its number said was missing."""

    def take(self, number: int, now_ns: int) -> bool:
        """Note one packet; False where it is a second copy."""
        last, late_ns = self._last, now_ns - self._last_ns
        self._last_ns = now_ns
        if last is None or late_ns > SILENCE_NS:
            self._begin(number)
            return self._count(now_ns, 0)
        ahead = (number - last) % NUMBERS
        if 0 < ahead < NUMBERS - WINDOW or self._had_time_for(ahead or NUMBERS, late_ns):
            return self._take_new(number, ahead or NUMBERS, now_ns, late_ns)
        return self._take_old(number, (last - number) % NUMBERS, now_ns)

    def share(self, now_ns: int) -> float:
        """Lost packets as a share, over the last second."""
        while self._last_second and self._last_second[0][0] <= now_ns - _SECOND_NS:
            self._last_second.popleft()
        missing = max(sum(count for _, count in self._last_second), 0)
        return missing / max(1, missing + len(self._last_second))

    def _had_time_for(self, packets: int, late_ns: int) -> bool:
        """Whether the sender may have sent so many since the newest that came, at up to twice its average rate."""
        return 2 * late_ns >= packets * max(self._period_ns, SHORTEST_PERIOD_NS)

    def _take_new(self, number: int, ahead: int, now_ns: int, late_ns: int) -> bool:
        """A number further on than any before."""
        self._last, self._seen, self._old = number, (self._seen << ahead | 1) & _MASK, 0
        self._period_ns += (late_ns / ahead - self._period_ns) / min(self.received, AVERAGED)
        return self._count(now_ns, ahead - 1)

    def _take_old(self, number: int, back: int, now_ns: int) -> bool:
        """A number that has been, or should have been, before."""
        follows = self._old_number is not None and number == (self._old_number + 1) % NUMBERS
        self._old = self._old + 1 if follows else 1
        self._old_number = number
        if self._old >= RESTART_AFTER:
            self.restarts += 1
            self._begin(number)
            return self._count(now_ns, 0)
        if self._seen >> back & 1:
            self.duplicates += 1
            return False
        self._seen |= 1 << back
        self.late += 1
        return self._count(now_ns, -1)

    def _begin(self, number: int) -> None:
        self._last, self._seen, self._old = number, _MASK, 0

    def _count(self, now_ns: int, missing: int) -> bool:
        self.received += 1
        self.lost += missing
        self._last_second.append((now_ns, missing))
        return True
