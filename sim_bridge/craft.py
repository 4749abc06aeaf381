"""From the vocabulary's vehicles to what the kernels fly."""

from __future__ import annotations

import math

import numpy as np

from lcd_flight.control.adaptive import adaptation
from lcd_flight.control.drag_compensation import DragModel
from lcd_flight.control.flight_law import thrust_limit_N
from lcd_flight.control.geometric import Allocation
from lcd_flight.model import GeometricGains, InputError, Loop, Vehicle
from sim_bridge.kernels.block import Craft
from sim_bridge.kernels.guidance import ADAPTIVE, AGAINST_DRAG, FEED_FORWARD, GEOMETRIC, Law
from sim_bridge.kernels.lane import TICK_S
from sim_bridge.kernels.multirotor import airframe
from sim_bridge.kernels.onboard import NO_ONBOARD, onboard

SUBSTEPS = 2
"""Runge-Kutta steps of a tick in the paper's loop: 0.05 mm from the converged solution over 4.5 s."""


CONTROLLERS = {
    "geometric": GEOMETRIC,
    "geometric-feed-forward": FEED_FORWARD,
    "geometric-drag": AGAINST_DRAG,
    "geometric-l1": ADAPTIVE,
}
"""What `RolloutOptions.controller` may be, and the form of the law that it names (decisions 0011 and 0084)."""


def craft_of(vehicle: Vehicle, nominal: Vehicle, loop: Loop, controller: str = "geometric") -> Craft:
    """A vehicle with the controllers of a loop, which believe that they fly `nominal`.

    Raises:
        InputError: a loop, a controller or a vehicle that the simulator cannot fly.
    """
    _check(loop, controller)
    flight_loop = loop == "flight"
    try:
        air, below = airframe(vehicle), onboard(vehicle, nominal) if flight_loop else NO_ONBOARD
    except ValueError as error:
        raise InputError(str(error)) from error
    steps = round(TICK_S / below.period_s) if flight_loop else SUBSTEPS
    return Craft(
        air=air,
        law=_law_of(nominal, nominal.flight_gains if flight_loop else nominal.gains, CONTROLLERS[controller]),
        onboard=below,
        flight_loop=flight_loop,
        steps=steps,
        step_s=TICK_S / steps,
        motor_noise=vehicle.motor_noise,
        motor_decay=math.exp(-0.5 * TICK_S / steps / vehicle.motor_time_constant_s),
        initial_speed=vehicle.hover_rotor_speed,
    )


def _check(loop: Loop, controller: str) -> None:
    """Refuse what the simulator does not know."""
    if controller not in CONTROLLERS:
        raise InputError(f"controller {controller!r} is not known to the simulator; it has: {', '.join(CONTROLLERS)}")
    if loop not in ("paper", "flight"):
        raise InputError(f"loop {loop!r} is not known to the simulator; it has: paper, flight")
    if loop == "flight" and controller != "geometric":
        raise InputError(
            f"controller {controller!r} flies in the paper's loop only, down to the motors, which the flight loop "
            "leaves to the vehicle; take 'geometric'"
        )


def _law_of(vehicle: Vehicle, gains: GeometricGains, form: int) -> Law:
    """The law as a vehicle's controller has it."""
    return Law(
        mass_kg=vehicle.mass_kg,
        inertia_kg_m2=vehicle.inertia_kg_m2,
        position_gain=gains.position,
        velocity_gain=gains.velocity,
        attitude_gain=gains.attitude,
        rate_gain=gains.body_rates,
        allocation=_allocation(vehicle),
        form=form,
        drag=DragModel(vehicle.k_eta, vehicle.k_d, vehicle.k_z, vehicle.k_h, vehicle.parasitic_drag),
        adaptation=adaptation(vehicle.mass_kg, TICK_S, TICK_S),
        integral_gain=gains.integral,
        integral_limit=gains.integral_limit,
        thrust_limit_N=thrust_limit_N(vehicle),
    )


def _allocation(vehicle: Vehicle) -> Allocation:
    """The inverse of the map from rotor forces to collective thrust and moments."""
    x, y, _ = np.array(vehicle.rotor_positions_m).T
    torque_per_thrust_m = vehicle.k_m / vehicle.k_eta
    matrix = np.array([np.ones(4), y, -x, torque_per_thrust_m * np.array(vehicle.rotor_directions)])
    a, b, c, d = ((float(i), float(j), float(k), float(m)) for i, j, k, m in np.linalg.inv(matrix))
    return Allocation((a, b, c, d), vehicle.k_eta)
