"""What a stream still has to carry, so that nothing old is carried. Pure: times and the system's figures come in.

A datagram leaves at once or not at all. Bytes of a stream wait: here, where they can still be left out, and in the
system, where they cannot be taken back. The system tells how many bytes it holds, not since when; that is known here.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

BACKLOG = 2048
"""Bytes that may wait, here and in the system: a tenth of a second of commands, poses and setpoints."""
WAIT_S = 0.4
"""So long a packet may wait here: a command is asked again by then, and a pose is worth nothing."""


@dataclass(slots=True)
class _Packet:
    """One packet that waits."""

    since_s: float
    rest: bytes
    begun: bool
    """Whether a part of it has gone: the rest must follow, or the other side cannot read on."""


class Backlog:
    """Of one stream."""

    def __init__(self) -> None:
        self.dropped = 0
        """Packets that waited too long."""
        self._packets: deque[_Packet] = deque()
        self._written = 0
        self._writes: deque[tuple[int, float]] = deque(maxlen=BACKLOG)
        """How many bytes had been handed over after each write, and when it was."""

    def __len__(self) -> int:
        """Bytes that wait here."""
        return sum(len(packet.rest) for packet in self._packets)

    def add(self, data: bytes, now_s: float, *, begun: bool = False) -> None:
        """Let a packet wait, or what is left of one that has begun to go."""
        self._packets.append(_Packet(now_s, data, begun))

    def next(self, now_s: float) -> bytes:
        """What must go next, nothing where nothing does; packets that have waited too long are left out."""
        while self._packets:
            packet = self._packets[0]
            if packet.begun or now_s - packet.since_s <= WAIT_S:
                return packet.rest
            self._packets.popleft()
            self.dropped += 1
        return b""

    def take(self, count: int) -> None:
        """So many bytes of what was next have gone."""
        packet = self._packets[0]
        packet.rest, packet.begun = packet.rest[count:], packet.begun or count > 0
        if not packet.rest:
            self._packets.popleft()

    def note(self, count: int, now_s: float) -> None:
        """So many bytes were handed to the system."""
        if count:
            self._written += count
            self._writes.append((self._written, now_s))

    def age_s(self, held: int, now_s: float) -> float:
        """How long the oldest of the `held` bytes that the system still has has been there; 0 without any."""
        gone = self._written - held
        while self._writes and self._writes[0][0] <= gone:
            self._writes.popleft()
        return now_s - self._writes[0][1] if self._writes else 0.0

    def clear(self) -> None:
        """Forget everything: the connection is over."""
        self._packets.clear()
        self._writes.clear()
        self._written = 0
