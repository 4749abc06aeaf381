"""What both flavours are: something that arms, has a mode, believes where it is and turns rotors."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from sim_bridge.mavlink.body import Body
from sim_bridge.mavlink.estimator import Estimator, SeenPose
from sim_bridge.mavlink.frames import Hamilton, heading, level, ned_attitude
from sim_bridge.mavlink.guidance import Goal, Wish, towards
from sim_bridge.mavlink.odometry import pose_of_vision
from sim_bridge.mavlink.parameters import Parameters
from sim_bridge.mavlink.stabilizer import Gains, Stabilizer
from sim_bridge.mavlink.vocabulary import INFO, NS_PER_S, AttitudeTarget, Result, Setup

CONTACT_M = 0.03
"""Lower, it stands or bounces."""
SETTLE = 1.5
"""m/s more downwards for each second on the floor, while it lands: the motors come down."""
LOW_FORCE = 0.5
"""Of the weight: on the floor below it, it counts as put down."""
MOST_TEXTS = 100
"""Texts that wait to be sent."""


class Autopilot(ABC):
    """One autopilot from its boot on; a reboot makes another for the same body and parameters."""

    modes: ClassVar[Mapping[str, int]]
    """By name: HEARTBEAT.custom_mode."""

    def __init__(self, body: Body, parameters: Parameters, setup: Setup, now_ns: int) -> None:
        self.body, self.parameters, self.setup = body, parameters, setup
        self.estimator = Estimator(heading(ned_attitude(body.state.q_WB)))
        self.now_ns = self.boot_ns = now_ns
        self.armed = False
        self.landed = True
        """Whether it takes itself to stand."""
        self.flew = False
        """Whether it has left the ground since it was armed."""
        self.failsafe = False
        """Whether it flies by itself since something failed, until somebody changes the mode."""
        self.target: AttitudeTarget | None = None
        """The last one."""
        self.said: list[tuple[int, str]] = []
        """Severity and text, until somebody sends them."""
        self._stabilizer = Stabilizer(body.vehicle)
        self._armed_ns = self._rest_ns = now_ns
        self._force = 0.0
        self._goal = Goal(None, None, 0.0, 0.0)
        self.mode = self.first_mode
        self._ready = False

    @property
    @abstractmethod
    def first_mode(self) -> int:
        """After a boot."""

    @property
    @abstractmethod
    def has_position(self) -> bool:
        """Whether it knows where it is."""

    @property
    @abstractmethod
    def landing(self) -> bool:
        """Whether its mode brings it down."""

    @abstractmethod
    def request_mode(self, mode: int) -> Result:
        """A client or the pilot wants another mode."""

    @abstractmethod
    def arming_problem(self) -> str:
        """Why it will not arm; empty: it will."""

    @abstractmethod
    def take_attitude(self, message: Any) -> None:
        """SET_ATTITUDE_TARGET."""

    @abstractmethod
    def _pose_of(self, message: Any) -> SeenPose | None:
        """What ODOMETRY says, where it is taken."""

    @abstractmethod
    def _see(self, pose: SeenPose) -> None:
        """Take a pose as far as parameters say so."""

    @abstractmethod
    def _react(self) -> None:
        """Failsafes, and disarming by itself: once a period."""

    @abstractmethod
    def _wish(self) -> Wish:
        """What to fly now."""

    @abstractmethod
    def _spool(self) -> float:
        """Share of the force that the motors give, so long after arming."""

    @abstractmethod
    def _landed_after_s(self) -> float:
        """So long on the floor, and it counts as landed."""

    @property
    @abstractmethod
    def gains(self) -> Gains:
        """Of the attitude."""

    @property
    def age_s(self) -> float:
        """Since the boot."""
        return (self.now_ns - self.boot_ns) / NS_PER_S

    @property
    def armed_s(self) -> float:
        """Since it was armed."""
        return (self.now_ns - self._armed_ns) / NS_PER_S

    @property
    def rested_s(self) -> float:
        """On the floor with little force."""
        return (self.now_ns - self._rest_ns) / NS_PER_S

    @property
    def idle_s(self) -> float:
        """Likewise, since it was armed."""
        return min(self.armed_s, self.rested_s)

    @property
    def force(self) -> float:
        """Collective force that the rotors are asked for, as a share of the weight."""
        return self._force

    def announce(self) -> None:  # noqa: B027 - PX4 says nothing
        """Say what is said at once after a boot."""

    def _become_ready(self) -> None:  # noqa: B027 - ArduPilot says nothing
        """Say what is said once it could be armed."""

    def take_odometry(self, message: Any) -> None:
        """ODOMETRY."""
        self.feed(self._pose_of(message))

    def take_vision(self, message: Any) -> None:
        """VISION_POSITION_ESTIMATE."""
        self.feed(pose_of_vision(message))

    def feed(self, pose: SeenPose | None) -> None:
        """A pose from anywhere; None: there was none."""
        if pose is not None:
            self._see(pose)

    def step(self, now_ns: int) -> None:
        """Live one period."""
        self.now_ns = now_ns
        if not self._ready and self.age_s >= self.setup.boot_s:
            self._ready = True
            self._become_ready()
        self.estimator.predict(self.body.inertial, now_ns, self.landed)
        self._notice_ground()
        if self.armed:
            self._react()
        if self.armed:
            self._fly()
        else:
            self._rest()
        self.body.advance()

    def request_arm(self, arm: bool, forced: bool) -> Result:
        """Arm or disarm."""
        if arm == self.armed:
            return Result.ACCEPTED
        if not arm:
            return self._request_disarm(forced)
        problem = "" if forced else self.arming_problem()
        if self.body.broken:
            problem = problem or "crashed"
        if problem:
            return self._refuse_arming(problem)
        self.armed, self.flew, self._armed_ns = True, False, self.now_ns
        self._enter(self.mode)
        return Result.ACCEPTED

    def disarm(self, text: str = "") -> None:
        """Stop the motors."""
        self.armed = self.failsafe = False
        self._rest()
        if text:
            self.say(INFO, text)

    def say(self, severity: int, text: str) -> None:
        """A line for STATUSTEXT."""
        if len(self.said) < MOST_TEXTS:
            self.said.append((severity, text))

    @abstractmethod
    def _refuse_arming(self, problem: str) -> Result:
        """Say why."""

    @abstractmethod
    def _request_disarm(self, forced: bool) -> Result:
        """A client wants the motors off."""

    def _enter(self, mode: int) -> None:
        """From now on in this mode, from where it is."""
        self.mode, self.failsafe = mode, False
        if self.armed and self.landing:
            self.landed, self._rest_ns = False, self.now_ns
        estimate = self.estimator
        x, y, z = estimate.position
        self._goal = Goal((x, y) if self.has_position else None, z, 0.0, heading(estimate.attitude))

    def _fail_over(self, mode: int) -> None:
        """Change the mode by itself."""
        self._enter(mode)
        self.failsafe = True

    def _hold(self, *, place: bool = True) -> Wish:
        """Stay where the mode was entered; or level, at that height."""
        goal = self._goal if place and self.has_position else self._goal._replace(place=None)
        return towards(goal, self.estimator)

    def _sink(self, speed: float) -> Wish:
        """Come down, m/s."""
        kept = self._goal.place if self.has_position else None
        settled = speed + SETTLE * self.rested_s
        return towards(self._goal._replace(place=kept, down=None, sink=settled), self.estimator)

    def _fly(self) -> None:
        wish = self._wish()
        self._force = wish.force * self._spool()
        newtons = self._force * self.body.vehicle.weight_N
        estimate = self.estimator
        if newtons > 0.0 and not (self.landing and self.landed):
            self.body.command(
                self._stabilizer.speeds(wish.attitude, newtons, estimate.attitude, estimate.rates, self.gains)
            )
        else:
            self._rest()

    def _rest(self) -> None:
        self._force = 0.0
        self.body.command((0.0, 0.0, 0.0, 0.0))

    def _notice_ground(self) -> None:
        """Landed only after a while on the floor with little force; flying as soon as it has left."""
        if self.body.height_m > CONTACT_M:
            self.landed, self._rest_ns = False, self.now_ns
            self.flew = self.flew or self.armed
        elif self._force > LOW_FORCE and not self.landing:
            self._rest_ns = self.now_ns
        elif not self.landed and self.rested_s >= self._landed_after_s():
            self.landed = True

    def _level(self) -> Hamilton:
        return level(self._goal.yaw)
