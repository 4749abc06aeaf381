"""PX4 as a client sees it: modes, OFFBOARD and its loss, arming, landing.

Sources: PX4 1.16, src/modules/commander (Commander.cpp, failsafe/failsafe.cpp, commander_params.c, ModeUtil) and
src/modules/mavlink/mavlink_receiver.cpp.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from pymavlink.dialects.v20 import common

from sim_bridge.mavlink.autopilot import Autopilot
from sim_bridge.mavlink.estimator import SeenPose
from sim_bridge.mavlink.frames import unit
from sim_bridge.mavlink.guidance import Wish, towards
from sim_bridge.mavlink.odometry import LOCAL_FRD, LOCAL_NED, pose_of_odometry
from sim_bridge.mavlink.stabilizer import Gains
from sim_bridge.mavlink.vocabulary import CRITICAL, INFO, NS_PER_S, WARNING, AttitudeTarget, Result

IGNORE_THRUST, IGNORE_ATTITUDE = 64, 128
"""Bits of SET_ATTITUDE_TARGET.type_mask; rates are not flown, ignored or not."""
PROOF_S = 0.5
"""2 Hz: setpoints farther apart are no stream."""
STREAM_S = 1.0
"""So long there must have been one before OFFBOARD."""
_ESTIMATORS = frozenset(
    {common.MAV_ESTIMATOR_TYPE_NAIVE, common.MAV_ESTIMATOR_TYPE_VISION, common.MAV_ESTIMATOR_TYPE_VIO}
)
"""Of ODOMETRY: others, MOCAP among them, are logged by PX4 but not fused."""
PLACE, HEIGHT, VELOCITY, HEADING = 1, 2, 4, 8
"""Bits of EKF2_EV_CTRL."""


def custom_mode(main: int, sub: int = 0) -> int:
    """HEARTBEAT.custom_mode."""
    return main << 16 | sub << 24


MANUAL, ALTCTL, POSCTL, ACRO, OFFBOARD, STABILIZED = (custom_mode(main) for main in (1, 2, 3, 5, 6, 7))
TAKEOFF, LOITER, RTL, LAND = (custom_mode(4, sub) for sub in (2, 3, 5, 6))
_BY_HAND = frozenset({MANUAL, ALTCTL, POSCTL, ACRO, STABILIZED})
_PLACED = frozenset({POSCTL, TAKEOFF, LOITER, RTL})
_AFTER_LOSS = {0: POSCTL, 1: ALTCTL, 2: STABILIZED, 3: RTL, 4: LAND, 5: LOITER}
"""COM_OBL_RC_ACT; 6 terminates, 7 disarms: both stop the motors."""


class Px4(Autopilot):
    """One PX4."""

    modes: ClassVar[Mapping[str, int]] = {
        "manual": MANUAL,
        "altctl": ALTCTL,
        "posctl": POSCTL,
        "acro": ACRO,
        "offboard": OFFBOARD,
        "stabilized": STABILIZED,
        "takeoff": TAKEOFF,
        "loiter": LOITER,
        "rtl": RTL,
        "land": LAND,
    }
    first_mode = LOITER
    _stream_ns: int | None = None
    """Since when there has been a stream of setpoints."""
    _proof_ns = 0
    """When the last proof of life came."""
    _failing_ns: int | None = None
    _warned = False

    @property
    def has_position(self) -> bool:
        """Aided within EKF2_NOAID_TOUT."""
        return self.estimator.age_s(self.now_ns) * 1e6 < self.parameters["EKF2_NOAID_TOUT"]

    @property
    def landing(self) -> bool:
        """LAND and RTL, which lands where it is."""
        return self.mode in (LAND, RTL)

    @property
    def gains(self) -> Gains:
        """From the parameters."""
        return Gains(self.parameters["MC_ROLL_P"], self.parameters["MC_YAW_P"])

    @property
    def streams(self) -> bool:
        """Whether setpoints have been coming for long enough."""
        if self._stream_ns is None or (self.now_ns - self._proof_ns) / NS_PER_S > PROOF_S:
            return False
        return (self.now_ns - self._stream_ns) / NS_PER_S >= STREAM_S

    def request_mode(self, mode: int) -> Result:
        """A mode that cannot be flown now is refused; the same changes nothing."""
        if mode == self.mode:
            return Result.ACCEPTED
        if mode not in self.modes.values():
            return self._refuse_mode("Unsupported main mode")
        if (mode == OFFBOARD and not self.streams) or (mode in _PLACED and self.armed and not self.has_position):
            return self._refuse_mode(f"Switching to mode '{self._name(mode)}' is currently not possible")
        self._failing_ns = None
        self._enter(mode)
        return Result.ACCEPTED

    def arming_problem(self) -> str:
        """The first of the checks that fails."""
        checks = (
            (self.age_s < self.setup.boot_s, "ekf2 missing data"),
            (self.battery_share < self.parameters["BAT_CRIT_THR"], "Battery unhealthy"),
            (self.mode in _BY_HAND and not self.setup.rc, "No manual control input"),
            (self.mode in _PLACED and not self.has_position, "position estimate invalid"),
            (self.mode == OFFBOARD and not self.streams, "No offboard signal"),
            (self.mode in (LAND, RTL), f"Mode not suitable for arming: {self._name(self.mode)}"),
        )
        return next((text for fails, text in checks if fails), "")

    @property
    def battery_share(self) -> float:
        """What is left, 0 to 1."""
        return self.body.battery_share

    def take_attitude(self, message: Any) -> None:
        """Any is proof of life; one that ignores the attitude, or is not finite, is not flown."""
        if not self.parameters["MAV_FWDEXTSP"]:
            return
        if self._stream_ns is None or (self.now_ns - self._proof_ns) / NS_PER_S > PROOF_S:
            self._stream_ns = self.now_ns
        self._proof_ns = self.now_ns
        numbers = (*message.q, message.thrust)
        if message.type_mask & IGNORE_ATTITUDE or not all(map(math.isfinite, numbers)) or math.hypot(*message.q) < 1e-6:
            return
        thrust = 0.0 if message.type_mask & IGNORE_THRUST else min(1.0, max(0.0, message.thrust))
        w, x, y, z = message.q
        self.target = AttitudeTarget(unit((w, x, y, z)), thrust, self.now_ns)

    def _pose_of(self, message: Any) -> SeenPose | None:
        """Vision in LOCAL_FRD or LOCAL_NED."""
        return pose_of_odometry(message, frozenset({LOCAL_FRD, LOCAL_NED}), _ESTIMATORS)

    def _see(self, pose: SeenPose) -> None:
        uses = int(self.parameters["EKF2_EV_CTRL"])
        if uses & PLACE and uses & HEIGHT:
            self.estimator.see(pose, self.now_ns, heading_too=bool(uses & HEADING), velocity_too=bool(uses & VELOCITY))

    def _wish(self) -> Wish:
        if self.mode == OFFBOARD and self.target is not None:
            return Wish(self.target.attitude, self.target.thrust / self.setup.hover_thrust)
        if self.landing:
            return self._sink(self.parameters["MPC_LAND_SPEED"])
        if self.landed and self.mode != TAKEOFF:
            return Wish(self._level(), 0.0)
        if self.mode == TAKEOFF:
            return self._climb()
        return self._hold(place=self.mode in _PLACED)

    def _climb(self) -> Wish:
        start = self._goal.down or 0.0
        return towards(self._goal._replace(down=start - self.parameters["MIS_TAKEOFF_ALT"]), self.estimator)

    def _spool(self) -> float:
        return 1.0 if self.armed_s >= self.parameters["COM_SPOOLUP_TIME"] else 0.0

    def _landed_after_s(self) -> float:
        return 1.0

    def _react(self) -> None:
        if self.body.broken:
            self.disarm("Disarmed by crash")
            return
        self._arrive()
        self._lose_offboard()
        self._lose_position()
        self._mind_battery()
        rested_s = self.rested_s - self._landed_after_s()
        if self.landed and self.flew and 0.0 < self.parameters["COM_DISARM_LAND"] < rested_s:
            self.disarm("Disarmed by landing")
        elif self.landed and not self.flew and 0.0 < self.parameters["COM_DISARM_PRFLT"] < self.idle_s:
            self.disarm("Disarmed by auto preflight disarming")

    def _arrive(self) -> None:
        """A take-off ends in LOITER."""
        start = self._goal.down or 0.0
        if self.mode == TAKEOFF and start - self.estimator.position[2] > 0.9 * self.parameters["MIS_TAKEOFF_ALT"]:
            self._goal = self._goal._replace(down=start - self.parameters["MIS_TAKEOFF_ALT"])
            self.mode = LOITER

    def _lose_offboard(self) -> None:
        """COM_OF_LOSS_T without a setpoint; then, after COM_FAIL_ACT_T of holding, COM_OBL_RC_ACT."""
        if self.mode == OFFBOARD and (self.now_ns - self._proof_ns) / NS_PER_S > self.parameters["COM_OF_LOSS_T"]:
            self.say(CRITICAL, "Failsafe activated: no offboard signal")
            self._failing_ns = self.now_ns
            self._fail_over(LOITER if self.has_position else ALTCTL)
        if self._failing_ns is None:
            return
        if (self.now_ns - self._failing_ns) / NS_PER_S >= self.parameters["COM_FAIL_ACT_T"]:
            self._failing_ns = None
            self._fail(int(self.parameters["COM_OBL_RC_ACT"]))

    def _fail(self, action: int) -> None:
        mode = _AFTER_LOSS.get(action)
        if mode is None:
            self.disarm("Failsafe: termination")
        else:
            self._fail_over(mode)

    def _lose_position(self) -> None:
        """A mode that needs a position ends without one: it comes down level."""
        if self.mode in _PLACED and not self.landed and not self.has_position:
            self.say(CRITICAL, "Failsafe activated: position estimate invalid")
            self._fail_over(LAND)

    def _mind_battery(self) -> None:
        if not self._warned and self.battery_share < self.parameters["BAT_LOW_THR"]:
            self._warned = True
            self.say(WARNING, "Low battery level")
        critical = self.battery_share < self.parameters["BAT_CRIT_THR"]
        if critical and self.parameters["COM_LOW_BAT_ACT"] >= 2 and not self.landing and not self.landed:
            self.say(CRITICAL, "Failsafe activated: critical battery")
            self._fail_over(LAND)

    def _refuse_mode(self, text: str) -> Result:
        self.say(CRITICAL, text)
        return Result.TEMPORARILY_REJECTED

    def _refuse_arming(self, problem: str) -> Result:
        self.say(CRITICAL, "Arming denied: Resolve system health failures first")
        self.say(CRITICAL, f"Preflight Fail: {problem}")
        return Result.TEMPORARILY_REJECTED

    def _request_disarm(self, forced: bool) -> Result:
        if not (self.landed or forced or self.mode in _BY_HAND):
            self.say(CRITICAL, "Disarming denied: not landed")
            return Result.TEMPORARILY_REJECTED
        self.disarm("Disarmed by external command")
        return Result.ACCEPTED

    def _name(self, mode: int) -> str:
        names = {number: name for name, number in self.modes.items()}
        return names.get(mode, "?").capitalize()

    def _become_ready(self) -> None:
        self.say(INFO, "Ready for takeoff!")
