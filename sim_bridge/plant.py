"""One simulated vehicle, flown by thrust and attitude setpoints; time comes in as an argument.

The equations, the onboard controller and the numerical steps are those of the batched rollouts (`kernels.lane`).
"""

from __future__ import annotations

import numpy as np

from lcd_flight.control.geometric import rotation_of
from lcd_flight.model import AttitudeThrust, State, Vector3, Vehicle
from sim_bridge.battery import Battery
from sim_bridge.compiled import plant_kernel
from sim_bridge.craft import craft_of
from sim_bridge.kernels import rows
from sim_bridge.kernels.judge import MAX_RATE, MAX_SPEED
from sim_bridge.kernels.lane import turn_rotors
from sim_bridge.kernels.multirotor import Motion
from sim_bridge.kernels.onboard import received, roll_pitch_yaw
from sim_bridge.kernels.plant import IMPACT_SPEED, IMPACT_UPRIGHT
from sim_bridge.kernels.rows import LANES, ROWS, load4, load_motion, store3, store_motion

CRASH_SPEED = 3.0
"""m/s downward at touchdown; as if dropped from half a metre."""
CRASH_UPRIGHT = 0.5
"""Cosine of the tilt at touchdown: 60 degrees, where crazyflie-firmware calls it tumbled (platform_defaults.h)."""
_NS_PER_S = 1_000_000_000


class Plant:
    """A vehicle that stands on the floor with its motors off, or begins in the air with its rotors carrying it.

    floor_m: height of the floor in the world; None: it stands. battery_V: at rest; None: full. Setpoints apply from the
    next period of the onboard controller (2 ms at 500 Hz).

    Raises:
        InputError: the vehicle has no onboard controller.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        state: State,
        seed: int,
        *,
        battery_V: float | None = None,
        floor_m: float | None = None,
    ) -> None:
        self._craft = craft_of(vehicle, vehicle, "flight")
        self._vehicle = vehicle
        self._seed = np.uint64(seed % 2**64)
        self._floor_m = state.p_WB[2] if floor_m is None else floor_m
        self._period_ns = round(_NS_PER_S * self._craft.step_s)
        self._periods = self._left_ns = 0
        self._memory = np.zeros(ROWS * LANES)
        self._contact = np.array([0.0, 1.0])
        self._battery = Battery.at_voltage(battery_V)
        self._setpoint: AttitudeThrust | None = None
        store_motion(self._memory, rows.MOTION, 0, Motion(state.p_WB, state.v_WB_W, state.q_WB, state.w_WB_B))
        store3(self._memory, rows.PID + 6, 0, roll_pitch_yaw(rotation_of(state.q_WB)))
        if not self.on_ground:
            turn_rotors(self._memory, 0, (self._craft.initial_speed,) * 4, self._craft.air)
        self.crashed = False
        """Whether it hit the floor hard or tilted, or left what the model holds for; its motors have stopped."""

    @property
    def setpoint(self) -> AttitudeThrust | None:
        """What it flies; None: its motors are off."""
        return self._setpoint

    @setpoint.setter
    def setpoint(self, setpoint: AttitudeThrust) -> None:
        if not setpoint.is_finite():
            raise ValueError(f"not a setpoint: {setpoint}")
        if self.crashed:
            return
        self._setpoint = setpoint
        R_WB = rotation_of(load4(self._memory, rows.MOTION + 6, 0))
        given = received(setpoint.thrust_N, rotation_of(setpoint.q_WB), R_WB, self._craft.onboard)
        self._memory[rows.SETPOINT * LANES] = given.thrust
        store3(self._memory, rows.SETPOINT + 1, 0, given.attitude)

    def command(self, counts: float, attitude_deg: Vector3) -> None:
        """Give the onboard controller its own numbers, past `setpoint`: thrust counts; roll, pitch, yaw in deg.

        They are those of `kernels.onboard`: angles of the body frame, 0 counts stop the motors. Not checked.
        """
        if not self.crashed:
            self._memory[rows.SETPOINT * LANES] = counts
            store3(self._memory, rows.SETPOINT + 1, 0, attitude_deg)

    def stop(self) -> None:
        """Stop the motors; a later setpoint starts them again."""
        self._setpoint = None
        self._memory[rows.SETPOINT * LANES] = 0.0

    def advance(self, dt_ns: int) -> None:
        """Let time pass. What is less than a period of the onboard controller waits for the next call."""
        periods, self._left_ns = divmod(self._left_ns + dt_ns, self._period_ns)
        if periods <= 0 or self.crashed:
            return
        plant_kernel()(self._memory, self._contact, self._seed, self._periods, periods, self._craft, self._floor_m)
        self._periods += periods
        self._battery = self._battery.drained(self._thrust_N / self._vehicle.weight_N, periods * self._craft.step_s)
        if self._has_crashed():
            self.crashed = True
            self.stop()

    @property
    def lag_ns(self) -> int:
        """How much of the time that has passed is not in `state` yet: less than a period."""
        return self._left_ns

    @property
    def state(self) -> State:
        """Where it truly is."""
        x, y, z, vx, vy, vz, qx, qy, qz, qw, p, q, r = map(float, self._memory[: 13 * LANES : LANES])
        return State((x, y, z), (vx, vy, vz), (qx, qy, qz, qw), (p, q, r))

    @property
    def on_ground(self) -> bool:
        """Whether it stands."""
        return bool(self._memory[(rows.MOTION + 2) * LANES] <= self._floor_m)

    @property
    def battery_V(self) -> float:
        """At the battery's terminals, under load."""
        return self._battery.voltage_V

    @property
    def motor_shares(self) -> tuple[float, float, float, float]:
        """Motor commands as shares of the largest thrust, 0 to 1."""
        a, b, c, d = load4(self._memory, rows.COMMANDS, 0)
        full = self._craft.air.speed_max**2
        return (float(a * a / full), float(b * b / full), float(c * c / full), float(d * d / full))

    @property
    def _thrust_N(self) -> float:
        """Static thrust of the rotors as they turn."""
        a, b, c, d = load4(self._memory, rows.SPEEDS, 0)
        return float(self._vehicle.k_eta * (a * a + b * b + c * c + d * d))

    def _has_crashed(self) -> bool:
        """Whether it may not fly on; what is not a number is within nothing."""
        _, v, _, w = load_motion(self._memory, rows.MOTION, 0)
        within = all(abs(x) <= MAX_SPEED for x in v) and all(abs(x) <= MAX_RATE for x in w)
        soft = self._contact[IMPACT_SPEED] <= CRASH_SPEED and self._contact[IMPACT_UPRIGHT] >= CRASH_UPRIGHT
        return not (within and soft)
