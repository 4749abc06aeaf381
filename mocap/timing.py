"""When frames were true: their order, the offset of the source's clock, and their rate.

Frames are numbered and stamped by the source. Transit only ever adds time, so the smallest (arrival - source stamp) of
the last ten seconds is the offset between the clocks, plus the least transit; what arrives later than that is late.
Sequence and stamp together tell a frame that overtook another from a publisher or a clock that began anew.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from lcd_flight.wire.mocap_frame import MocapFrame

LATE_NS = 20_000_000

_SECOND_NS = 1_000_000_000
_OFFSET_BUCKET_NS = _SECOND_NS
_RATE_BUCKET_NS = _SECOND_NS // 10
_BUCKETS = 10

Window: TypeAlias = tuple[tuple[int, int], ...]
"""(bucket number, value), oldest first, of the newest ten buckets in which something happened."""


@dataclass(frozen=True, slots=True)
class Timing:
    """What is known of the source's clock and count after its newest frame."""

    clock_id: str
    sequence: int
    source_ns: int
    offsets: Window
    """Smallest (arrival - source) of each of the last seconds."""

    @property
    def offset_ns(self) -> int:
        """Host's monotonic clock minus the source's."""
        return min(offset for _, offset in self.offsets)


@dataclass(frozen=True, slots=True)
class Judged:
    """What a frame's count and stamps say about it."""

    timing: Timing
    refused: str = ""
    """Why the frame must not be used; empty where it may."""
    lost: int = 0
    """Frames missing before this one."""
    new_clock: bool = False
    """Whether stamps before this frame cannot be compared with its own."""


def judged(timing: Timing | None, frame: MocapFrame, arrival_ns: int) -> Judged:
    """Place a frame among those before it."""
    if timing is None or frame.clock_id != timing.clock_id:
        return Judged(_fresh(frame, arrival_ns), new_clock=True)
    counted = frame.sequence > timing.sequence
    later = frame.source_time_ns > timing.source_ns
    if not counted and not later:
        again = frame.sequence == timing.sequence and frame.source_time_ns == timing.source_ns
        return Judged(timing, refused="duplicate" if again else "out of order")
    if counted and not later:  # the source's clock was set back
        return Judged(_fresh(frame, arrival_ns), new_clock=True)
    offset = arrival_ns - frame.source_time_ns
    offsets = added(timing.offsets, arrival_ns // _OFFSET_BUCKET_NS, offset, min)
    new = Timing(frame.clock_id, frame.sequence, frame.source_time_ns, offsets)
    lateness_ns = offset - new.offset_ns
    refused = f"late by {lateness_ns / 1e6:.0f} ms (limit {LATE_NS / 1e6:.0f} ms)" if lateness_ns > LATE_NS else ""
    # A smaller count with a later stamp is a publisher that was started again: nothing is known to be lost.
    return Judged(new, refused, lost=frame.sequence - timing.sequence - 1 if counted else 0)


def counted_at(arrivals: Window, arrival_ns: int) -> Window:
    """Count one arrival."""
    return added(arrivals, arrival_ns // _RATE_BUCKET_NS, 1, int.__add__)


def rate_hz(arrivals: Window, now_ns: int) -> float:
    """Arrivals over the last second: ten whole tenths of it, so that the rate lags by less than one tenth."""
    tenth = now_ns // _RATE_BUCKET_NS
    return float(sum(count for bucket, count in arrivals if tenth - _BUCKETS <= bucket < tenth))


def added(window: Window, bucket: int, value: int, combine: Callable[[int, int], int]) -> Window:
    """The window with `value` combined into `bucket`; buckets that are too old fall out."""
    if window and window[-1][0] == bucket:
        return (*window[:-1], (bucket, combine(window[-1][1], value)))
    return (*(entry for entry in window if bucket - _BUCKETS <= entry[0] < bucket), (bucket, value))


def _fresh(frame: MocapFrame, arrival_ns: int) -> Timing:
    bucket = arrival_ns // _OFFSET_BUCKET_NS
    offsets = ((bucket, arrival_ns - frame.source_time_ns),)
    return Timing(frame.clock_id, frame.sequence, frame.source_time_ns, offsets)
