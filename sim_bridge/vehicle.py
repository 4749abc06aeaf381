"""A simulated vehicle behind its radio: the plant, arming, the fallback and the faults. Time comes in as an argument.

Every change takes effect at its own instant: the plant is first advanced to it.
"""

from __future__ import annotations

from collections.abc import Callable
from operator import itemgetter

from lcd_flight.model import AttitudeThrust, LinkContext, RefusedError, State, Telemetry
from lcd_flight.model.frames import from_yaw, yaw_of
from sim_bridge.plant import Plant

FALLBACK_NS = 100_000_000
"""So long without a setpoint, and the fallback acts."""
FALLBACK_SHARE = 0.95
"""Of the weight: it comes down slowly."""


def warm_up(context: LinkContext) -> None:
    """Compile what flying needs: seconds the first time, which must not fall into the flight."""
    Plant(context.vehicle, _standing(context), context.seed).advance(FALLBACK_NS)


def _standing(context: LinkContext) -> State:
    rest = (0.0, 0.0, 0.0)
    return State(p_WB=context.initial_position_m, v_WB_W=rest, q_WB=from_yaw(context.initial_yaw_rad), w_WB_B=rest)


class SimulatedVehicle:
    """One vehicle, standing where the mission says."""

    def __init__(self, context: LinkContext, battery_V: float | None) -> None:
        self._plant = Plant(context.vehicle, _standing(context), context.seed, battery_V=battery_V)
        self._hover_N = context.vehicle.weight_N
        self._time_ns = 0
        self._locked = ""
        """Why it will not fly again; empty while it would."""
        self._fallback_due_ns: int | None = None
        self._death_due_ns: int | None = None
        self._said: list[str] = []
        self.armed = False
        self.alive = True
        """Whether it has power; without, nothing is heard of it."""
        self.fallback_active = False

    @property
    def state_ns(self) -> int:
        """When `state` was true: the plant lives in whole periods of its onboard controller."""
        return self._time_ns - self._plant.lag_ns

    @property
    def state(self) -> State:
        """Where it truly is, at the time it was last advanced to."""
        return self._plant.state

    def switch_on(self, now_ns: int) -> None:
        """Begin to live at `now_ns`."""
        self._time_ns = now_ns

    def die_at(self, due_ns: int) -> None:
        """Lose all power at `due_ns`."""
        self._death_due_ns = due_ns

    def arm(self, now_ns: int) -> None:
        """Make it take setpoints.

        Raises:
            RefusedError: it is locked, with the reason and the remedy.
        """
        self.advance_to(now_ns)
        if self._locked:
            raise RefusedError(f"the simulated vehicle will not arm: {self._locked}; connect anew")
        self.armed = True

    def disarm(self, now_ns: int) -> None:
        """Stop the motors; it may be armed again."""
        self.advance_to(now_ns)
        self._cut()

    def lock(self, now_ns: int, reason: str) -> None:
        """Stop the motors for good."""
        self.advance_to(now_ns)
        self._cut()
        self._locked = self._locked or reason

    def take(self, setpoint: AttitudeThrust, now_ns: int) -> None:
        """Fly a setpoint that has just arrived, if armed."""
        self.advance_to(now_ns)
        if self.armed:
            self._plant.setpoint = setpoint
            self._fallback_due_ns = now_ns + FALLBACK_NS
            self.fallback_active = False

    def advance_to(self, now_ns: int) -> None:
        """Live until `now_ns`; what is due before happens at its own instant."""
        acts: tuple[tuple[int | None, Callable[[], None]], ...] = (
            (self._fallback_due_ns, self._fall_back),
            (self._death_due_ns, self._die),
        )
        due_now = [(due_ns, act) for due_ns, act in acts if due_ns is not None and due_ns <= now_ns]
        for due_ns, act in sorted(due_now, key=itemgetter(0)):
            self._advance_plant(due_ns)
            act()
        self._advance_plant(now_ns)
        if self._plant.crashed and not self._locked:
            self._cut()
            self._locked = "it has crashed"
            self._said.append("crashed: motors stopped")

    def telemetry(self, now_ns: int) -> Telemetry:
        """What it sends at `now_ns`; text is sent once."""
        messages, self._said = tuple(self._said), []
        return Telemetry(
            stamp_ns=now_ns,
            battery_V=self._plant.battery_V,
            armed=self.armed,
            airborne=not self._plant.on_ground,
            crashed=self._plant.crashed,
            q_WB=self._plant.state.q_WB,
            motor_shares=self._plant.motor_shares,
            messages=messages,
        )

    def _advance_plant(self, until_ns: int) -> None:
        if until_ns > self._time_ns:
            self._plant.advance(until_ns - self._time_ns)
            self._time_ns = until_ns

    def _fall_back(self) -> None:
        """Level, slightly below hover thrust; on the ground, none."""
        if not self.armed:
            return
        thrust_N = 0.0 if self._plant.on_ground else FALLBACK_SHARE * self._hover_N
        self._plant.setpoint = AttitudeThrust(thrust_N, from_yaw(yaw_of(self._plant.state.q_WB)))
        self._fallback_due_ns = None
        self.fallback_active = True
        share = thrust_N / self._hover_N
        self._said.append(f"no fresh setpoint for {FALLBACK_NS / 1e6:.0f} ms: level at {share:.0%} of hover thrust")

    def _die(self) -> None:
        self._cut()
        self._locked = "it has no power"
        self.alive = False
        self._death_due_ns = None

    def _cut(self) -> None:
        self._plant.stop()
        self.armed = self.fallback_active = False
        self._fallback_due_ns = None
