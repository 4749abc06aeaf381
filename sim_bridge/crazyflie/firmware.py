"""The simulated firmware: packets in and out, and one period of 2 ms after another over the airframe.

What runs when is as in crazyflie-firmware's stabilizer loop (src/modules/src/stabilizer.c): supervisor at 25 Hz,
high-level commander at 100 Hz, controller and inertial sensors at 500 Hz; log blocks when they fall due.
"""

from __future__ import annotations

from collections.abc import Callable

from sim_bridge.crazyflie import poses, services
from sim_bridge.crazyflie.body import Body, degrees_of
from sim_bridge.crazyflie.commander import NOTHING, Commander
from sim_bridge.crazyflie.crtp import MAX_PAYLOAD, Packet, Port
from sim_bridge.crazyflie.estimator import Estimator
from sim_bridge.crazyflie.log_table import Seen, log_table
from sim_bridge.crazyflie.logs import Logs
from sim_bridge.crazyflie.parameter_table import KALMAN
from sim_bridge.crazyflie.parameters import Parameters
from sim_bridge.crazyflie.power import Power, PowerState
from sim_bridge.crazyflie.stabilizer import allowed, for_the_plant, next_yaw
from sim_bridge.crazyflie.supervisor import PERIOD_MS as SUPERVISOR_MS
from sim_bridge.crazyflie.supervisor import Supervisor, Surroundings
from sim_bridge.crazyflie.variants import FULL_SCALE, Variant

PERIOD_MS = 2
GUIDANCE_MS = 10
ADDRESS = 0xE7
"""Last byte of the radio address."""
NOT_SEEN = poses.SeenPose((0.0, 0.0, 0.0), None)
_MOTOR_ORDER = (1, 2, 3, 0)
"""M1 is front right, then clockwise; vehicle files go clockwise too, from front left."""


