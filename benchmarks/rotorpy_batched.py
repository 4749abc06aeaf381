"""Whole flights of many vehicles by RotorPy 3.0.0's batched form, with the integrator that can be trusted.

Its `rk4` takes one step of 10 ms over motors that lag by 5 ms and flies another vehicle; its default `dopri5` chooses
its steps and flies as the single form does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import torch
from rotorpy.controllers.quadrotor_control import BatchedSE3Control
from rotorpy.vehicles.multirotor import BatchedMultirotor, BatchedMultirotorParams

from lcd_flight.model import BoolArray, FloatArray, IntArray, Trajectories, Vehicle
from sim_bridge import rotorpy_adapter
from sim_bridge.kernels.judge import MAX_RATE, MAX_SPEED
from sim_bridge.kernels.lane import TICK_S

Integrator = Literal["dopri5", "rk4"]


@dataclass(frozen=True, slots=True, eq=False)
class BatchedFlights:
    """What came of N flights."""

    max_error_m: FloatArray
    """(N,) up to the plan's end or the early exit."""
    valid: BoolArray
    """(N,) whether each flew to its end."""
    p_WB: FloatArray
    """(T, N, 3) m; after a flight's end where it was then."""

    @property
    def crashed(self) -> BoolArray:
        """(N,) largest error above 1.5 m, or the early exit, as `RolloutLabels` has it."""
        return np.asarray((self.max_error_m > 1.5) | ~self.valid)


def fly_batch(
    plans: Trajectories, vehicle: Vehicle, seed: int, *, start_aligned: bool = True, integrator: Integrator = "dopri5"
) -> BatchedFlights:
    """Fly all plans from rest, hovering, in the order of its `simulate`; noise comes from torch's generator."""
    torch.manual_seed(seed)
    craft, controller, state = batch_of(plans, vehicle, start_aligned=start_aligned, integrator=integrator)
    count = len(plans)
    last_tick = np.ceil(plans.durations_s.sum(axis=1) / TICK_S - 1e-9).astype(np.int64)
    largest, valid, flown = np.zeros(count), np.ones(count, dtype=bool), [state["x"].numpy().copy()]
    references = References(plans)
    control = controller.update(0.0, state, references.at(0.0), np.arange(count))
    for tick in range(1, int(last_tick.max()) + 1):
        flies = np.nonzero(valid & (tick <= last_tick))[0]
        state["wind"] = torch.zeros(count, 3, dtype=torch.float64)
        kept = state["x"].numpy().copy()
        state = craft.step(state, control, TICK_S, flies)
        valid[flies] = _within(state, flies)
        counted = flies[valid[flies]]
        wanted = references.at(tick * TICK_S)
        kept[counted] = state["x"].numpy()[counted]
        error = np.linalg.norm(kept[counted] - wanted["x"].numpy()[counted], axis=1)
        largest[counted] = np.maximum(largest[counted], error)
        flown.append(kept)
        state["x"] = torch.from_numpy(kept.copy())
        if len(counted):
            control = controller.update(tick * TICK_S, state, wanted, counted)
    return BatchedFlights(largest, valid, np.array(flown))


def _within(state: dict[str, Any], rows: IntArray) -> BoolArray:
    """Which of the rows are still where the model holds."""
    v, w = state["v"].numpy()[rows], state["w"].numpy()[rows]
    return np.asarray((np.abs(v) <= MAX_SPEED).all(axis=1) & (np.abs(w) <= MAX_RATE).all(axis=1))


def batch_of(
    plans: Trajectories, vehicle: Vehicle, *, start_aligned: bool = True, integrator: Integrator = "rk4"
) -> tuple[BatchedMultirotor, BatchedSE3Control, dict[str, Any]]:
    """Its vehicles, their controller and their state at the plans' starts."""
    count, device = len(plans), torch.device("cpu")
    shared = BatchedMultirotorParams([rotorpy_adapter.parameters(vehicle)] * count, count, device)
    starts = [rotorpy_adapter.initial_state(plan, vehicle, start_aligned=start_aligned) for plan in plans]
    state = {key: torch.from_numpy(np.stack([start[key] for start in starts])) for key in starts[0]}
    craft = BatchedMultirotor(shared, count, state, device, integrator=integrator)
    return craft, BatchedSE3Control(shared, count, device), state


class References:
    """Plans as RotorPy's batched controller wants to know them."""

    def __init__(self, plans: Trajectories) -> None:
        self._ends = np.cumsum(plans.durations_s, axis=1)
        self._starts = self._ends - plans.durations_s
        self._coefficients = plans.coefficients

    def at(self, time_s: float) -> dict[str, Any]:
        """Flat outputs of all plans at one time; after its end a plan rests."""
        rows = np.arange(len(self._ends))
        time = np.minimum(time_s, self._ends[:, -1])
        segment = np.minimum((time[:, None] >= self._ends).sum(axis=1), self._ends.shape[1] - 1)
        own = self._coefficients[rows, :, segment]
        powers = np.arange(8)
        into = (time - self._starts[rows, segment])[:, None] ** powers
        value = np.einsum("nak,nk->na", own, into)
        first = np.einsum("nak,nk->na", own[..., 1:] * powers[1:], into[:, :-1])
        second = np.einsum("nak,nk->na", own[..., 2:] * (powers[2:] * powers[1:-1]), into[:, :-2])
        x, x_dot, x_ddot = (torch.from_numpy(np.ascontiguousarray(part[:, :3])) for part in (value, first, second))
        yaw, yaw_dot = torch.from_numpy(value[:, 3].copy()), torch.from_numpy(first[:, 3].copy())
        return {"x": x, "x_dot": x_dot, "x_ddot": x_ddot, "yaw": yaw, "yaw_dot": yaw_dot}
