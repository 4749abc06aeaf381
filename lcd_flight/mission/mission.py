"""A mission as the rest of the house sees it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PrivateAttr

from lcd_flight.mission.actions import (
    Hold,
    HoldItem,
    Land,
    LandItem,
    PlanItem,
    Takeoff,
    TakeoffItem,
    TrajectoryAction,
    TrajectoryItem,
)
from lcd_flight.mission.keys import Keys, Whole
from lcd_flight.mission.problems import Key, dotted
from lcd_flight.mission.sections import Control, Log, MotionCapture, Planner, Rehearse, Safety, VehicleKeys
from lcd_flight.model import Geofence, SafetyLimits
from lcd_flight.planning.limits import PlanLimits


@dataclass(frozen=True, slots=True)
class Source:
    """The file that a mission was read from. All sources compare equal: missions are equal by what they say."""

    path: Path | None = field(default=None, compare=False)
    text: str = field(default="", compare=False)
    lines: Mapping[Key, int] = field(default_factory=dict, compare=False)


class Mission(Keys):
    """Everything that one flight needs to know."""

    version: Annotated[Whole, Field(ge=1, le=1, examples=[1])]
    """Version of this format."""
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=64, examples=["four-waypoints"])]
    """Letters, digits, dots, dashes and underscores; part of the log's file name."""
    seed: Annotated[Whole, Field(ge=0, le=2**32 - 1)] = 0
    """One seed for simulated noise and faults."""
    vehicle: VehicleKeys
    """What flies, how it is reached, where it stands."""
    motion_capture: MotionCapture = MotionCapture()
    """Where poses come from."""
    planner: Planner = Planner()
    """How trajectories are planned."""
    control: Control = Control()
    """The control law."""
    plan: Annotated[
        tuple[PlanItem, ...],
        Field(min_length=2, max_length=1000, examples=[[{"takeoff": {"height": 1.0}}, {"land": {}}]]),
    ]
    """What to do, in order: take-off, any number of holds and trajectories, landing."""
    safety: Safety
    """Limits of the flight, and what happens beyond them."""
    log: Log = Log()
    """The flight log."""
    rehearse: Rehearse = Rehearse()
    """The mission's own plan, flown in simulation before arming."""

    _source: Source = PrivateAttr(default_factory=Source)

    @property
    def source(self) -> Source:
        """Where it was read from."""
        return self._source

    def place(self, *key: str | int) -> str:
        """Where `key` stands, for messages: `missions/x.yaml:12: plan[2].trajectory`."""
        line = next(
            (self._source.lines[key[:n]] for n in range(len(key), 0, -1) if key[:n] in self._source.lines), None
        )
        file = "" if self._source.path is None or line is None else f"{self._source.path}:{line}: "
        return f"{file}{dotted(key)}"

    @property
    def folder(self) -> Path:
        """What the files that it names are relative to."""
        return self._source.path.parent if self._source.path else Path()

    def actions(self) -> tuple[Takeoff | Hold | TrajectoryAction | Land, ...]:
        """The items of `plan`, unwrapped."""
        return tuple(_action(item) for item in self.plan)

    @property
    def initial_yaw_rad(self) -> float:
        """`vehicle.initial_yaw_deg` in rad."""
        return math.radians(self.vehicle.initial_yaw_deg)

    def geofence(self) -> Geofence:
        """`safety.geofence` in the house's vocabulary."""
        return Geofence(self.safety.geofence.min_m, self.safety.geofence.max_m)

    def plan_limits(self) -> PlanLimits:
        """`planner.limits` in the planner's vocabulary."""
        keys = self.planner.limits
        return PlanLimits(
            max_velocity=keys.max_velocity_m_per_s,
            max_thrust_ratio=keys.max_thrust_ratio,
            max_tilt_rad=math.radians(keys.max_tilt_deg),
            max_body_rate=math.radians(keys.max_body_rate_deg_per_s),
        )

    def safety_limits(self) -> SafetyLimits:
        """What the monitors compare the flight with."""
        battery = self.vehicle.battery
        return SafetyLimits(
            geofence=self.geofence(),
            max_position_error_m=self.safety.max_position_error_m,
            brake_position_error_m=0.5 * self.safety.max_position_error_m,
            pose_timeout_s=self.motion_capture.timeout_s,
            on_mocap_lost=self.safety.on_mocap_lost,
            on_battery_critical=self.safety.on_battery_critical,
            battery_takeoff_V=battery.voltage_takeoff_V,
            battery_warning_V=battery.voltage_warning_V,
            battery_critical_V=battery.voltage_critical_V,
            expected_pose_rate_hz=self.motion_capture.rate_hz,
            initial_position_tolerance_m=self.vehicle.initial_position_tolerance_m,
        )


def with_source(mission: Mission, source: Source) -> Mission:
    """The same mission, knowing its file."""
    located = mission.model_copy()
    located._source = source
    return located


def _action(item: Any) -> Takeoff | Hold | TrajectoryAction | Land:
    match item:
        case TakeoffItem(takeoff=takeoff):
            return takeoff
        case HoldItem(hold=hold):
            return hold
        case TrajectoryItem(trajectory=trajectory):
            return trajectory
        case LandItem(land=land):
            return land
    raise TypeError(f"not an item of a plan: {item!r}")
