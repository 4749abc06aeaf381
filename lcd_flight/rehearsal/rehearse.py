"""Fly a mission's plan many times in batched simulation, with noise and faults, before a motor turns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lcd_flight.mission.mission import Mission
from lcd_flight.mission.path_checks import leg_place
from lcd_flight.model import FlightPlan, FloatArray, RolloutLabels, RolloutOptions, Simulator, Trajectories, Vehicle
from lcd_flight.rehearsal.faults import noise_seeds, pose_gaps
from lcd_flight.rehearsal.verdict import Rehearsal, Spot

Progress = Callable[[int, int], None]
"""Called with runs done and runs in all."""

BATCH = 512
"""Runs flown in one call of the simulator."""


def rehearse(
    plan: FlightPlan,
    mission: Mission,
    vehicle: Vehicle,
    simulator: Simulator,
    *,
    runs: int | None = None,
    progress: Progress | None = None,
) -> Rehearsal:
    """The plan's legs, joined without their waits, flown `runs` times in the flight loop.

    runs: in place of the mission's `rehearse.runs`. Run n is the same whatever their number.
    """
    count = mission.rehearse.runs if runs is None else runs
    parts = []
    for first in range(0, count, BATCH):
        parts.append(_fly(plan, mission, vehicle, simulator, first, min(BATCH, count - first)))
        if progress is not None:
            progress(min(first + BATCH, count), count)
    return judge(RolloutLabels.concatenate(parts), plan, mission)


def _fly(
    plan: FlightPlan, mission: Mission, vehicle: Vehicle, simulator: Simulator, first: int, count: int
) -> RolloutLabels:
    """Runs `first` to `first + count`."""
    faults, joined = mission.rehearse.faults, plan.joined()
    gaps = pose_gaps(plan, mission.seed, first, count) if "mocap_dropout" in faults else None
    flown = vehicle if "motor_noise" in faults else replace(vehicle, motor_noise=0.0)
    copies = Trajectories(
        np.broadcast_to(joined.durations_s, (count, *joined.durations_s.shape)),
        np.broadcast_to(joined.coefficients, (count, *joined.coefficients.shape)),
    )
    options = RolloutOptions(loop="flight", pose_gap_ticks=gaps)
    return simulator.rollout(copies, flown, noise_seeds(mission.seed, first, count), options)


def judge(labels: RolloutLabels, plan: FlightPlan, mission: Mission) -> Rehearsal:
    """The verdict on flown runs; an error that is not a number counts as a crash."""
    errors = np.where(np.isfinite(labels.max_error_m), labels.max_error_m, np.inf)
    lands_at_m, limit_m = mission.safety.max_position_error_m, mission.safety.max_predicted_error_m
    completed = ~labels.crashed & (errors <= lands_at_m)
    worst = int(np.argmax(np.where(completed, errors, errors + errors.max() + 1.0)))
    segment = _segment(labels.segment_max_error_m[worst], limit_m)
    return Rehearsal(
        errors_m=errors,
        completed=np.asarray(completed),
        longest_saturation_s=float(labels.longest_saturation_s.max()),
        limit_m=limit_m,
        where=_spot(plan, mission, segment, float(labels.max_error_time_s[worst])),
    )


def _segment(errors_m: FloatArray, limit_m: float) -> int:
    """The first segment with an error above the limit, else the worst: a lost vehicle is furthest off at the end."""
    reached = np.nan_to_num(errors_m, nan=-np.inf)
    beyond = np.flatnonzero(reached > limit_m)
    return int(beyond[0]) if len(beyond) else int(np.argmax(reached))


def _spot(plan: FlightPlan, mission: Mission, segment: int, worst_time_s: float) -> Spot:
    """A segment of the joined flight, at the worst instant within it: where that came later, at its end."""
    lasts = np.cumsum([leg.trajectory.segments for leg in plan.legs])
    index = int(np.searchsorted(lasts, segment, side="right"))
    leg = plan.legs[index]
    began_s = sum(before.duration_s for before in plan.legs[:index])
    own = segment - (int(lasts[index]) - leg.trajectory.segments)
    knots = leg.trajectory.knot_times_s
    leg_time_s = float(np.clip(worst_time_s - began_s, knots[own], knots[own + 1]))
    return Spot(
        place=leg_place(leg, mission),
        leg=index,
        kind=leg.kind,
        segment=own,
        time_s=began_s + leg_time_s,
        leg_time_s=leg_time_s,
        p_W=leg.trajectory.reference(leg_time_s).p_W,
    )
