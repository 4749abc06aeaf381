"""A flight as a recording for Rerun (extra `rerun`): the vehicle among plan, waypoints and fence, and the series."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from lcd_flight.files import write_whole
from lcd_flight.model import RefusedError
from lcd_flight.model.types import FloatArray
from lcd_flight.record import FlightLog
from lcd_flight.review.kinematics import attitude_error_rad
from lcd_flight.review.space import space_of

_FLOWN, _REFERENCE, _BASELINE = (29, 95, 224), (100, 114, 138), (217, 118, 10)
_WAYPOINT_RADIUS_M, _AXES_M = 0.04, 0.2


def write_rerun(log: FlightLog, path: Path) -> Path:
    """Write the recording; its time line `flight` counts from the first tick.

    Raises:
        InputError: the file cannot be written.
        RefusedError: rerun-sdk is not installed.
    """
    try:
        import rerun
    except ImportError as error:
        raise RefusedError("--rerun takes rerun-sdk: pip install 'lcd-flight[rerun]'") from error
    write_whole(path, b"")  # what is wrong with the place is said by us and not by Rerun
    with rerun.RecordingStream(f"lcd-flight {log.header.name}") as recording:
        recording.save(path)
        _log_space(rerun, recording, log)
        _log_vehicle(rerun, recording, log)
        for name, values in _scalars(log).items():
            known = np.isfinite(values)
            time = rerun.TimeColumn("flight", duration=log.series.time_s[known])
            recording.send_columns(name, indexes=[time], columns=rerun.Scalars.columns(scalars=values[known]))
        _log_findings(rerun, recording, log)
        recording.flush()
    return path


def _log_space(rerun: Any, recording: Any, log: FlightLog) -> None:
    """What stands still."""
    space = space_of([log], [0.0])
    lines = {
        "world/flown": ([row.points for row in space.flown if len(row.points)], _FLOWN),
        "world/reference": (list(space.references), _REFERENCE),
        "world/minimum_snap": (list(space.baselines), _BASELINE),
    }
    for name, (paths, color) in lines.items():
        if paths:
            recording.log(name, rerun.LineStrips3D(paths, colors=color), static=True)
    if len(space.waypoints):
        labels = [str(number) for number in range(1, len(space.waypoints) + 1)]
        points = rerun.Points3D(space.waypoints, labels=labels, radii=_WAYPOINT_RADIUS_M)
        recording.log("world/waypoints", points, static=True)
    fence = log.header.limits.geofence
    recording.log(
        "world/fence", rerun.Boxes3D(mins=[fence.low_m], sizes=[_size(fence.low_m, fence.high_m)]), static=True
    )


def _size(low: tuple[float, ...], high: tuple[float, ...]) -> list[float]:
    return [b - a for a, b in zip(low, high, strict=True)]


def _log_vehicle(rerun: Any, recording: Any, log: FlightLog) -> None:
    """What moves."""
    series = log.series
    known = np.isfinite(series.p_WB).all(axis=1)
    time = rerun.TimeColumn("flight", duration=series.time_s[known])
    poses = rerun.Transform3D.columns(translation=series.p_WB[known], quaternion=series.q_WB[known])
    recording.send_columns("world/vehicle", indexes=[time], columns=poses)
    recording.log("world/vehicle", rerun.TransformAxes3D(_AXES_M), static=True)


def _scalars(log: FlightLog) -> dict[str, FloatArray]:
    series = log.series
    return {
        "error_m": series.error_m,
        "speed": np.asarray(np.linalg.norm(series.v_WB_W, axis=1)),
        "thrust_N": series.setpoint_thrust_N,
        "attitude_error_rad": attitude_error_rad(series),
        "saturated": series.saturated.astype(np.float64),
        "battery_V": series.battery_V,
        "pose_age_s": series.pose_age_s,
        "link_loss_share": series.link_loss_share,
        "lateness_s": series.lateness_s,
    }


def _log_findings(rerun: Any, recording: Any, log: FlightLog) -> None:
    for row in log.findings:
        recording.set_time("flight", duration=row.begin_s)
        level = "WARN" if row.finding.severity.name in ("INFO", "WARN") else "ERROR"
        recording.log("findings", rerun.TextLog(f"{row.finding.code}: {row.finding.message}", level=level))
