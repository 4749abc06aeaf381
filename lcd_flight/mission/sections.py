"""The sections of a mission beside its plan: vehicle, motion capture, planner, control, safety, log, rehearsal."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from lcd_flight.mission.keys import Keys, Point, Real, Switch, Whole, Word
from lcd_flight.model import LinkLossPolicy

Volts = Annotated[Real, Field(gt=0.0, le=100.0)]
Fault = Literal["motor_noise", "mocap_dropout"]


class Battery(Keys):
    """Voltages at which the flight reacts, and how long a full battery lasts."""

    voltage_takeoff_V: Volts = 3.8
    """At rest before take-off: refuse to arm below."""
    voltage_warning_V: Volts = 3.2
    """In flight: warn below."""
    voltage_critical_V: Volts = 3.0
    """In flight, below it for 2 s: `safety.on_battery_critical`."""
    endurance_s: Annotated[Real, Field(gt=0.0, le=36_000.0)] = 300.0
    """Flight time on a full battery; a longer plan is refused."""


class VehicleKeys(Keys):
    """What flies, how it is reached, where it stands."""

    type: Annotated[Word, Field(examples=["crazyflie"])]
    """Airframe: a vehicle that ships, or a vehicle file (relative to the mission's folder)."""
    uri: Annotated[str, Field(pattern=r"^[a-z][a-z0-9+.-]*://\S*$", max_length=500)] = "sim://"
    """Link to the vehicle, e.g. sim:// or sim+delay+drop://?delay_ms=12&drop=0.05."""
    initial_position_m: Point = (0.0, 0.0, 0.0)
    """Where the vehicle stands before take-off; must agree with motion capture."""
    initial_yaw_deg: Annotated[Real, Field(ge=-360.0, le=360.0)] = 0.0
    """Heading with which it stands there, counter-clockwise from +x."""
    initial_position_tolerance_m: Annotated[Real, Field(gt=0.0, le=5.0)] = 0.1
    """How far motion capture may see it from there before arming."""
    battery: Battery = Battery()
    """Voltages and endurance."""


class MotionCapture(Keys):
    """Where poses come from. With sim:// the simulator publishes them there."""

    endpoint: Annotated[str, Field(pattern=r"^[a-z][a-z0-9+.-]*://\S+$", max_length=500)] = "tcp://127.0.0.1:5555"
    """Where poses are published: tcp://HOST:PORT, ipc://PATH, loopback://NAME (within one process)."""
    rigid_body: Annotated[str, Field(pattern=r"^[A-Za-z0-9_.-]+$", max_length=64)] = "cf1"
    """Name of the vehicle's rigid body."""
    frame: Literal["enu", "ned", "y_up"] = "enu"
    """World frame of the poses as published: z up, z down, or y up."""
    rate_hz: Annotated[Real, Field(ge=20.0, le=1000.0)] = 100.0
    """Poses per second; pre-flight wants 95 to 105 % of it."""
    timeout_s: Annotated[Real, Field(ge=0.1, le=2.0)] = 0.3
    """Without a valid pose for so long: `safety.on_mocap_lost`."""


PlannerType: TypeAlias = Literal["learned-polished", "learned", "analytic-polished", "analytic", "minimum-snap"]


class PlanLimits(Keys):
    """What every planned path is bent to keep, and refused where it does not."""

    max_velocity_m_per_s: Annotated[Real, Field(gt=0.0, le=20.0)] = 5.0
    """Highest planned speed."""
    max_thrust_ratio: Annotated[Real, Field(gt=0.0, le=3.0)] = 0.85
    """Highest planned thrust as a share of what the motors have; above 1 the rehearsal alone decides."""
    max_tilt_deg: Annotated[Real, Field(gt=0.0, le=180.0)] = 60.0
    """Largest planned angle between thrust and the vertical."""
    max_body_rate_deg_per_s: Annotated[Real, Field(gt=0.0, le=7200.0)] = 1200.0
    """Highest planned rate of roll and pitch together."""


class Planner(Keys):
    """How trajectories are planned."""

    type: PlannerType = "learned-polished"
    """Minimum snap alone; lowering a formula (`analytic`) or a learned tracking cost from there; and with `-polished`
    also a search from the plan in the simulator, with a few hundred flights."""
    model: Word | None = None
    """Learned cost: a model that ships, or a file (relative to the mission's folder); its card must match vehicle
    and loop. Left out: the one that ships for the vehicle."""
    speed_m_per_s: Annotated[Real, Field(gt=0.0, le=20.0)] = 1.0
    """Mean speed over each segment between waypoints."""
    weight: Annotated[Real, Field(gt=0.0, le=1000.0)] = 1.0
    """Weight of the learned cost against extra snap."""
    transfer_speed_m_per_s: Annotated[Real, Field(gt=0.0, le=2.0)] = 0.5
    """Mean speed of the ways to a first waypoint and to the landing point."""
    limits: PlanLimits = PlanLimits()
    """Limits of planned paths."""


class Control(Keys):
    """The control law."""

    type: Literal["geometric"] = "geometric"
    """The geometric law: collective thrust and attitude."""
    rate_hz: Literal[100] = 100
    """Control steps per second."""
    gains: Word = "default"
    """`default`: the vehicle's own; or a YAML file of gains (relative to the mission's folder)."""


class GeofenceKeys(Keys):
    """A box to stay inside."""

    min_m: Annotated[Point, Field(examples=[[-1.0, -1.0, 0.0]])]
    """Its lowest x, y, z."""
    max_m: Annotated[Point, Field(examples=[[4.0, 4.0, 3.0]])]
    """Its highest x, y, z."""


class Safety(Keys):
    """Limits of the flight, and what happens beyond them."""

    geofence: Annotated[GeofenceKeys, Field(examples=[{"min": [-1.0, -1.0, 0.0], "max": [4.0, 4.0, 3.0]}])]
    """The planned path and the flight stay inside."""
    max_position_error_m: Annotated[Real, Field(gt=0.0, le=10.0)] = 1.5
    """Tracking error at which it lands at once; at half of it, it brakes."""
    max_predicted_error_m: Annotated[Real, Field(gt=0.0, le=10.0)] = 0.75
    """Refuse to fly if the rehearsal's 95th percentile exceeds it."""
    on_mocap_lost: Literal["land", "cut"] = "land"
    """Level descent without pose, or stop the motors."""
    on_link_lost: LinkLossPolicy = "vehicle"
    """What the vehicle does by itself without the link: what its firmware does by default, or stop the motors within
    1 s."""
    on_battery_critical: Literal["land", "warn"] = "land"
    """Land at once, or warn only."""
    confirm: Switch = True
    """Ask before arming real motors (--yes skips)."""


class Log(Keys):
    """The flight log."""

    dir: Annotated[Path, Field(examples=["flights/"])] = Path("flights")
    """Folder for logs and reports (relative to where the command is run)."""
    format: Literal["mcap"] = "mcap"
    """File format."""


class Rehearse(Keys):
    """The mission's own plan, flown in simulation before arming."""

    runs: Annotated[Whole, Field(ge=1, le=10_000)] = 20
    """How many flights."""
    faults: Annotated[tuple[Fault, ...], Field(max_length=2)] = ("motor_noise", "mocap_dropout")
    """What disturbs them: noise of the motors; a gap of 10 to 40 ms in the poses of each run."""
