"""The airframe as the simulator and the controllers know it (RotorPy's multirotor model)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from lcd_flight.model.types import GRAVITY_M_PER_S2, Vector3


@dataclass(frozen=True, slots=True)
class GeometricGains:
    """Gains of the SE(3) law (paper, equation 2), normalised by mass and inertia as RotorPy has them."""

    position: Vector3
    """1/s^2, diagonal of Kx / m in the world."""
    velocity: Vector3
    """1/s, diagonal of Kv / m in the world."""
    attitude: float
    """1/s^2, k_R / J."""
    body_rates: float
    """1/s, k_w / J."""
    integral: Vector3 = (0.0, 0.0, 0.0)
    """1/s^3, integral action on the position error; the flight loop only, off by default."""
    integral_limit: float = 1.0
    """m/s^2, bound of the acceleration that the integral may ask for, each axis."""


@dataclass(frozen=True, slots=True)
class PidGains:
    """One axis of an onboard PID; units as in the firmware: degrees in, the next stage's unit out."""

    kp: float
    ki: float
    kd: float
    integral_limit: float
    """Bound of the integrated error (deg s, or deg for the rate loop); 0 means none."""


@dataclass(frozen=True, slots=True)
class OnboardController:
    """The cascaded attitude and rate PID and the mixer below the flight loop's setpoint (crazyflie-firmware)."""

    rate_hz: float
    attitude: tuple[PidGains, PidGains, PidGains]
    """Roll, pitch, yaw: attitude error in deg to rate setpoint in deg/s."""
    rates: tuple[PidGains, PidGains, PidGains]
    """Roll, pitch, yaw: rate error in deg/s to the mixer's thrust counts (u16)."""
    thrust_limit: float
    """Largest collective thrust setpoint as a share of full scale (the firmware clamps its u16)."""
    thrust_floor: float = 0.0
    """Smallest motor command in flight as a share of full scale (the firmware's idle thrust)."""


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A multirotor with four rotors. Equations: `sim_bridge.kernels.multirotor`; where figures come from: `source`."""

    name: str
    mass_kg: float
    inertia_kg_m2: Vector3
    """Principal moments."""
    rotor_positions_m: tuple[Vector3, Vector3, Vector3, Vector3]
    """In the body frame."""
    rotor_directions: tuple[float, float, float, float]
    """+1 where the drag torque on the body is along +z."""
    k_eta: float
    """N/(rad/s)^2, rotor thrust."""
    k_m: float
    """N m/(rad/s)^2, rotor drag torque."""
    k_d: float
    """N/(rad/s m/s), rotor drag in the disc plane."""
    k_z: float
    """N/(rad/s m/s), inflow along the axis."""
    k_h: float
    """N/(m/s)^2, translational lift."""
    k_flap: float
    """N m/(rad/s m/s), blade flapping."""
    parasitic_drag: Vector3
    """c_D, N/(m/s)^2, diagonal in the body frame."""
    motor_time_constant_s: float
    rotor_speed_min: float
    """rad/s"""
    rotor_speed_max: float
    """rad/s"""
    motor_noise: float
    """rad/s, standard deviation added to each rotor speed once per control step."""
    gains: GeometricGains
    """Gains of the paper's loop."""
    flight_gains: GeometricGains
    """Gains of the flight loop."""
    onboard: OnboardController | None
    """What flies thrust and attitude setpoints; None where the vehicle has the paper's loop only."""
    source: str
    """Where the figures come from."""

    @property
    def max_thrust_N(self) -> float:
        """Static thrust with all rotors at full speed."""
        return 4.0 * self.k_eta * self.rotor_speed_max**2

    @property
    def weight_N(self) -> float:
        """m g."""
        return self.mass_kg * GRAVITY_M_PER_S2

    @property
    def thrust_to_weight(self) -> float:
        """Static thrust over weight."""
        return self.max_thrust_N / self.weight_N

    @property
    def hover_rotor_speed(self) -> float:
        """rad/s at which the rotors carry the weight in still air."""
        return math.sqrt(self.weight_N / (4.0 * self.k_eta))

    def weaker(self, thrust_share: float) -> Vehicle:
        """The same vehicle with its rotor thrust scaled, e.g. 0.95 for tired propellers."""
        return replace(self, name=f"{self.name} x{thrust_share:g}", k_eta=self.k_eta * thrust_share)
