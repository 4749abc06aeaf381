"""From the setpoint that holds to what the onboard PID is given, 500 times a second.

Source: crazyflie-firmware 2026.08, src/modules/src/controller/controller_pid.c (a yaw rate is integrated into an angle;
without thrust the angle follows the vehicle) and supervisor.c (levelling out). The PID cascade itself is the plant's.
"""

from __future__ import annotations

from dataclasses import replace

from lcd_flight.model import Vector3
from sim_bridge.crazyflie.body import PERIOD_S
from sim_bridge.crazyflie.commander import NOTHING, Setpoint
from sim_bridge.crazyflie.supervisor import Supervisor


def allowed(setpoint: Setpoint, supervisor: Supervisor) -> Setpoint:
    """What the supervisor leaves of a setpoint: nothing, or level with its thrust, or all of it."""
    if not supervisor.motors_allowed:
        return NOTHING
    if supervisor.levels_out:
        return replace(setpoint, roll_deg=0.0, pitch_deg=0.0, yaw_deg=None, yaw_rate_deg_s=0.0)
    return setpoint


def next_yaw(setpoint: Setpoint, held_deg: float, estimated_deg: float) -> float:
    """The heading to hold from now on, deg."""
    if setpoint.thrust == 0:
        return estimated_deg
    if setpoint.yaw_deg is not None:
        return wrapped_deg(setpoint.yaw_deg)
    return wrapped_deg(held_deg + setpoint.yaw_rate_deg_s * PERIOD_S)


def for_the_plant(desired_deg: Vector3, estimated_deg: Vector3, true_deg: Vector3) -> Vector3:
    """Angles for a controller that measures the true attitude, so that it acts as if it measured the estimated one.

    All three are roll, pitch, yaw in deg in one convention; an estimate that is off turns the vehicle by as much.
    """
    roll, pitch, yaw = (
        wanted - wrapped_deg(believed - true)
        for wanted, believed, true in zip(desired_deg, estimated_deg, true_deg, strict=True)
    )
    return (roll, pitch, wrapped_deg(yaw))


def wrapped_deg(angle: float) -> float:
    """The same angle in [-180, 180)."""
    return (angle + 180.0) % 360.0 - 180.0
