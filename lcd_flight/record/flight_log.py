"""A flight as arrays: one row a tick, one name a column."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lcd_flight.model import Finding, Telemetry, Tick, TickInputs
from lcd_flight.model.types import BoolArray, FloatArray, IntArray
from lcd_flight.record.header import FlightHeader


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """T ticks. SI units and radians; NaN where there was nothing to log."""

    now_ns: IntArray
    """(T,) host's monotonic time of each tick."""
    time_s: FloatArray
    """(T,) since the first tick."""
    dt_s: FloatArray
    phase: NDArray[np.str_]
    """(T,) values of `Phase`."""
    leg: IntArray
    """(T,) index into the plan's legs; -1 before take-off."""
    leg_time_s: FloatArray
    p_WB: FloatArray
    """(T, 3)"""
    v_WB_W: FloatArray
    """(T, 3)"""
    q_WB: FloatArray
    """(T, 4) xyzw"""
    w_WB_B: FloatArray
    """(T, 3)"""
    reference_p_W: FloatArray
    """(T, 3)"""
    reference_v_W: FloatArray
    """(T, 3)"""
    reference_a_W: FloatArray
    """(T, 3)"""
    reference_j_W: FloatArray
    """(T, 3)"""
    reference_yaw_rad: FloatArray
    reference_yaw_rate: FloatArray
    setpoint_thrust_N: FloatArray
    setpoint_q_WB: FloatArray
    """(T, 4) xyzw"""
    position_error_W: FloatArray
    """(T, 3) position minus reference."""
    saturated: BoolArray
    pose_age_s: FloatArray
    """(T,) since the newest accepted frame's arrival."""
    pose_rate_hz: FloatArray
    pose_counts: IntArray
    """(T, 4) received, lost, late, rejected since opening."""
    link_age_s: FloatArray
    link_counts: IntArray
    """(T, 3) sent, received, lost since connecting."""
    link_loss_share: FloatArray
    lateness_s: FloatArray
    """(T,) how long after its deadline each tick began."""
    missed: IntArray
    """(T,) ticks skipped just before each."""
    battery_V: FloatArray
    motor_shares: FloatArray
    """(T, M) commands as shares of full scale."""

    def __len__(self) -> int:
        """How many ticks there are."""
        return len(self.time_s)

    @property
    def error_m(self) -> FloatArray:
        """(T,) distance from the reference."""
        return np.asarray(np.linalg.norm(self.position_error_W, axis=1))


@dataclass(frozen=True, slots=True)
class TimedFinding:
    """A finding with the time during which consecutive ticks had it."""

    begin_s: float
    end_s: float
    finding: Finding
    """As it was at first."""


@dataclass(frozen=True, slots=True, eq=False)
class FlightLog:
    """All that a log says of a flight."""

    path: Path
    header: FlightHeader
    series: Series
    findings: tuple[TimedFinding, ...]
    """In the order of their beginning."""
    complete: bool
    """False where the file was cut or damaged: the end of the flight may be missing."""
    missing_ticks: int = 0
    """How many are missing in between: there was no room to log them, or the file was damaged."""


def series_of(pairs: Sequence[tuple[TickInputs, Tick]]) -> Series:
    """The columns of at least one tick."""
    inputs = [i for i, _ in pairs]
    ticks = [t for _, t in pairs]
    poses = [i.pose for i in inputs]
    links = [i.link for i in inputs]
    states = [pose.state for pose in poses]
    references = [t.reference for t in ticks]
    setpoints = [t.setpoint for t in ticks]
    telemetry = [link.telemetry for link in links]
    now_ns = np.array([t.now_ns for t in ticks], dtype=np.int64)
    return Series(
        now_ns=now_ns,
        time_s=(now_ns - now_ns[0]) / 1e9,
        dt_s=_column(ticks, "dt_s"),
        phase=np.array([t.phase.value for t in ticks]),
        leg=np.array([t.leg for t in ticks], dtype=np.int64),
        leg_time_s=_column(ticks, "leg_time_s"),
        p_WB=_table(states, "p_WB", 3),
        v_WB_W=_table(states, "v_WB_W", 3),
        q_WB=_table(states, "q_WB", 4),
        w_WB_B=_table(states, "w_WB_B", 3),
        reference_p_W=_table(references, "p_W", 3),
        reference_v_W=_table(references, "v_W", 3),
        reference_a_W=_table(references, "a_W", 3),
        reference_j_W=_table(references, "j_W", 3),
        reference_yaw_rad=_column(references, "yaw_rad"),
        reference_yaw_rate=_column(references, "yaw_rate"),
        setpoint_thrust_N=_column(setpoints, "thrust_N"),
        setpoint_q_WB=_table(setpoints, "q_WB", 4),
        position_error_W=_table(ticks, "position_error_W", 3),
        saturated=np.array([t.saturated for t in ticks], dtype=np.bool_),
        pose_age_s=_column(poses, "age_ns") / 1e9,
        pose_rate_hz=_column(poses, "rate_hz"),
        pose_counts=np.array([(p.received, p.lost, p.late, p.rejected) for p in poses], dtype=np.int64),
        link_age_s=_column(links, "age_ns") / 1e9,
        link_counts=np.array([(link.sent, link.received, link.lost) for link in links], dtype=np.int64),
        link_loss_share=_column(links, "loss_share"),
        lateness_s=np.array([i.now_ns - i.deadline_ns for i in inputs]) / 1e9,
        missed=np.array([i.missed for i in inputs], dtype=np.int64),
        battery_V=_column(telemetry, "battery_V"),
        motor_shares=_table(telemetry, "motor_shares", _motors(telemetry)),
    )


def findings_of(ticks: Sequence[Tick]) -> tuple[TimedFinding, ...]:
    """Findings as stretches: one that stays over consecutive ticks is one."""
    start_ns = ticks[0].now_ns
    open_now: dict[str, tuple[float, Finding]] = {}
    done: list[TimedFinding] = []
    end_s = 0.0
    for tick in ticks:
        time_s = (tick.now_ns - start_ns) * 1e-9
        codes = {finding.code for finding in tick.findings}
        for code in [code for code in open_now if code not in codes]:
            done.append(TimedFinding(open_now[code][0], end_s, open_now.pop(code)[1]))
        for finding in tick.findings:
            open_now.setdefault(finding.code, (time_s, finding))
        end_s = time_s
    done.extend(TimedFinding(begin_s, end_s, finding) for begin_s, finding in open_now.values())
    return tuple(sorted(done, key=lambda stretch: stretch.begin_s))


def missing_ticks(ticks: Sequence[Tick]) -> int:
    """How many numbers the sequence of at least one tick leaves out."""
    return ticks[-1].sequence - ticks[0].sequence + 1 - len(ticks)


def _column(records: Sequence[object], name: str) -> FloatArray:
    """(T,) one attribute of each record; NaN where the record or the attribute is None."""
    values = (getattr(record, name, None) for record in records)
    return np.array([math.nan if value is None else value for value in values], dtype=np.float64)


def _table(records: Sequence[object], name: str, width: int) -> FloatArray:
    """(T, width) one attribute of each record; NaN where the record or the attribute is None."""
    missing = (math.nan,) * width
    rows = (getattr(record, name, None) for record in records)
    return np.array([missing if row is None else row for row in rows], dtype=np.float64).reshape(len(records), width)


def _motors(telemetry: Sequence[Telemetry | None]) -> int:
    """How many motors were reported."""
    return max((len(t.motor_shares) for t in telemetry if t is not None and t.motor_shares is not None), default=0)
