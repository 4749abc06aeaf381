"""The geometric law that makes up for drag by a model (Svacha, Mohta, Kumar 2017): the paper's MS-GCD.

The force F R e3 that overcomes drag as well depends on the attitude R that it takes, which depends on the force:

    F R e3 = alpha + R (k_d O P + |V| C) V,   V = R' v,   P = diag(1, 1, 0),   O = sum of rotor speeds

alpha is the geometric law's force and C the parasitic drag. A few sweeps solve it. Inflow changes the thrust of a rotor
that turns at a given speed, so a rotor's speed is that which gives its thrust in the present airflow. Scalars and
`math` only, as in `geometric`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from lcd_flight.control.geometric import (
    Allocation,
    Row4,
    attitude_setpoint,
    dot,
    into_body,
    into_world,
    rotor_force,
)
from lcd_flight.model.types import Vector3


class DragModel(NamedTuple):
    """What the controller believes of the vehicle's drag; units as in `model.Vehicle`."""

    k_eta: float
    k_d: float
    k_z: float
    k_h: float
    parasitic_drag: Vector3


def force_against_drag(force_W: Vector3, v_WB_W: Vector3, heading: tuple[float, float], drag: DragModel) -> Vector3:
    """The force in N, world, that leaves `force_W` when drag has taken its share; three sweeps.

    v_WB_W: m/s, in still air. heading: (cos, sin) of the yaw.
    """
    once = _swept(force_W, force_W, v_WB_W, heading, drag)
    twice = _swept(force_W, once, v_WB_W, heading, drag)
    return _swept(force_W, twice, v_WB_W, heading, drag)


def _swept(alpha_W: Vector3, force_W: Vector3, v_W: Vector3, heading: tuple[float, float], drag: DragModel) -> Vector3:
    """`alpha_W` and the drag at the attitude and the rotor speeds that `force_W` takes."""
    R_WD = attitude_setpoint(force_W, heading)
    v_D = into_body(R_WD, v_W)
    all_rotors = 2.0 * math.sqrt(math.sqrt(dot(force_W, force_W)) / drag.k_eta)
    speed, c = math.sqrt(dot(v_D, v_D)), drag.parasitic_drag
    lateral = drag.k_d * all_rotors
    lost = ((lateral + speed * c[0]) * v_D[0], (lateral + speed * c[1]) * v_D[1], speed * c[2] * v_D[2])
    lost_W = into_world(R_WD, lost)
    return (alpha_W[0] + lost_W[0], alpha_W[1] + lost_W[1], alpha_W[2] + lost_W[2])


def rotor_speeds_in_airflow(
    thrust_N: float, moment_N_m: Vector3, allocation: Allocation, airspeed_B: Vector3, drag: DragModel
) -> Row4:
    """Rotor speeds in rad/s, before any limit, that give thrust and moment in an airflow in m/s, body.

    The larger root of k_eta O^2 - k_z V_z O = T - k_h V_h^2. Where there is none, no speed gives so little thrust and
    the answer lies below those that there are; in still air it is that of `geometric.rotor_speeds`.
    """
    a, b, c, d = allocation.inverse
    return (
        _speed_for(rotor_force(a, thrust_N, moment_N_m), airspeed_B, drag),
        _speed_for(rotor_force(b, thrust_N, moment_N_m), airspeed_B, drag),
        _speed_for(rotor_force(c, thrust_N, moment_N_m), airspeed_B, drag),
        _speed_for(rotor_force(d, thrust_N, moment_N_m), airspeed_B, drag),
    )


def _speed_for(force_N: float, airspeed_B: Vector3, drag: DragModel) -> float:
    """The speed of one rotor."""
    vx, vy, vz = airspeed_B
    inflow = drag.k_z * vz
    square = inflow * inflow + 4.0 * drag.k_eta * (force_N - drag.k_h * (vx * vx + vy * vy))
    root = math.sqrt(abs(square))
    return (inflow + (root if square >= 0.0 else -root)) / (2.0 * drag.k_eta)
