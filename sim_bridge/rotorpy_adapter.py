"""Our vehicles and plans flown by RotorPy 3.0.0 itself: the oracle of the tests and the peer of the benchmark.

RotorPy is a development dependency; importing this module needs it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from rotorpy.controllers.quadrotor_control import SE3Control
from rotorpy.vehicles.multirotor import Multirotor

from lcd_flight.model import FloatArray, Trajectory, Vehicle
from sim_bridge.kernels.judge import MAX_RATE, MAX_SPEED
from sim_bridge.kernels.lane import TICK_S

GAINS = ((6.5, 6.5, 15.0), (4.0, 4.0, 9.0))
"""Position and velocity gains, which are constants in its SE3Control."""


@dataclass(frozen=True, slots=True, eq=False)
class RotorPyFlight:
    """One row for each tick of 10 ms, up to the plan's end or the early exit."""

    p_WB: FloatArray
    """(T, 3) m"""
    p_ref_W: FloatArray
    """(T, 3) m"""
    valid: bool
    """Whether it flew to the end."""

    @property
    def max_error_m(self) -> float:
        """Largest position error."""
        return float(np.linalg.norm(self.p_WB - self.p_ref_W, axis=1).max())


def fly(plan: Trajectory, vehicle: Vehicle, seed: int, *, start_aligned: bool = True) -> RotorPyFlight:
    """One rollout by its `Multirotor.step` and `SE3Control.update`: from rest, hovering, as `simulate` orders them."""
    np.random.seed(seed)  # RotorPy draws its motor noise from the global generator
    craft, controller = Multirotor(parameters(vehicle)), SE3Control(parameters(vehicle))
    state = initial_state(plan, vehicle, start_aligned=start_aligned)
    reference = flat_output(plan, 0.0)
    control = controller.update(0.0, state, reference)
    flown, wanted = [state["x"]], [reference["x"]]
    for tick in range(1, int(np.ceil(plan.duration_s / TICK_S - 1e-9)) + 1):
        state["wind"] = np.zeros(3)
        state = craft.step(state, control, TICK_S)
        if np.any(np.abs(state["v"]) > MAX_SPEED) or np.any(np.abs(state["w"]) > MAX_RATE):
            return RotorPyFlight(np.array(flown), np.array(wanted), valid=False)
        reference = flat_output(plan, tick * TICK_S)
        control = controller.update(tick * TICK_S, state, reference)
        flown.append(state["x"])
        wanted.append(reference["x"])
    return RotorPyFlight(np.array(flown), np.array(wanted), valid=True)


def parameters(vehicle: Vehicle) -> dict[str, Any]:
    """A vehicle as RotorPy's dictionary of parameters.

    Raises:
        ValueError: its gains are not the constants of RotorPy's controller.
    """
    if (vehicle.gains.position, vehicle.gains.velocity) != GAINS:
        raise ValueError(f"RotorPy's controller has the gains {GAINS}")
    ixx, iyy, izz = vehicle.inertia_kg_m2
    return {
        "mass": vehicle.mass_kg,
        **{"Ixx": ixx, "Iyy": iyy, "Izz": izz, "Ixy": 0.0, "Ixz": 0.0, "Iyz": 0.0},
        "num_rotors": 4,
        "rotor_pos": {f"r{i + 1}": np.array(r) for i, r in enumerate(vehicle.rotor_positions_m)},
        "rotor_directions": np.array(vehicle.rotor_directions),
        **dict(zip(("c_Dx", "c_Dy", "c_Dz"), vehicle.parasitic_drag, strict=True)),
        **{name: getattr(vehicle, name) for name in ("k_eta", "k_m", "k_d", "k_z", "k_h", "k_flap")},
        "tau_m": vehicle.motor_time_constant_s,
        "rotor_speed_min": vehicle.rotor_speed_min,
        "rotor_speed_max": vehicle.rotor_speed_max,
        "motor_noise_std": vehicle.motor_noise,
        "kp_att": vehicle.gains.attitude,
        "kd_att": vehicle.gains.body_rates,
    }


def initial_state(plan: Trajectory, vehicle: Vehicle, *, start_aligned: bool) -> dict[str, FloatArray]:
    """At rest on the plan's start, the rotors carrying the weight."""
    x, y, z, yaw = plan.waypoints()[0]
    half_yaw = 0.5 * yaw if start_aligned else 0.0
    return {
        "x": np.array([x, y, z]),
        "v": np.zeros(3),
        "q": np.array([0.0, 0.0, np.sin(half_yaw), np.cos(half_yaw)]),
        "w": np.zeros(3),
        "wind": np.zeros(3),
        "rotor_speeds": np.full(4, vehicle.hover_rotor_speed),
    }


def flat_output(plan: Trajectory, time_s: float) -> dict[str, Any]:
    """What its controller wants to know of the plan."""
    at = np.array([time_s])
    value, first, second = (plan.derivative(at, order)[0] for order in range(3))
    return {"x": value[:3], "x_dot": first[:3], "x_ddot": second[:3], "yaw": value[3], "yaw_dot": first[3]}
