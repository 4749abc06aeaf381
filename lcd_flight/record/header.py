"""What a log says of its flight before the first tick: enough to explain, replay and review it without other files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

import msgspec

from lcd_flight.model import FlightPlan, SafetyLimits, Vehicle
from lcd_flight.record import plan_file
from lcd_flight.record.machine import this_machine
from lcd_flight.record.plan_file import LegFile, Prediction
from lcd_flight.wire import json_records

LOG_SCHEMA = 1
"""Raised when a reader of the version before could misread a file."""

PROFILE = "lcd-flight"
"""MCAP's word for what files have in common; ours is known by it."""

MISSION, PLAN, VEHICLE, LIMITS = "mission.yaml", "plan.json", "vehicle.json", "limits.json"
"""Names of the attachments that every log has."""

PREDICTION, MODEL = "prediction.json", "model_card.json"
"""Names of those that a log may lack."""

FLIGHT, VERSIONS = "flight", "versions"
"""Names of the metadata records."""

RECOVERED = "recovered"
"""Name of the metadata record that only `lcd recover` writes: the flight's end may be missing."""


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
    predictions: tuple[Prediction, ...] = ()
    """The planner's, one for each trajectory of the mission, in order."""
    notes: Mapping[str, str] = field(default_factory=dict)
    """Anything else worth keeping, shown by the review as it stands."""
    versions: Mapping[str, str] = field(default_factory=dict)
    """Of programs, machine and commit; filled in by `this_machine` when a log is written."""


def attachments(header: FlightHeader) -> dict[str, tuple[str, bytes]]:
    """Name to media type and content."""
    files = {
        MISSION: ("application/yaml", header.mission_text.encode()),
        PLAN: ("application/json", _pretty(plan_file.written(header.plan))),
        VEHICLE: ("application/json", _pretty(header.vehicle)),
        LIMITS: ("application/json", _pretty(header.limits)),
    }
    if header.predictions:
        files[PREDICTION] = ("application/json", _pretty(header.predictions))
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
        plan=plan_file.read(json_records.decode(files[PLAN], list[LegFile])),
        vehicle=json_records.decode(files[VEHICLE], Vehicle),
        limits=json_records.decode(files[LIMITS], SafetyLimits),
        link=flight.pop("link"),
        seed=int(flight.pop("seed")),
        started=datetime.fromisoformat(flight.pop("started")),
        planner=flight.pop("planner"),
        model_card=msgspec.json.decode(files.get(MODEL, b"{}")),
        predicted_max_error_m=float(predicted) if predicted else None,
        predictions=json_records.decode(files.get(PREDICTION, b"[]"), tuple[Prediction, ...]),
        notes=flight,
        versions=dict(metadata_records.get(VERSIONS, {})),
    )


def _pretty(value: Any) -> bytes:
    return msgspec.json.format(json_records.encode(value), indent=1)
