"""The shared vocabulary. Imports numpy and nothing else; everything in the project may import it."""

from lcd_flight.errors import InputError, LcdError, Outcome, RefusedError
from lcd_flight.model.finding import Finding, Severity
from lcd_flight.model.limits import Geofence, SafetyLimits
from lcd_flight.model.phase import Phase
from lcd_flight.model.plan import FlightPlan, Leg, LegKind
from lcd_flight.model.ports import (
    Clock,
    ControlLaw,
    Inspection,
    Link,
    LinkContext,
    Observer,
    PoseListener,
    PoseOptions,
    PosePublisher,
    PoseSource,
    RolloutOptions,
    Simulator,
)
from lcd_flight.model.rollout import CRASH_ERROR_M, RolloutLabels
from lcd_flight.model.state import AttitudeThrust, Reference, State
from lcd_flight.model.telemetry import LinkReport, PoseReport, RawPose, Telemetry, Transmission
from lcd_flight.model.tick import Command, MotorRequest, Tick, TickInputs
from lcd_flight.model.trajectory import COEFFICIENTS, Trajectories, Trajectory
from lcd_flight.model.types import (
    GRAVITY_M_PER_S2,
    BoolArray,
    FloatArray,
    IntArray,
    LinkLossPolicy,
    Loop,
    MocapAxes,
    Quaternion,
    SeedArray,
    Vector3,
)
from lcd_flight.model.vehicle import GeometricGains, OnboardController, PidGains, Vehicle
from lcd_flight.model.world import Tasks, TaskSampler, World

__all__ = [
    "COEFFICIENTS",
    "CRASH_ERROR_M",
    "GRAVITY_M_PER_S2",
    "AttitudeThrust",
    "BoolArray",
    "Clock",
    "Command",
    "ControlLaw",
    "Finding",
    "FlightPlan",
    "FloatArray",
    "Geofence",
    "GeometricGains",
    "InputError",
    "Inspection",
    "IntArray",
    "LcdError",
    "Leg",
    "LegKind",
    "Link",
    "LinkContext",
    "LinkLossPolicy",
    "LinkReport",
    "Loop",
    "MocapAxes",
    "MotorRequest",
    "Observer",
    "OnboardController",
    "Outcome",
    "Phase",
    "PidGains",
    "PoseListener",
    "PoseOptions",
    "PosePublisher",
    "PoseReport",
    "PoseSource",
    "Quaternion",
    "RawPose",
    "Reference",
    "RefusedError",
    "RolloutLabels",
    "RolloutOptions",
    "SafetyLimits",
    "SeedArray",
    "Severity",
    "Simulator",
    "State",
    "TaskSampler",
    "Tasks",
    "Telemetry",
    "Tick",
    "TickInputs",
    "Trajectories",
    "Trajectory",
    "Transmission",
    "Vector3",
    "Vehicle",
    "World",
]
