"""What is known of a flight that is being watched; no clock, no terminal: times come in as arguments."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from lcd_flight.model import Finding, Leg
from lcd_flight.record import FlightHeader
from lcd_flight.record.live import live_header
from lcd_flight.wire.live_frame import LiveFlight, LiveReport

WINDOW_NS = 5_000_000_000
"""Over which the loop's timing is summed up."""
KEPT_LINES = 8


@dataclass(frozen=True, slots=True)
class Line:
    """A finding or a message of the vehicle."""

    time_s: float
    """Since the first report."""
    text: str
    finding: Finding | None
    """None for what the vehicle said."""


@dataclass(frozen=True, slots=True)
class LoopTiming:
    """How the loop kept time over the last seconds."""

    rate_hz: float
    max_lateness_s: float
    missed: int
    """Since the first report."""


class Picture:
    """Takes what is received, and is asked."""

    def __init__(self) -> None:
        self.header: FlightHeader | None = None
        self.report: LiveReport | None = None
        self.reports = 0
        self.lines: deque[Line] = deque(maxlen=KEPT_LINES)
        """The last ones."""
        self.told = 0
        """How many there were in all."""
        self.received_s = 0.0
        """When the newest report came, on the watcher's clock."""
        self._first_ns = 0
        self._missed = 0
        self._window: deque[LiveReport] = deque()

    def take(self, frame: LiveReport | LiveFlight, now_s: float) -> None:
        """Take one message that came at `now_s`.

        Raises:
            ValueError: the description is of another version.
        """
        if isinstance(frame, LiveFlight):
            self.header = live_header(frame)
            return
        if self.report is None or frame.tick.sequence < self.report.tick.sequence:
            self._begin(frame)
        self.report, self.received_s = frame, now_s
        self.reports += 1
        self._missed += frame.missed
        self._window.append(frame)
        while frame.tick.now_ns - self._window[0].tick.now_ns > WINDOW_NS:
            self._window.popleft()
        new = [Line(self.time_s, finding.message, finding) for finding in frame.findings]
        new += [Line(self.time_s, text, None) for text in frame.messages]
        self.lines += new
        self.told += len(new)

    def _begin(self, frame: LiveReport) -> None:
        """The first report, or the first of the next flight."""
        self._first_ns, self._missed = frame.tick.now_ns, 0
        self._window.clear()
        self.lines.clear()

    @property
    def time_s(self) -> float:
        """Of the newest report, since the first."""
        return 0.0 if self.report is None else (self.report.tick.now_ns - self._first_ns) * 1e-9

    @property
    def leg(self) -> Leg | None:
        """That is flown."""
        if self.report is None or self.header is None or self.report.tick.leg < 0:
            return None
        return self.header.plan.legs[self.report.tick.leg]

    @property
    def timing(self) -> LoopTiming:
        """Of the loop. The rate counts the ticks after the window's first report."""
        if not self._window:
            return LoopTiming(0.0, 0.0, 0)
        first, last = self._window[0], self._window[-1]
        lasted_s = (last.tick.now_ns - first.tick.now_ns) * 1e-9
        ticks = last.tick.sequence - first.tick.sequence
        lateness_ns = max(report.max_lateness_ns for report in self._window)
        return LoopTiming(ticks / lasted_s if lasted_s > 0.0 else 0.0, lateness_ns * 1e-9, self._missed)
