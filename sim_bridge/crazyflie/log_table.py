"""The log variables of the simulated firmware, by the names and in the units of crazyflie-firmware 2026.08.

Mind the signs: `stateEstimate.pitch` and `stabilizer.pitch` are positive nose up, which is the opposite of the pitch
that cflib's `send_setpoint` is given.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from lcd_flight.model import GRAVITY_M_PER_S2, State, Vector3
from sim_bridge.crazyflie.body import Inertial
from sim_bridge.crazyflie.commander import Setpoint
from sim_bridge.crazyflie.estimator import Estimator
from sim_bridge.crazyflie.kinds import F32, I8, I16, I32, U8, U16, U32, Kind
from sim_bridge.crazyflie.logs import LogVariable
from sim_bridge.crazyflie.poses import SeenPose, compressed

RADIO_STRENGTH = 40
"""-dBm that a nearby radio has; there is none here."""
_G = 1.0 / GRAVITY_M_PER_S2
_DEG = math.degrees(1.0)
_MILLI = 1e3


@dataclass(frozen=True, slots=True)
class Seen:
    """What log variables are read from, at one instant."""

    estimator: Estimator
    state: State
    """The estimate."""
    attitude_deg: Vector3
    """Estimated roll, pitch (nose up), yaw."""
    inertial: Inertial
    setpoint: Setpoint
    """What the controller is asked for."""
    desired_deg: Vector3
    """What the controller holds: roll, pitch (nose up), yaw."""
    motors: tuple[float, float, float, float]
    """M1 to M4, counts."""
    battery_V: float
    power_state: int
    supervisor_info: int
    pose: SeenPose
    """The last that came from outside."""


def log_table() -> tuple[LogVariable[Seen], ...]:
    """In the order of the table of contents."""
    return (
        *_vector("acc", "x y z", F32, lambda seen: seen.inertial.specific_force, _G),
        *_vector("controller", "roll pitch yaw", F32, lambda seen: seen.desired_deg),
        LogVariable("controller", "cmd_thrust", F32, lambda seen: seen.setpoint.thrust),
        *_vector("gyro", "x y z", F32, lambda seen: seen.inertial.body_rates, _DEG),
        *_vector("kalman", "stateX stateY stateZ", F32, lambda seen: seen.state.p_WB),
        *_vector("kalman", "varPX varPY varPZ", F32, lambda seen: seen.estimator.velocity_variance),
        *_vector("kalman", "varX varY varZ", F32, lambda seen: seen.estimator.position_variance),
        *_vector("kalman", "varD0 varD1 varD2", F32, lambda seen: seen.estimator.attitude_variance),
        *_vector("kalman", "q1 q2 q3 q0", F32, lambda seen: seen.state.q_WB),
        *_vector("locSrv", "x y z", F32, lambda seen: seen.pose.p_WB),
        *_vector("locSrv", "qx qy qz qw", F32, lambda seen: seen.pose.q_WB or (0.0,) * 4),
        *_vector("motor", "m1 m2 m3 m4", U16, lambda seen: seen.motors),
        *_vector("motor", "m1req m2req m3req m4req", I32, lambda seen: seen.motors),
        *_power(),
        LogVariable("radio", "isConnected", U8, lambda _: 1),
        LogVariable("radio", "rssi", U8, lambda _: RADIO_STRENGTH),
        *_vector("stabilizer", "roll pitch yaw", F32, lambda seen: seen.attitude_deg),
        LogVariable("stabilizer", "thrust", F32, lambda seen: seen.setpoint.thrust),
        *_estimate(),
        LogVariable("supervisor", "info", U16, lambda seen: seen.supervisor_info),
        LogVariable("sys", "canfly", U8, lambda seen: seen.supervisor_info >> 3 & 1),
        LogVariable("sys", "isFlying", U8, lambda seen: seen.supervisor_info >> 4 & 1),
        LogVariable("sys", "isTumbled", U8, lambda seen: seen.supervisor_info >> 5 & 1),
    )


def _vector(
    group: str, names: str, kind: Kind, vector: Callable[[Seen], Sequence[float]], scale: float = 1.0
) -> list[LogVariable[Seen]]:
    """One variable for each component."""

    def component(index: int) -> Callable[[Seen], float]:
        return lambda seen: scale * vector(seen)[index]

    return [LogVariable(group, name, kind, component(index)) for index, name in enumerate(names.split())]


def _power() -> list[LogVariable[Seen]]:
    return [
        LogVariable("pm", "vbat", F32, lambda seen: seen.battery_V),
        LogVariable("pm", "vbatMV", U16, lambda seen: _MILLI * seen.battery_V),
        LogVariable("pm", "state", I8, lambda seen: seen.power_state),
    ]


def _estimate() -> list[LogVariable[Seen]]:
    """Once in plain units, once small: mm, mm/s, mm/s^2, milliradians/s and 32 bits for the attitude."""
    return [
        *_vector("stateEstimate", "x y z", F32, lambda seen: seen.state.p_WB),
        *_vector("stateEstimate", "vx vy vz", F32, lambda seen: seen.state.v_WB_W),
        *_vector("stateEstimate", "ax ay az", F32, lambda seen: seen.estimator.acceleration, _G),
        *_vector("stateEstimate", "roll pitch yaw", F32, lambda seen: seen.attitude_deg),
        *_vector("stateEstimate", "qx qy qz qw", F32, lambda seen: seen.state.q_WB),
        *_vector("stateEstimateZ", "x y z", I16, lambda seen: seen.state.p_WB, _MILLI),
        *_vector("stateEstimateZ", "vx vy vz", I16, lambda seen: seen.state.v_WB_W, _MILLI),
        *_vector("stateEstimateZ", "ax ay az", I16, lambda seen: seen.estimator.acceleration, _MILLI),
        LogVariable("stateEstimateZ", "quat", U32, lambda seen: compressed(seen.state.q_WB)),
        *_vector("stateEstimateZ", "rateRoll ratePitch rateYaw", I16, lambda seen: seen.state.w_WB_B, _MILLI),
    ]
