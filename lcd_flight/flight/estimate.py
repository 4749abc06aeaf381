"""What a tick counts with: the state, measured or predicted over a short gap, and the hover thrust. Pure."""

from __future__ import annotations

import math

from lcd_flight.flight.memory import Memory
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.model import (
    GRAVITY_M_PER_S2,
    AttitudeThrust,
    Phase,
    Reference,
    State,
    TickInputs,
    Vehicle,
)
from lcd_flight.model.frames import body_z_axis
from lcd_flight.safety.evidence import SafetyMemory, pose_gap_s, pose_seen

HOVER_SMOOTHING_S = 1.0
"""Time constant of the hover thrust."""
HOVER_SPEED = 0.3
"""m/s, of the reference: up to here it counts as hovering."""
HOVER_ACCELERATION = 0.3
"""m/s^2, of the reference."""
HOVER_SHARES = (0.85, 1.15)
"""Of the weight: how far the hover thrust is believed to be from it."""


def estimate(inputs: TickInputs, setup: FlightSetup, memory: Memory, dt_s: float) -> tuple[State | None, SafetyMemory]:
    """The state now, None once the pose has been away for `pose_timeout_s`; and the memory of what was seen."""
    usable, safety = pose_seen(inputs, memory.safety)
    if usable:
        return inputs.pose.state, safety
    if memory.state is None or pose_gap_s(inputs, safety) > setup.limits.pose_timeout_s:
        return None, safety
    if memory.setpoint is None or not memory.phase.airborne:
        return memory.state, safety
    return predicted(memory.state, memory.setpoint, setup.vehicle, dt_s), safety


def predicted(state: State, setpoint: AttitudeThrust, vehicle: Vehicle, dt_s: float) -> State:
    """The state one step later, of a vehicle that has the attitude and the thrust that it was told; no drag."""
    x, y, z = body_z_axis(setpoint.q_WB)
    specific = setpoint.thrust_N / vehicle.mass_kg
    ax, ay, az = specific * x, specific * y, specific * z - GRAVITY_M_PER_S2
    (px, py, pz), (vx, vy, vz) = state.p_WB, state.v_WB_W
    half = 0.5 * dt_s
    return State(
        p_WB=(px + dt_s * (vx + half * ax), py + dt_s * (vy + half * ay), pz + dt_s * (vz + half * az)),
        v_WB_W=(vx + dt_s * ax, vy + dt_s * ay, vz + dt_s * az),
        q_WB=setpoint.q_WB,
        w_WB_B=(0.0, 0.0, 0.0),
    )


def hover_thrust_N(
    memory: Memory,
    setpoint: AttitudeThrust | None,
    state: State | None,
    reference: Reference | None,
    vehicle: Vehicle,
    dt_s: float,
) -> float | None:
    """The thrust that carries this vehicle, learned while the plan has it hover; before that None.

    A battery that sags and a thrust map that is a little wrong make it differ from the weight by more than a level
    descent is below it.
    """
    if memory.phase not in (Phase.HOLD, Phase.TRACK) or setpoint is None or state is None or reference is None:
        return memory.hover_N
    if math.hypot(*reference.v_W) > HOVER_SPEED or math.hypot(*reference.a_W) > HOVER_ACCELERATION:
        return memory.hover_N
    seen_N = setpoint.thrust_N * body_z_axis(state.q_WB)[2]
    before_N = vehicle.weight_N if memory.hover_N is None else memory.hover_N
    now_N = before_N + dt_s / (HOVER_SMOOTHING_S + dt_s) * (seen_N - before_N)
    return min(max(now_N, HOVER_SHARES[0] * vehicle.weight_N), HOVER_SHARES[1] * vehicle.weight_N)
