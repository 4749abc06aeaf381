"""One rollout with everything that happened in it, for tests, reviews and pictures. It is the kernel's own memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcd_flight.model import FloatArray, RolloutLabels, RolloutOptions, Trajectories, Trajectory, Vehicle
from sim_bridge.kernels import rows
from sim_bridge.kernels.lane import TICK_S
from sim_bridge.kernels.rows import LANES, ROWS
from sim_bridge.rollouts import fly, labels_of


@dataclass(frozen=True, slots=True, eq=False)
class RolloutTrace:
    """One row for each tick of 10 ms; what is commanded is what was flown until this tick."""

    times_s: FloatArray
    p_WB: FloatArray
    """(T, 3) m"""
    v_WB_W: FloatArray
    """(T, 3) m/s"""
    q_WB: FloatArray
    """(T, 4) xyzw"""
    w_WB_B: FloatArray
    """(T, 3) rad/s"""
    rotor_speeds: FloatArray
    """(T, 4) rad/s"""
    rotor_commands: FloatArray
    """(T, 4) rad/s; in the flight loop, of the last period of the onboard controller."""
    p_ref_W: FloatArray
    """(T, 3) m"""
    v_ref_W: FloatArray
    """(T, 3) m/s"""
    yaw_ref_rad: FloatArray
    """(T,)"""
    clipped: FloatArray
    """(T,) motor commands clipped since the last tick, of 4."""
    labels: RolloutLabels
    """Of this one rollout."""


def trace(plan: Trajectory, vehicle: Vehicle, seed: int, options: RolloutOptions) -> RolloutTrace:
    """Fly one plan as `MultirotorSimulator.rollout` would and keep every tick, up to its end or the early exit.

    Raises:
        InputError: as `rollout`.
    """
    ticks = int(np.ceil(plan.duration_s / TICK_S - 1e-9)) + 1
    seeds = np.array([seed], dtype=np.uint64)
    results = fly(Trajectories.stack([plan]), vehicle, seeds, options, ticks)
    flown = int(results.labels[0, rows.SAMPLES - rows.ALIVE])
    # All lanes of the block are copies of the one row.
    memory = results.trace[:flown].reshape(flown, ROWS, LANES)[:, :, 0]
    return RolloutTrace(
        times_s=TICK_S * np.arange(flown, dtype=np.float64),
        p_WB=memory[:, rows.MOTION : rows.MOTION + 3],
        v_WB_W=memory[:, rows.MOTION + 3 : rows.MOTION + 6],
        q_WB=memory[:, rows.MOTION + 6 : rows.MOTION + 10],
        w_WB_B=memory[:, rows.MOTION + 10 : rows.MOTION + 13],
        rotor_speeds=memory[:, rows.SPEEDS : rows.SPEEDS + 4],
        rotor_commands=memory[:, rows.COMMANDS : rows.COMMANDS + 4],
        p_ref_W=memory[:, rows.REFERENCE : rows.REFERENCE + 3],
        v_ref_W=memory[:, rows.REFERENCE + 3 : rows.REFERENCE + 6],
        yaw_ref_rad=memory[:, rows.REFERENCE + 9],
        clipped=memory[:, rows.CLIPS],
        labels=labels_of(results),
    )
