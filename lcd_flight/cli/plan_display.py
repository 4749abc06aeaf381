"""Plans in words: lines for people, facts for JSON. `lcd plan` and `lcd-fly` share them."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lcd_flight.cli.mission import tell_mission
from lcd_flight.cli.terminal import Terminal

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lcd_flight.api import PreparedFlight
    from lcd_flight.mission import Mission
    from lcd_flight.mission.planned import TrajectorySummary
    from lcd_flight.planning.limits import Peaks


def tell_plan(
    terminal: Terminal,
    mission: str | Mission,
    *,
    plan_file: Path | None = None,
    csv_files: Sequence[Path] = (),
    cache: bool = True,
) -> PreparedFlight:
    """Load and plan, or load the plan too (`api.plan`), a line for each of the two."""
    from lcd_flight import api
    from lcd_flight.mission import load_mission

    loaded = load_mission(mission) if isinstance(mission, str) else mission
    tell_mission(terminal, loaded)
    began_s = time.perf_counter()
    terminal.status(f"planning by {loaded.planner.type} ...")
    try:
        flight = api.plan(loaded, plan_file=plan_file, csv_files=csv_files, cache=cache)
    finally:
        terminal.end_status()
    took_ms = (time.perf_counter() - began_s) * 1e3
    for note in flight.planned.notes:
        terminal.warn(note)
    for summary in flight.planned.summaries:
        told = _source(flight) or ("from the cache" if summary.cached else f"{took_ms:.0f} ms")
        _tell_trajectory(terminal, summary, told)
    if not flight.planned.summaries:
        terminal.line("PLAN", "no trajectory: take-off, holds and landing only")
    return flight


def _source(flight: PreparedFlight) -> str:
    """Which file a plan comes from; empty where it was planned."""
    return f"from {flight.planned.source}" if flight.planned.source else ""


def _tell_trajectory(terminal: Terminal, summary: TrajectorySummary, whence: str) -> None:
    """Which planner, and what it made better."""
    before, after = summary.minimum_snap_peaks, summary.peaks
    if summary.method == "minimum-snap":
        terminal.line("PLAN", f"minimum snap, {whence}")
        if summary.fallback is not None:
            terminal.warn(f"{summary.place}: minimum snap in place of the plan asked for: {summary.fallback}")
        terminal.detail(f"peak thrust {after.thrust_ratio.value:.0%}; peak speed {after.speed.value:.1f} m/s")
        return
    terminal.line("PLAN", f"minimum snap -> {summary.method}, {whence}")
    told = [
        f"peak thrust {before.thrust_ratio.value:.0%} -> {after.thrust_ratio.value:.0%}",
        f"peak speed {before.speed.value:.1f} -> {after.speed.value:.1f} m/s",
        f"snap x{summary.relative_snap:.2f}",
    ]
    if summary.predicted_max_error_m is not None and summary.minimum_snap_predicted_max_error_m is not None:
        least = summary.minimum_snap_predicted_max_error_m
        told.insert(0, f"predicted max error {least:.2f} -> {summary.predicted_max_error_m:.2f} m")
    terminal.detail("; ".join(told))


def plan_facts(flight: PreparedFlight) -> dict[str, Any]:
    """What a plan knows of itself, for JSON."""
    return {
        "mission": flight.mission.name,
        "duration_s": flight.planned.plan.duration_s,
        "plan_source": flight.planned.source or None,
        "trajectories": [_trajectory_facts(summary) for summary in flight.planned.summaries],
    }


def _trajectory_facts(summary: TrajectorySummary) -> dict[str, Any]:
    return {
        "place": summary.place,
        "method": summary.method,
        "fallback": summary.fallback,
        "cached": summary.cached,
        "model": None if summary.model is None else summary.model.name,
        "waypoints": summary.waypoints,
        "duration_s": summary.duration_s,
        "relative_snap": summary.relative_snap,
        "predicted_max_error_m": summary.predicted_max_error_m,
        "minimum_snap_predicted_max_error_m": summary.minimum_snap_predicted_max_error_m,
        **_peak_facts("", summary.peaks),
        **_peak_facts("minimum_snap_", summary.minimum_snap_peaks),
    }


def _peak_facts(prefix: str, peaks: Peaks) -> dict[str, float]:
    return {
        f"{prefix}peak_thrust_ratio": peaks.thrust_ratio.value,
        f"{prefix}peak_speed_m_per_s": peaks.speed.value,
        f"{prefix}peak_tilt_rad": peaks.tilt.value,
        f"{prefix}peak_body_rate_rad_per_s": peaks.body_rate.value,
    }