class Firmware:
    """What runs between switching on and switching off. parameters: the values that outlive it."""

    def __init__(self, body: Body, variant: Variant, parameters: Parameters) -> None:
        self._body = body
        self.parameters = parameters
        self.logs = Logs(log_table())
        self.supervisor = Supervisor(variant.auto_arming)
        self.commander = Commander()
        self.power = Power()
        self.estimator = self._fresh_estimator()
        self.now_ms = 0
        """Since it was switched on."""
        self._used_poses = self._uses_poses
        self._pose = NOT_SEEN
        self._setpoint = NOTHING
        self._yaw_deg = 0.0
        self._unsent: list[Packet] = []
        self._services: dict[int, Callable[[Packet], list[Packet]]] = {
            Port.PARAMETERS: parameters.answer,
            Port.LOG: lambda packet: self.logs.answer(packet, self.now_ms),
            Port.LOCALIZATION: self._localise,
            Port.COMMANDER: self._command,
            Port.GENERIC_COMMANDER: self._command,
            Port.LINK: services.link,
            Port.PLATFORM: lambda packet: services.platform(packet, variant, self.supervisor),
            Port.MEMORY: services.memory,
            Port.SUPERVISOR: lambda packet: services.supervision(packet, variant, self.supervisor, self.now_ms),
        }

    @property
    def flies(self) -> bool:
        """Whether motors turn, or should."""
        return self._setpoint.thrust > 0

    @property
    def shut_down(self) -> bool:
        """Whether the battery was too low for too long."""
        return self.power.state is PowerState.SHUT_DOWN

    def take(self, packet: Packet) -> list[Packet]:
        """What is said at once to a packet."""
        service = self._services.get(packet.port)
        return [] if service is None else service(packet)

    def step(self) -> list[Packet]:
        """One period: what it sends by itself."""
        if self.now_ms % GUIDANCE_MS == 0:
            self.commander.guide(self.now_ms)
        if self.now_ms % SUPERVISOR_MS == 0:
            self._supervise()
        self._control()
        self._body.advance()
        self._estimate()
        self.now_ms += PERIOD_MS
        sent, self._unsent = [*self._unsent, *self._console(), *self.logs.due(self.now_ms, self._seen)], []
        return sent

    def _command(self, packet: Packet) -> list[Packet]:
        self.commander.take(packet, self.parameters, self.now_ms)
        return []

    def _localise(self, packet: Packet) -> list[Packet]:
        """A pose for the Kalman filter; or, as older firmware has them, the emergency stop and its watchdog."""
        if packet.channel == poses.GENERIC and packet.payload[:1] == bytes((poses.EMERGENCY_STOP,)):
            self.supervisor.stop_emergency()
        elif packet.channel == poses.GENERIC and packet.payload[:1] == bytes((poses.EMERGENCY_STOP_WATCHDOG,)):
            self.supervisor.feed_watchdog(self.now_ms)
        seen = poses.decode_pose(packet, ADDRESS)
        if seen is not None:
            self._pose = seen
            if self._uses_poses:
                self.estimator.see_position(seen.p_WB, self.parameters["locSrv.extPosStdDev"])
                if seen.q_WB is not None:
                    self.estimator.see_attitude(seen.q_WB, self.parameters["locSrv.extQuatStdDev"])
        return []

    @property
    def _uses_poses(self) -> bool:
        return self.parameters["stabilizer.estimator"] == KALMAN

    def _supervise(self) -> None:
        around = Surroundings(
            now_ms=self.now_ms,
            setpoint_ms=self.commander.stamp_ms,
            motors_run=self.flies,
            acceleration_g=self._body.acceleration_g,
            stop_parameter=bool(self.parameters["stabilizer.stop"]),
            tumble_check=bool(self.parameters["supervisor.tmblChckEn"]),
            preflight_timeout_ms=self.parameters["supervisor.prefltTimeout"],
            landing_timeout_ms=self.parameters["supervisor.landedTimeout"],
        )
        self.supervisor.update(around)
        low_V, critical_V = self.parameters["pm.lowVoltage"], self.parameters["pm.criticalLowVoltage"]
        self.power.update(self._body.battery_V, low_V, critical_V, self.now_ms)

    def _control(self) -> None:
        """The plant's PID measures the true attitude; the setpoint is turned so that it acts on the estimate."""
        self._setpoint = setpoint = allowed(self.commander.setpoint, self.supervisor)
        estimated = degrees_of(self.estimator.attitude)
        self._yaw_deg = next_yaw(setpoint, self._yaw_deg, estimated[2])
        desired = (setpoint.roll_deg, -setpoint.pitch_deg, self._yaw_deg)
        angles = for_the_plant(desired, estimated, degrees_of(self._body.state.q_WB))
        self._body.command(setpoint.thrust, angles)

    def _estimate(self) -> None:
        if self.parameters["kalman.resetEstimation"]:
            self.estimator = self._fresh_estimator()
            self._unsent.append(self.parameters.updated("kalman.resetEstimation", 0))
        elif self._uses_poses != self._used_poses:
            self.estimator = self._fresh_estimator()
        self._used_poses = self._uses_poses
        if not self._uses_poses:
            self.estimator.level(self._body.inertial)
            return
        self.estimator.predict(self._body.inertial)
        if self.estimator.lost:
            self.estimator = self._fresh_estimator()
            self._unsent.extend(_text("ESTKALMAN: State out of bounds, resetting\n"))

    def _fresh_estimator(self) -> Estimator:
        x, y, z = (self.parameters[f"kalman.initial{axis}"] for axis in "XYZ")
        return Estimator.fresh((x, y, z), self.parameters["kalman.initialYaw"])

    def _console(self) -> list[Packet]:
        said = "".join([*self.supervisor.said, *self.commander.said])
        self.supervisor.said.clear()
        self.commander.said.clear()
        return _text(said)

    def _seen(self) -> Seen:
        roll, pitch, yaw = degrees_of(self.estimator.attitude)
        setpoint = self._setpoint
        shares = self._body.motor_shares
        m1, m2, m3, m4 = (FULL_SCALE * shares[rotor] for rotor in _MOTOR_ORDER)
        return Seen(
            estimator=self.estimator,
            state=self.estimator.state,
            attitude_deg=(roll, -pitch, yaw),
            inertial=self._body.inertial,
            setpoint=setpoint,
            desired_deg=(setpoint.roll_deg, setpoint.pitch_deg, self._yaw_deg),
            motors=(m1, m2, m3, m4),
            battery_V=self._body.battery_V,
            power_state=self.power.state,
            supervisor_info=self.supervisor.info,
            pose=self._pose,
        )


def _text(said: str) -> list[Packet]:
    """Text for the console, in as many packets as it takes."""
    data = said.encode()
    return [Packet(Port.CONSOLE, 0, data[at : at + MAX_PAYLOAD]) for at in range(0, len(data), MAX_PAYLOAD)]
