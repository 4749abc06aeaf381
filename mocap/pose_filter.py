"""The pose filter: a pure step from frame to frame, and a report for any instant.

    frame -> order and clock (timing) -> axes -> gate -> motion (Kalman) -> report(now)

A track is believed once five frames in a row fitted one another, and lost after five rejected ones in a row or half a
second without a frame; after that the next usable frame begins a new one. Nothing here waits, reads a clock or raises.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from lcd_flight.model import PoseOptions, PoseReport, RawPose
from lcd_flight.wire.mocap_frame import MocapFrame
from mocap.axes import to_world
from mocap.gate import FREEZE_FRAMES, implausible, unusable
from mocap.motion import Motion, ahead, begun, followed
from mocap.timing import Timing, Window, counted_at, judged, rate_hz

CONFIRMING_FRAMES = 5
"""In a row that fit one another, before a track is believed."""
LOSING_REJECTS = 5
"""In a row, before it is given up."""
MAX_GAP_NS = 500_000_000
"""Longer without a frame, and the track begins anew."""

_NS = 1e-9


@dataclass(frozen=True, slots=True)
class Track:
    """One body, followed."""

    raw: RawPose
    """The newest frame in it."""
    motion: Motion
    frames: int = 1
    """Capped where the track is believed."""
    rejects: int = 0
    """In a row, since."""

    @property
    def believed(self) -> bool:
        """Whether enough frames fitted one another."""
        return self.frames >= CONFIRMING_FRAMES


@dataclass(frozen=True, slots=True)
class FilterState:
    """Everything the filter remembers."""

    timing: Timing | None = None
    track: Track | None = None
    newest: RawPose | None = None
    """The newest usable frame, fitting or not."""
    repeats: int = 1
    """How often in a row its very numbers came."""
    accepted: RawPose | None = None
    """The newest frame of a believed track."""
    arrivals: Window = ()
    """Of accepted frames."""
    received: int = 0
    lost: int = 0
    late: int = 0
    rejected: int = 0
    reason: str = ""


class PoseFilter:
    """The rules, without memory: all that is remembered is the state given and returned."""

    def __init__(self, options: PoseOptions) -> None:
        self._options = options
        self._coast_ns = round(options.coast_s / _NS)

    def step(self, state: FilterState, frame: MocapFrame, arrival_ns: int) -> FilterState:
        """Take one frame in."""
        verdict = judged(state.timing, frame, arrival_ns)
        state = replace(state, timing=verdict.timing, received=state.received + 1, lost=state.lost + verdict.lost)
        if verdict.refused:
            return replace(state, late=state.late + 1, reason=verdict.refused)
        if verdict.new_clock and state.newest is not None:
            state = replace(state, track=None, reason="the source's clock began anew")
        raw = _sign_continued(to_world(frame, arrival_ns), state.newest)
        fault = unusable(frame, raw, self._options.axes)
        if fault:
            return self._rejected(state, fault)
        repeats = state.repeats + 1 if state.newest is not None and _same_pose(raw, state.newest) else 1
        state = replace(state, newest=raw, repeats=repeats)
        if repeats >= FREEZE_FRAMES:
            return self._rejected(state, f"frozen: the very same pose {repeats} times")
        return self._tracked(state, raw)

    def malformed(self, state: FilterState, reason: str) -> FilterState:
        """Take note of bytes that were no frame."""
        return self._rejected(replace(state, received=state.received + 1), reason)

    def report(self, state: FilterState, now_ns: int) -> PoseReport:
        """The pose brought forward to `now_ns`, and the health of the source."""
        track, timing, accepted = state.track, state.timing, state.accepted
        pose = None
        if track is not None and track.believed and timing is not None:
            age_ns = max(0, now_ns - track.raw.source_stamp_ns - timing.offset_ns)
            pose = ahead(track.motion, age_ns * _NS) if age_ns <= self._coast_ns else None
        return PoseReport(
            state=pose,
            age_ns=None if accepted is None else now_ns - accepted.arrival_ns,
            raw=accepted,
            rate_hz=rate_hz(state.arrivals, now_ns),
            received=state.received,
            lost=state.lost,
            late=state.late,
            rejected=state.rejected,
            reject_reason=state.reason,
        )

    def _tracked(self, state: FilterState, raw: RawPose) -> FilterState:
        """Follow a usable pose, or reject it where it does not fit."""
        track = state.track
        gap_ns = 0 if track is None else raw.source_stamp_ns - track.raw.source_stamp_ns
        if track is None or gap_ns > MAX_GAP_NS:
            return replace(state, track=Track(raw, begun(raw, self._options)))
        fault = implausible(raw, track.raw, gap_ns * _NS, self._options)
        if fault:
            state = self._rejected(state, fault)
            return state if track.believed else replace(state, track=Track(raw, begun(raw, self._options)))
        motion = followed(track.motion, raw, gap_ns * _NS, self._options)
        track = Track(raw, motion, min(track.frames + 1, CONFIRMING_FRAMES))
        if not track.believed:
            return replace(state, track=track)
        return replace(state, track=track, accepted=raw, arrivals=counted_at(state.arrivals, raw.arrival_ns))

    def _rejected(self, state: FilterState, reason: str) -> FilterState:
        """Count a frame that is not believed; the fifth in a row ends the track."""
        track = state.track
        if track is not None:
            rejects = track.rejects + 1
            track = None if rejects >= LOSING_REJECTS else replace(track, rejects=rejects)
        return replace(state, track=track, rejected=state.rejected + 1, reason=reason)


def _same_pose(a: RawPose, b: RawPose) -> bool:
    return a.p_WB == b.p_WB and a.q_WB == b.q_WB


def _sign_continued(raw: RawPose, before: RawPose | None) -> RawPose:
    """q and -q are one attitude: take the sign nearer to the frame before."""
    if before is None:
        return raw
    x, y, z, w = raw.q_WB
    bx, by, bz, bw = before.q_WB
    return replace(raw, q_WB=(-x, -y, -z, -w)) if x * bx + y * by + z * bz + w * bw < 0.0 else raw
