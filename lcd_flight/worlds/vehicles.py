"""Vehicles: `data/vehicles/*.yaml`, and a user's own file of the same form."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Annotated

from pydantic import Field, field_validator, model_validator

from lcd_flight.model import GeometricGains, InputError, Loop, OnboardController, PidGains, Vehicle
from lcd_flight.worlds.data_file import Strict, read

_DATA = Path(__file__).parent / "data" / "vehicles"
_ONBOARD = Path(__file__).parent / "data" / "onboard"

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Point = tuple[float, float, float]
Amounts = tuple[NotNegative, NotNegative, NotNegative]


class GainsData(Strict):
    """See `model.GeometricGains`."""

    position: Amounts
    velocity: Amounts
    attitude: NotNegative = 0.0
    body_rates: NotNegative = 0.0
    integral: Amounts = (0.0, 0.0, 0.0)
    integral_limit: NotNegative = 1.0


class PidData(Strict):
    """See `model.PidGains`."""

    kp: NotNegative
    ki: NotNegative
    kd: NotNegative
    integral_limit: NotNegative


class OnboardData(Strict):
    """See `model.OnboardController`."""

    rate_hz: Positive
    attitude: tuple[PidData, PidData, PidData]
    rates: tuple[PidData, PidData, PidData]
    thrust_limit: Annotated[float, Field(gt=0.0, le=1.0)]
    thrust_floor: Share = 0.0


class VehicleData(Strict):
    """A vehicle file; keys are those of `model.Vehicle`."""

    name: Annotated[str, Field(min_length=1)]
    sources: dict[str, str]
    """What stands where: a figure's key, or several in one key with commas between them, to its source."""
    mass_kg: Positive
    inertia_kg_m2: tuple[Positive, Positive, Positive]
    rotor_positions_m: tuple[Point, Point, Point, Point]
    rotor_directions: tuple[float, float, float, float]
    k_eta: Positive
    k_m: Positive
    k_d: NotNegative = 0.0
    k_z: NotNegative = 0.0
    k_h: NotNegative = 0.0
    k_flap: NotNegative = 0.0
    parasitic_drag: Amounts
    motor_time_constant_s: Positive
    rotor_speed_min: NotNegative = 0.0
    rotor_speed_max: Positive
    motor_noise: NotNegative = 0.0
    gains: GainsData
    flight_gains: GainsData | None = None
    """Left out: the same as `gains`."""
    onboard: OnboardData | None = None
    """A mapping, or the name of one that ships (`data/onboard`)."""

    @field_validator("onboard", mode="before")
    @classmethod
    def _by_name(cls, value: object) -> object:
        if not isinstance(value, str):
            return value
        names = sorted(path.stem for path in _ONBOARD.glob("*.yaml"))
        if value not in names:
            raise ValueError(f"no onboard controller of this name; there are: {', '.join(names)}")
        return read(_ONBOARD / f"{value}.yaml", OnboardData)

    @model_validator(mode="after")
    def _flyable(self) -> VehicleData:
        if any(abs(d) != 1.0 for d in self.rotor_directions) or sum(self.rotor_directions) != 0.0:
            raise ValueError("rotor_directions: two rotors turn one way (1) and two the other (-1)")
        if any(position[2] != 0.0 for position in self.rotor_positions_m):
            raise ValueError("rotor_positions_m: rotors lie in the plane of the centre of mass (z = 0)")
        if self.rotor_speed_min >= self.rotor_speed_max:
            raise ValueError("rotor_speed_min must be below rotor_speed_max")
        lift = 4.0 * self.k_eta * self.rotor_speed_max**2 / (self.mass_kg * 9.81)
        if lift <= 1.0:
            raise ValueError(f"thrust-to-weight is {lift:.2f}; it cannot hover")
        return self


def vehicle_names() -> list[str]:
    """The vehicles that ship."""
    return sorted(path.stem for path in _DATA.glob("*.yaml"))


def load_vehicle(name_or_path: str | Path) -> Vehicle:
    """A vehicle that ships, by name, or a user's, by the path of its YAML file.

    Raises:
        InputError: no such vehicle, or what is wrong in the file, a line for each key.
    """
    name = str(name_or_path)
    if name in vehicle_names():
        return _load(_DATA / f"{name}.yaml")
    path = Path(name_or_path)
    if path.suffix in (".yaml", ".yml") and path.is_file():
        return _vehicle(read(path, VehicleData))
    raise InputError(f"vehicle {name!r} is neither a vehicle file (*.yaml) nor one of: {', '.join(vehicle_names())}")


@cache
def _load(path: Path) -> Vehicle:
    return _vehicle(read(path, VehicleData))


_NOT_BINDING: Mapping[Loop, tuple[str, ...]] = {
    "paper": ("name", "source", "parasitic_drag", "motor_noise", "flight_gains", "onboard"),
    "flight": ("name", "source", "parasitic_drag", "motor_noise", "gains"),
}
"""What a model trained for one vehicle and loop may find different: names, disturbances, and the other loop's law."""


def fingerprint(vehicle: Vehicle, loop: Loop) -> str:
    """A short hash of the airframe and of the controllers that fly it in a loop: what a model is trained for."""
    figures = {key: value for key, value in asdict(vehicle).items() if key not in _NOT_BINDING[loop]}
    return hashlib.sha256(json.dumps(figures, sort_keys=True).encode()).hexdigest()[:16]


def _vehicle(data: VehicleData) -> Vehicle:
    """The vocabulary's dataclass."""
    figures = {k: getattr(data, k) for k in VehicleData.model_fields if k not in _CONVERTED}
    return Vehicle(
        **figures,
        gains=_gains(data.gains),
        flight_gains=_gains(data.flight_gains or data.gains),
        onboard=_onboard(data.onboard) if data.onboard else None,
        source="; ".join(f"{key}: {text}" for key, text in data.sources.items()),
    )


_CONVERTED = {"sources", "gains", "flight_gains", "onboard"}


def _gains(data: GainsData) -> GeometricGains:
    return GeometricGains(**data.model_dump())


def _onboard(data: OnboardData) -> OnboardController:
    roll, pitch, yaw = (PidGains(**axis.model_dump()) for axis in data.attitude)
    roll_rate, pitch_rate, yaw_rate = (PidGains(**axis.model_dump()) for axis in data.rates)
    return OnboardController(
        rate_hz=data.rate_hz,
        attitude=(roll, pitch, yaw),
        rates=(roll_rate, pitch_rate, yaw_rate),
        thrust_limit=data.thrust_limit,
        thrust_floor=data.thrust_floor,
    )
