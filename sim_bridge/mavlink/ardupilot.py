"""ArduPilot Copter as a client sees it: GUIDED and GUIDED_NOGPS, what thrust means, arming, LAND.

Sources: ArduCopter 4.6, mode_guided.cpp, GCS_Mavlink.cpp, motors (AP_MotorsMulticopter), AP_Arming; timings and thrust
curve as seen in flight experiments.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from sim_bridge.mavlink.autopilot import Autopilot
from sim_bridge.mavlink.estimator import SeenPose
from sim_bridge.mavlink.frames import heading, unit
from sim_bridge.mavlink.guidance import Wish, towards
from sim_bridge.mavlink.odometry import LOCAL_FRD, pose_of_odometry
from sim_bridge.mavlink.stabilizer import Gains
from sim_bridge.mavlink.vocabulary import CRITICAL, INFO, NS_PER_S, AttitudeTarget, Result

STABILIZE, ALT_HOLD, GUIDED, LOITER, RTL, LAND, BRAKE, GUIDED_NOGPS = 0, 2, 4, 5, 6, 9, 17, 20
_PLACED = frozenset({GUIDED, LOITER, RTL, BRAKE})
_BY_HAND = frozenset({STABILIZE, ALT_HOLD, LOITER})
_UNARMABLE = frozenset({LAND, RTL, BRAKE})
THRUST_IS_THRUST = 8
"""GUID_OPTIONS."""
RATES = 0b111
"""Bits of SET_ATTITUDE_TARGET.type_mask: these are ignored, and with them all is as it should be."""
EXTERNAL_NAV = 6
"""EK3_SRC1_*"""
OFF_S, RAMP_S = 2.0, 0.5
"""After arming the motors stay off, then come up."""
SLOPE = 0.87
"""Of force over weight by thrust over hover thrust: x0.8 gives 0.824 g, x1.2 gives 1.172 g."""
LATE_ORIGIN_M = 0.09
"""Bias of the height where poses came before the origin."""
VISO_TIMEOUT_S, STEADY_S = 0.3, 1.0
"""Poses are healthy so long after one, once they have come for so long."""
SETTLED_S, FLAGS_S, FAILSAFE_S = 2.0, 7.0, 8.0
"""What the filter needs at first; its flags stay good so long without poses; it gives up."""
GOOD, CONSTANT = 0x33F, 0x80
"""EKF_STATUS_REPORT flags with a position, and the one of a filter that has none."""
WITHOUT_POSITION = 0x7


class ArduPilot(Autopilot):
    """One ArduPilot."""

    modes: ClassVar[Mapping[str, int]] = {
        "stabilize": STABILIZE,
        "alt_hold": ALT_HOLD,
        "guided": GUIDED,
        "loiter": LOITER,
        "rtl": RTL,
        "land": LAND,
        "brake": BRAKE,
        "guided_nogps": GUIDED_NOGPS,
    }
    first_mode = STABILIZE
    origin: tuple[int, int, int] | None = None
    """Latitude and longitude in 1e-7 deg, height in mm."""
    _internal_error = False

    @property
    def has_position(self) -> bool:
        """An origin, poses for a while, and the last one not too long ago."""
        estimator = self.estimator
        started = self.origin is not None and estimator.taken_ns is not None
        settled = (self.now_ns - estimator.since_ns) / NS_PER_S >= SETTLED_S
        return started and settled and estimator.age_s(self.now_ns) < FLAGS_S

    @property
    def sees_steadily(self) -> bool:
        """Whether poses have been coming for a second, none late."""
        estimator = self.estimator
        steady = (self.now_ns - estimator.steady_ns) / NS_PER_S >= STEADY_S
        return steady and estimator.age_s(self.now_ns) <= VISO_TIMEOUT_S

    @property
    def flags(self) -> int:
        """Of EKF_STATUS_REPORT."""
        return GOOD if self.has_position else WITHOUT_POSITION | CONSTANT

    @property
    def landing(self) -> bool:
        """LAND and RTL, which lands where it is."""
        return self.mode in (LAND, RTL)

    @property
    def gains(self) -> Gains:
        """From the parameters."""
        return Gains(self.parameters["ATC_ANG_RLL_P"], self.parameters["ATC_ANG_YAW_P"])

    def set_origin(self, latitude: int, longitude: int, altitude_mm: int) -> bool:
        """SET_GPS_GLOBAL_ORIGIN; whether it is taken: once."""
        if self.origin is not None or abs(latitude) > 900_000_000 or abs(longitude) > 1_800_000_000:
            return False
        self.origin = (latitude, longitude, altitude_mm)
        if self.estimator.taken_ns is not None:
            self.estimator.offset = (0.0, 0.0, LATE_ORIGIN_M)
        self.say(INFO, "EKF3 IMU0 origin set")
        return True

    def request_mode(self, mode: int) -> Result:
        """Any known mode while disarmed; armed, one that needs a position only with one. The same changes nothing."""
        if mode == self.mode:
            return Result.ACCEPTED
        if mode not in self.modes.values():
            self.say(CRITICAL, f"No such mode {mode}")
            return Result.FAILED
        if mode in _PLACED and self.armed and not self.has_position:
            self.say(CRITICAL, f"Mode change to {self._name(mode)} failed: requires position")
            return Result.FAILED
        self.target = None
        self._enter(mode)
        return Result.ACCEPTED

    def arming_problem(self) -> str:
        """The first of the checks that fails."""
        if not self.parameters["ARMING_CHECK"]:
            return "internal errors" if self._internal_error else ""
        late = bool(self.parameters["VISO_TYPE"]) and not self.sees_steadily
        checks = (
            (self._internal_error, "Internal errors 0x1000000"),
            (self.age_s < 0.7 * self.setup.boot_s, "Accels inconsistent"),
            (self.age_s < self.setup.boot_s, "Gyros inconsistent"),
            (self.body.battery_share < 0.05, "Battery 1 below minimum arming voltage"),
            (self.mode in _UNARMABLE, f"{self._name(self.mode)} mode not armable"),
            (self.mode in _BY_HAND and not self.setup.rc, "RC not found"),
            (self.mode in _PLACED and self.origin is None, "waiting for home"),
            (self.mode in _PLACED and late, "VisOdom not healthy"),
            (self.mode in _PLACED and not self.has_position, "Need Position Estimate"),
        )
        return next((text for fails, text in checks if fails), "")

    def take_attitude(self, message: Any) -> None:
        """Dropped in silence unless attitude and thrust are given and fit; with some rates GUIDED begins anew."""
        if self.mode not in (GUIDED, GUIDED_NOGPS) or message.type_mask & ~RATES:
            return
        if message.type_mask not in (0, RATES):
            self.target = None
            self._enter(self.mode)
            return
        size = sum(part * part for part in message.q)
        if not abs(size - 1.0) <= 1e-3:
            return
        if math.isnan(message.thrust):
            self._internal_error = True
        thrust = min(1.0, max(0.0, 0.0 if math.isnan(message.thrust) else message.thrust))
        w, x, y, z = message.q
        self.target = AttitudeTarget(unit((w, x, y, z)), thrust, self.now_ns)

    def _pose_of(self, message: Any) -> SeenPose | None:
        """LOCAL_FRD alone."""
        return pose_of_odometry(message, frozenset({LOCAL_FRD}), None)

    def _see(self, pose: SeenPose) -> None:
        wanted = ("EK3_SRC1_POSXY", "EK3_SRC1_POSZ")
        if not self.parameters["VISO_TYPE"] or any(self.parameters[name] != EXTERNAL_NAV for name in wanted):
            return
        self.estimator.see(
            pose,
            self.now_ns,
            heading_too=self.parameters["EK3_SRC1_YAW"] == EXTERNAL_NAV,
            velocity_too=self.parameters["EK3_SRC1_VELXY"] == EXTERNAL_NAV,
        )

    def _wish(self) -> Wish:
        if self.mode in (GUIDED, GUIDED_NOGPS):
            return self._guided()
        if self.landing:
            return self._sink(0.01 * self.parameters["LAND_SPEED"])
        if self.landed:
            return Wish(self._level(), 0.0)
        return self._hold(place=self.mode in _PLACED)

    def _guided(self) -> Wish:
        """The setpoint while it is fresh; then level, at its height, unbraked."""
        target = self.target
        if target is None:
            return Wish(self._level(), 0.0) if self.landed else self._hold(place=self.mode == GUIDED)
        if (self.now_ns - target.came_ns) / NS_PER_S > self.parameters["GUID_TIMEOUT"]:
            return Wish(self._level(), 0.0) if self.landed else self._hold(place=False)
        yaw = heading(target.attitude)
        self._goal = self._goal._replace(down=self.estimator.position[2], yaw=yaw)
        if int(self.parameters["GUID_OPTIONS"]) & THRUST_IS_THRUST:
            return Wish(target.attitude, self._force_of(target.thrust))
        return Wish(target.attitude, self._climb_force(target))

    def _climb_force(self, target: AttitudeTarget) -> float:
        """Thrust as a climb rate: 0.5 holds."""
        off = target.thrust - 0.5
        most = self.parameters["WPNAV_SPEED_UP"] if off > 0.0 else self.parameters["WPNAV_SPEED_DN"]
        climb = 2.0 * off * 0.01 * most
        if self.landed and climb <= 0.0:
            return 0.0
        return towards(self._goal._replace(place=None, down=None, sink=-climb), self.estimator).force

    def _force_of(self, thrust: float) -> float:
        """Share of the weight; standing, no thrust is none at all."""
        if thrust <= 0.0:
            return 0.0
        return max(0.0, 1.0 + SLOPE * (thrust / self.setup.hover_thrust - 1.0))

    def _spool(self) -> float:
        return min(1.0, max(0.0, (self.armed_s - OFF_S) / RAMP_S))

    def _landed_after_s(self) -> float:
        return 2.0 if self.landing else 6.0

    def _react(self) -> None:
        if self.body.broken:
            self.disarm("Crash: Disarming: AngErr=90>30")
        elif self.landed and (self.landing or self._idles()):
            self.disarm("Disarming motors")
        elif self._is_lost() and self.parameters["FS_EKF_ACTION"]:
            self.say(CRITICAL, "EKF Failsafe: changed to LAND Mode")
            self._fail_over(LAND)

    def _idles(self) -> bool:
        return self.force <= 0.0 and 0.0 < self.parameters["DISARM_DELAY"] < self.idle_s

    def _is_lost(self) -> bool:
        """In the air, without poses for long, in a mode that needs them."""
        return self.mode in _PLACED and not self.landed and self.estimator.age_s(self.now_ns) > FAILSAFE_S

    def _refuse_arming(self, problem: str) -> Result:
        self.say(CRITICAL, f"Arm: {problem}")
        return Result.FAILED

    def _request_disarm(self, forced: bool) -> Result:
        if not (self.landed or forced):
            return Result.FAILED
        self.disarm("Disarming motors")
        return Result.ACCEPTED

    def _name(self, mode: int) -> str:
        names = {number: name for name, number in self.modes.items()}
        return names.get(mode, str(mode)).upper()

    def announce(self) -> None:
        """What it says of its boot."""
        self.say(INFO, "ArduCopter V4.6.3 (simulated)")
        self.say(INFO, "Frame: QUAD/X")
