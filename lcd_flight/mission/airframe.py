"""The vehicle that a mission flies, with the mission's gains, and what it can reach."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from pydantic import Field, ValidationError

from lcd_flight.mission.draft import Draft
from lcd_flight.mission.explain import did_you_mean, explanations
from lcd_flight.mission.keys import Keys, Real
from lcd_flight.mission.mission import Mission
from lcd_flight.mission.problems import Key, MissionError, Problem
from lcd_flight.mission.sections import Control, Planner, VehicleKeys
from lcd_flight.mission.source_file import read_text
from lcd_flight.mission.strict_yaml import read_document
from lcd_flight.model import GeometricGains, InputError, Vehicle
from lcd_flight.worlds import load_vehicle, vehicle_names

Gain = Annotated[Real, Field(ge=0.0, le=10_000.0)]
GainVector = tuple[Gain, Gain, Gain]


class GainKeys(Keys):
    """A file of gains for the flight loop, normalised by mass and inertia."""

    position: GainVector
    """1/s^2, x, y, z: acceleration for each metre of position error."""
    velocity: GainVector
    """1/s, x, y, z: acceleration for each m/s of velocity error."""
    attitude: Gain = 0.0
    """1/s^2, of the attitude law; unused where an onboard controller flies the attitude."""
    body_rates: Gain = 0.0
    """1/s, of the attitude law; unused where an onboard controller flies the attitude."""
    integral: GainVector = (0.0, 0.0, 0.0)
    """1/s^3, x, y, z: integral action on the position error."""
    integral_limit: Gain = 1.0
    """m/s^2, bound of what the integral may ask for."""


def vehicle_of(mission: Mission) -> Vehicle:
    """The vehicle of `vehicle.type`, with the gains of `control.gains`.

    Raises:
        InputError: there is no such vehicle or file, or it is wrong.
    """
    vehicle = _load_vehicle(mission.vehicle.type, mission.folder)
    if mission.control.gains == "default":
        return vehicle
    return replace(vehicle, flight_gains=load_gains(mission.folder / mission.control.gains))


def load_gains(path: Path) -> GeometricGains:
    """Gains from a YAML file (`GainKeys`).

    Raises:
        InputError: the file is missing or wrong; one line for each problem.
    """
    document = read_document(read_text(path))
    problems = list(document.problems)
    try:
        keys = GainKeys.model_validate({} if document.data is None else document.data)
    except ValidationError as error:
        problems += [Problem(document.line_of(key), key, text) for key, text in explanations(error, GainKeys)]
    if problems:
        raise MissionError(str(path), problems)
    return GeometricGains(**keys.model_dump())


def _load_vehicle(name: str, folder: Path) -> Vehicle:
    """A vehicle that ships, else a file beside the mission."""
    return load_vehicle(name if name in vehicle_names() else str(folder / name))


def top_speed_m_per_s(vehicle: Vehicle) -> float:
    """Fastest steady level flight: all thrust, its vertical part carrying the weight, against drag c v^2 + k v.

    c is the parasitic drag along body x, k the rotors' drag at full speed; tilt is left out of both.
    """
    push_N = math.sqrt(max(vehicle.max_thrust_N**2 - vehicle.weight_N**2, 0.0))
    c, k = vehicle.parasitic_drag[0], 4.0 * vehicle.k_d * vehicle.rotor_speed_max
    if c == 0.0:
        return push_N / k if k > 0.0 else math.inf
    return (math.sqrt(k * k + 4.0 * c * push_N) - k) / (2.0 * c)


def vehicle_fits(draft: Draft) -> list[tuple[Key, str]]:
    """The vehicle exists, can be flown with thrust and attitude, and reaches the planned speed."""
    keys = draft.part(VehicleKeys, "vehicle")
    if keys is None:
        return []
    if not (keys.type in vehicle_names() or (draft.folder / keys.type).is_file()):
        return [
            (
                ("vehicle", "type"),
                f'"{keys.type}" is no known vehicle and no file; {did_you_mean(keys.type, vehicle_names())}',
            )
        ]
    try:
        vehicle = _load_vehicle(keys.type, draft.folder)
    except InputError as error:
        return [(("vehicle", "type"), line) for line in str(error).splitlines()]
    if vehicle.onboard is None:
        return [
            (
                ("vehicle", "type"),
                f'"{keys.type}" has no onboard controller to fly thrust and attitude; choose another vehicle',
            )
        ]
    return _too_fast(draft, vehicle)


def _too_fast(draft: Draft, vehicle: Vehicle) -> list[tuple[Key, str]]:
    planner, limit = draft.part(Planner, "planner"), top_speed_m_per_s(vehicle)
    if planner is None or planner.speed_m_per_s <= limit:
        return []
    text = (
        f"{planner.speed_m_per_s:g} is above {limit:.1f} m/s, the fastest that a {vehicle.name} can fly level; lower it"
    )
    return [(("planner", "speed"), text)]


def gains_fit(draft: Draft) -> list[tuple[Key, str]]:
    """The file of gains can be read."""
    control = draft.part(Control, "control")
    if control is None or control.gains == "default":
        return []
    try:
        load_gains(draft.folder / control.gains)
    except InputError as error:
        return [(("control", "gains"), line) for line in str(error).splitlines()]
    return []
