"""Paths that are not in the plan: stop, land from here, go back, and the descent without pose. Pure."""

from __future__ import annotations

import math

import numpy as np

from lcd_flight.model import AttitudeThrust, FloatArray, State, Trajectory, Vehicle
from lcd_flight.model.frames import from_yaw, wrapped, yaw_of
from lcd_flight.model.trajectory import COEFFICIENTS
from lcd_flight.safety.fence import STOPPING_DECELERATION

DESCENT_SPEED = 0.4
"""m/s, of a landing under position control."""
PRESS_DEPTH_M = 0.5
"""How far below the ground a landing's reference goes on, so that thrust falls off and the vehicle is seen to stand."""
RETURN_SPEED = 1.0
"""m/s, peak of the way back to an interrupted leg."""
HARDEST_DECELERATION = 2.0 * STOPPING_DECELERATION
"""m/s^2, of a stop for which there is little room above the ground."""
BLIND_ACCELERATION = 0.5
"""m/s^2 downwards, of the descent without pose."""
BLIND_MARGIN = 1.5
"""On the computed time of the descent without pose, for thrust that is stronger than believed."""

_REST_TO_REST = (0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0)
"""Of the unit step in unit time: minimum snap, at rest to jerk at both ends. Its peak speed is 35/16."""


def stop(state: State, ground_z_m: float) -> Trajectory:
    """Straight on, braking at the stopping deceleration, harder above near ground; then holds position and heading."""
    duration_s = _braking_s(state, math.hypot(*state.v_WB_W), ground_z_m)
    segment = _constant_acceleration(state, state.v_WB_W, (0.0, 0.0, 0.0), duration_s)
    return Trajectory(np.array([duration_s]), segment)


def land_from(state: State, ground_z_m: float) -> Trajectory:
    """Straight down from here at `DESCENT_SPEED` once the present velocity is braked, to below the ground."""
    vx, vy, vz = state.v_WB_W
    duration_s = _braking_s(state, math.hypot(vx, vy, vz + DESCENT_SPEED), ground_z_m)
    braking = _constant_acceleration(state, state.v_WB_W, (0.0, 0.0, -DESCENT_SPEED), duration_s)
    end = Trajectory(np.array([duration_s]), braking).waypoints()[-1]
    return Trajectory(np.array([duration_s]), braking).then(_sink(end, float(end[2]) - ground_z_m))


def pressed_down(landing: Trajectory) -> Trajectory:
    """A planned landing, going on to below the ground."""
    return landing.then(_sink(landing.waypoints()[-1], 0.0))


def go_to(start: State, target: FloatArray) -> Trajectory:
    """Rest to rest along a straight line to `target`: x, y, z in m and yaw in rad, which turns the short way."""
    yaw_rad = yaw_of(start.q_WB)
    here = np.array([*start.p_WB, yaw_rad])
    way = target - here
    way[3] = wrapped(float(way[3]))
    distance_m = max(float(np.linalg.norm(way[:3])), abs(float(way[3])))
    duration_s = max(35.0 / 16.0 * distance_m / RETURN_SPEED, 1.0)
    shape = np.array(_REST_TO_REST) / duration_s ** np.arange(COEFFICIENTS)
    coefficients = way[:, None] * shape
    coefficients[:, 0] += here
    return Trajectory(np.array([duration_s]), coefficients[:, None, :])


def blind_setpoint(vehicle: Vehicle, hover_N: float, yaw_rad: float) -> AttitudeThrust:
    """Level, with the last known heading, slightly below the thrust `hover_N` at which this flight hovers."""
    return AttitudeThrust(hover_N - vehicle.mass_kg * BLIND_ACCELERATION, from_yaw(yaw_rad))


def blind_time_s(vehicle: Vehicle, height_m: float, climb_speed: float) -> float:
    """How long a descent without pose from `height_m` above ground is given before the motors stop.

    climb_speed: m/s, positive upwards, when it begins. From rest a descent takes sqrt(2 h / a) as long as drag is
    nothing, and h / v + v / a once it has its final speed v: sqrt((h / v)^2 + 2 h / a) is both.
    """
    climb = max(climb_speed, 0.0)
    top_m = max(height_m, 0.0) + climb**2 / (2.0 * BLIND_ACCELERATION)
    down_s = math.sqrt((top_m / _final_sink_speed(vehicle)) ** 2 + 2.0 * top_m / BLIND_ACCELERATION)
    return BLIND_MARGIN * (climb / BLIND_ACCELERATION + down_s)


def _final_sink_speed(vehicle: Vehicle) -> float:
    """m/s at which inflow (4 k_z O v) and drag (c_D v^2) make up for the missing thrust; infinite without either."""
    missing_N = vehicle.mass_kg * BLIND_ACCELERATION
    inflow = 4.0 * vehicle.k_z * vehicle.hover_rotor_speed
    drag = vehicle.parasitic_drag[2]
    resistance = inflow + math.sqrt(inflow**2 + 4.0 * drag * missing_N)
    return 2.0 * missing_N / resistance if resistance > 0.0 else math.inf


def _braking_s(state: State, change: float, ground_z_m: float) -> float:
    """Time for a change of velocity in m/s; shorter where the vehicle would meet the ground before."""
    duration_s, room_m, sinking = change / STOPPING_DECELERATION, state.p_WB[2] - ground_z_m, -state.v_WB_W[2]
    if sinking > 0.0 and room_m > 0.0:
        duration_s = min(duration_s, 2.0 * room_m / sinking)
    return max(duration_s, change / HARDEST_DECELERATION, 0.01)


def _constant_acceleration(
    state: State, v0_W: tuple[float, float, float], v1_W: tuple[float, float, float], duration_s: float
) -> FloatArray:
    """(4, 1, 8) coefficients of one segment from `state.p_WB`, velocity going linearly from v0 to v1; heading held."""
    coefficients = np.zeros((4, 1, COEFFICIENTS))
    coefficients[:3, 0, 0] = state.p_WB
    coefficients[:3, 0, 1] = v0_W
    coefficients[:3, 0, 2] = 0.5 * (np.array(v1_W) - v0_W) / duration_s
    coefficients[3, 0, 0] = yaw_of(state.q_WB)
    return coefficients


def _sink(point: FloatArray, height_m: float) -> Trajectory:
    """Down from x, y, z, yaw at a steady speed, to `PRESS_DEPTH_M` below the ground that is `height_m` below."""
    coefficients = np.zeros((4, 1, COEFFICIENTS))
    coefficients[:, 0, 0] = point
    coefficients[2, 0, 1] = -DESCENT_SPEED
    depth_m = max(height_m, 0.0) + PRESS_DEPTH_M
    return Trajectory(np.array([depth_m / DESCENT_SPEED]), coefficients)
