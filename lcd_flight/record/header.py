"""What a log says of its flight before the first tick: enough to explain, replay and review it without other files."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from lcd_flight.model import FlightPlan, Leg, LegKind, SafetyLimits, Trajectory, Vehicle
from lcd_flight.model.types import FloatArray
from lcd_flight.record import codec

LOG_SCHEMA = 1
"""Raised when a reader of the version before could misread a file."""

PROFILE = "lcd-flight"
"""MCAP's word for what files have in common; ours is known by it."""

MISSION, PLAN, VEHICLE, LIMITS, MODEL = "mission.yaml", "plan.json", "vehicle.json", "limits.json", "model_card.json"
"""Names of the attachments."""

FLIGHT, VERSIONS = "flight", "versions"
"""Names of the metadata records."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlightHeader:
    """A flight's description, written and flushed before take-off."""

    name: str
    """The mission's."""
    mission_text: str
    """The mission file as it was read."""
    plan: FlightPlan
    vehicle: Vehicle
    limits: SafetyLimits
    link: str
    """URI."""
    seed: int
    started: datetime
    """Wall-clock time, for people; aware of its zone."""
    planner: str
    """E.g. `learned`."""
    model_card: Mapping[str, Any] = field(default_factory=dict)
    """Of the planner's model; empty where it has none."""
    predicted_max_error_m: float | None = None
    """The rehearsal's, None where there was none."""
    notes: Mapping[str, str] = field(default_factory=dict)
    """Anything else worth keeping, shown by the review as it stands."""
    versions: Mapping[str, str] = field(default_factory=dict)
    """Of programs, machine and commit; filled in by `this_machine` when a log is written."""


@dataclass(frozen=True, slots=True)
class _LegFile:
    """A leg in `plan.json`: durations (S) in s, coefficients (4, S, 8) of x, y, z and yaw in ascending powers."""

    kind: LegKind
    durations_s: list[float]
    coefficients: list[list[list[float]]]
    settle: bool = False
    waypoints: list[list[float]] | None = None
    baseline_durations_s: list[float] | None = None
    baseline_coefficients: list[list[list[float]]] | None = None


def attachments(header: FlightHeader) -> dict[str, tuple[str, bytes]]:
    """Name to media type and content."""
    files = {
        MISSION: ("application/yaml", header.mission_text.encode()),
        PLAN: ("application/json", _pretty(tuple(_leg_file(leg) for leg in header.plan.legs))),
        VEHICLE: ("application/json", _pretty(header.vehicle)),
        LIMITS: ("application/json", _pretty(header.limits)),
    }
    if header.model_card:
        files[MODEL] = ("application/json", _pretty(header.model_card))
    return files


def metadata(header: FlightHeader) -> dict[str, dict[str, str]]:
    """Name of the record to its keys and values."""
    predicted = header.predicted_max_error_m
    flight = {
        "log_schema": str(LOG_SCHEMA),
        "name": header.name,
        "link": header.link,
        "seed": str(header.seed),
        "started": header.started.isoformat(),
        "planner": header.planner,
        "predicted_max_error_m": "" if predicted is None else repr(predicted),
    }
    return {FLIGHT: {**header.notes, **flight}, VERSIONS: dict(header.versions or this_machine())}


def header_from(metadata_records: Mapping[str, Mapping[str, str]], files: Mapping[str, bytes]) -> FlightHeader:
    """The header that `attachments` and `metadata` were made of.

    Raises:
        KeyError: one of them is missing.
        ValueError, msgspec.MsgspecError: one of them holds something else.
    """
    flight = dict(metadata_records[FLIGHT])
    del flight["log_schema"]
    predicted = flight.pop("predicted_max_error_m")
    return FlightHeader(
        name=flight.pop("name"),
        mission_text=files[MISSION].decode(),
        plan=FlightPlan(tuple(_leg(leg) for leg in codec.decode(files[PLAN], list[_LegFile]))),
        vehicle=codec.decode(files[VEHICLE], Vehicle),
        limits=codec.decode(files[LIMITS], SafetyLimits),
        link=flight.pop("link"),
        seed=int(flight.pop("seed")),
        started=datetime.fromisoformat(flight.pop("started")),
        planner=flight.pop("planner"),
        model_card=msgspec.json.decode(files.get(MODEL, b"{}")),
        predicted_max_error_m=float(predicted) if predicted else None,
        notes=flight,
        versions=dict(metadata_records.get(VERSIONS, {})),
    )


def this_machine() -> dict[str, str]:
    """What wrote the log, and where: versions, commit where it is known, machine."""
    packages = ("lcd-flight", "numpy", "numba", "mcap", "pyzmq")
    return {
        **{name: importlib.metadata.version(name) for name in packages},
        "commit": _commit(),
        "python": platform.python_version(),
        "system": platform.platform(),
        "processors": f"{os.cpu_count()} x {platform.machine()}",
        "host": platform.node(),
    }


def _commit() -> str:
    """The commit that runs, with `-dirty` where files were changed; empty for an installed package or without git."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return ""
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=5.0, check=True).stdout.strip()  # noqa: S603
    except (OSError, subprocess.SubprocessError):
        return ""


def _leg_file(leg: Leg) -> _LegFile:
    return _LegFile(
        kind=leg.kind,
        durations_s=leg.trajectory.durations_s.tolist(),
        coefficients=leg.trajectory.coefficients.tolist(),
        settle=leg.settle,
        waypoints=None if leg.waypoints is None else leg.waypoints.tolist(),
        baseline_durations_s=None if leg.baseline is None else leg.baseline.durations_s.tolist(),
        baseline_coefficients=None if leg.baseline is None else leg.baseline.coefficients.tolist(),
    )


def _leg(file: _LegFile) -> Leg:
    baseline = None
    if file.baseline_durations_s is not None and file.baseline_coefficients is not None:
        baseline = Trajectory(_array(file.baseline_durations_s), _array(file.baseline_coefficients))
    return Leg(
        kind=file.kind,
        trajectory=Trajectory(_array(file.durations_s), _array(file.coefficients)),
        waypoints=None if file.waypoints is None else _array(file.waypoints),
        settle=file.settle,
        baseline=baseline,
    )


def _array(values: Any) -> FloatArray:
    return np.asarray(values, dtype=np.float64)


def _pretty(value: Any) -> bytes:
    return msgspec.json.format(codec.encode(value), indent=1)
